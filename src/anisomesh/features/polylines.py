"""Feature polylines: boundaries and creases as polygonal curves on the edges of a surface, measured by arc length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FeaturePolylines:
    """C polylines of B segments along edges of a surface in R^d, open or closed, with one running arc length.

    Attributes
    ----------
    tail, head
        Points at the start and end of each segment (B,), polyline by polyline.
    polyline
        Polyline of each segment (B,).
    start
        Arc length at the start of each segment (B + 1,), in embedding units; a polyline begins where the previous one
        ends.
    first
        First segment of each polyline (C + 1,).
    closed
        Which polylines are closed (C,).
    edge
        Edge of the surface under each segment (B,).
    segment_of_side
        Segment on the side opposite each corner of a face (F, 3), -1 for none. A segment inside the surface is listed
        for one of its two faces only.
    positions
        Points of the surface (V, d).
    """

    tail: Ints
    head: Ints
    polyline: Ints
    start: Floats
    first: Ints
    closed: npt.NDArray[np.bool_]
    edge: Ints
    segment_of_side: Ints
    positions: Floats

    @property
    def n_polylines(self) -> int:
        """Number of polylines C."""
        return len(self.first) - 1

    @property
    def limits(self) -> Floats:
        """Arc length at both ends of each polyline (C, 2)."""
        return np.stack([self.start[self.first[:-1]], self.start[self.first[1:]]], axis=1)

    @property
    def ends(self) -> Ints:
        """Points at the start and end of each polyline (C, 2), -1 for closed ones."""
        ends = np.stack([self.tail[self.first[:-1]], self.head[self.first[1:] - 1]], axis=1)
        return np.where(self.closed[:, None], -1, ends)

    def wrapped(self, place: Floats, polyline: Ints) -> Floats:
        """Return arc lengths (n,) moved onto their polylines: modulo the length if closed, clamped to it if open."""
        low, high = self.limits[polyline].T
        length = np.maximum(high - low, np.finfo(np.float64).tiny)
        around = low + np.mod(place - low, length)
        return np.asarray(np.where(self.closed[polyline], around, np.clip(place, low, high)))

    def segment_at(self, place: Floats, polyline: Ints) -> Ints:
        """Return the segments (n,) at arc lengths (n,) on polylines (n,)."""
        segment = np.searchsorted(self.start, self.wrapped(place, polyline), side="right") - 1
        return np.clip(segment, self.first[polyline], self.first[polyline + 1] - 1)

    def at(self, place: Floats, polyline: Ints) -> Floats:
        """Return the points (n, d) at arc lengths (n,) on polylines (n,)."""
        place, segment = self.wrapped(place, polyline), self.segment_at(place, polyline)
        length = np.maximum(self.start[segment + 1] - self.start[segment], np.finfo(np.float64).tiny)
        share = np.clip((place - self.start[segment]) / length, 0.0, 1.0)[:, None]
        tail, head = self.positions[self.tail[segment]], self.positions[self.head[segment]]
        return np.asarray((1.0 - share) * tail + share * head)

    @classmethod
    def of_segments(
        cls, positions: Floats, ends: Ints, sizes: list[int], closed: list[bool], *, edge: Ints, segment_of_side: Ints
    ) -> Self:
        """Return polylines made of segments.

        Parameters
        ----------
        positions
            Points of the surface (V, d).
        ends
            Points at both ends of each segment (B, 2), polyline by polyline.
        sizes, closed
            Number of segments of each polyline (C,), and whether it is closed.
        edge, segment_of_side
            As the attributes.
        """
        length = np.linalg.norm(positions[ends[:, 1]] - positions[ends[:, 0]], axis=1)
        counts = np.array(sizes, dtype=np.int64)
        return cls(
            tail=ends[:, 0],
            head=ends[:, 1],
            polyline=np.repeat(np.arange(len(sizes)), counts),
            start=np.concatenate([[0.0], np.cumsum(length)]),
            first=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            closed=np.array(closed, dtype=bool),
            edge=edge,
            segment_of_side=segment_of_side,
            positions=np.asarray(positions),
        )
