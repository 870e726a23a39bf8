"""Polygonal curves on the edges of a surface, measured by arc length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Curves:
    """Curves along edges of a surface in R^d, closed or not, with one running arc length.

    Attributes
    ----------
    point, head
        Start and end of each side (B,), curve by curve.
    curve
        Curve of each side (B,), from 0 on.
    start
        Arc length at the start of each side (B + 1,); a curve begins where the one before it ends.
    first
        First side of each curve (C + 1,).
    closed
        Whether each curve ends where it begins and goes on there (C,).
    edge
        Edge of the surface that each side is (B,).
    rank
        The side that is opposite each corner of a face (F, 3), -1 for none. A side within the surface is named by one
        of its two faces only.
    positions
        Points of the surface (V, d).
    """

    point: Ints
    head: Ints
    curve: Ints
    start: Floats
    first: Ints
    closed: npt.NDArray[np.bool_]
    edge: Ints
    rank: Ints
    positions: Floats

    @property
    def n_curves(self) -> int:
        """Number of curves."""
        return len(self.first) - 1

    @property
    def limits(self) -> Floats:
        """Arc length at the ends of each curve (C, 2)."""
        return np.stack([self.start[self.first[:-1]], self.start[self.first[1:]]], axis=1)

    def wrapped(self, place: Floats, curve: Ints) -> Floats:
        """Return places (n,) brought into their curves: by whole turns, or to the nearer end of one that is open."""
        low, high = self.limits[curve].T
        length = np.maximum(high - low, np.finfo(np.float64).tiny)
        around = low + np.mod(place - low, length)
        return np.asarray(np.where(self.closed[curve], around, np.clip(place, low, high)))

    def side_at(self, place: Floats, curve: Ints) -> Ints:
        """Return the sides (n,) at these arc lengths (n,), of any number of turns, on these curves (n,)."""
        side = np.searchsorted(self.start, self.wrapped(place, curve), side="right") - 1
        return np.clip(side, self.first[curve], self.first[curve + 1] - 1)

    def at(self, place: Floats, curve: Ints) -> Floats:
        """Return the points (n, d) at these arc lengths (n,), of any number of turns, on these curves (n,)."""
        place, side = self.wrapped(place, curve), self.side_at(place, curve)
        length = np.maximum(self.start[side + 1] - self.start[side], np.finfo(np.float64).tiny)
        share = np.clip((place - self.start[side]) / length, 0.0, 1.0)[:, None]
        return np.asarray((1.0 - share) * self.positions[self.point[side]] + share * self.positions[self.head[side]])

    @classmethod
    def along(
        cls, positions: Floats, rank: Ints, edge: Ints, ends: Ints, lengths: list[int], closed: list[bool]
    ) -> Self:
        """Return curves.

        Parameters
        ----------
        positions, rank, edge
            As above.
        ends
            Start and end of each side (B, 2), curve by curve.
        lengths, closed
            Number of sides of each curve (C,), and whether it is closed.
        """
        length = np.linalg.norm(positions[ends[:, 1]] - positions[ends[:, 0]], axis=1)
        return cls(
            point=ends[:, 0],
            head=ends[:, 1],
            curve=np.repeat(np.arange(len(lengths)), np.array(lengths, dtype=np.int64)),
            start=np.concatenate([[0.0], np.cumsum(length)]),
            first=np.concatenate([[0], np.cumsum(np.array(lengths, dtype=np.int64))]).astype(np.int64),
            closed=np.array(closed, dtype=bool),
            edge=edge,
            rank=rank,
            positions=np.asarray(positions),
        )
