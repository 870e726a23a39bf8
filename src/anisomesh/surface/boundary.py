"""The boundary curves of an open surface: sides in order, arc length, corners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceIndices, Faces

_TURN = 45.0  # degrees by which a curve turns at a corner
_FINE = 1.0 / 8.0  # of the distance over which turns are measured: corners that are sharp at this scale too stay apart
_REACH = 1.0 / 12.0  # of a curve is the longest distance over which its turn at a point is measured

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BoundaryCurves:
    """The boundary of a surface in R^d as closed polygons, measured by one running arc length.

    Attributes
    ----------
    point
        Start of each side (B,), curve by curve, the surface on the left.
    curve
        Curve of each side (B,), from 0 on.
    start
        Arc length at the start of each side (B + 1,); a curve begins where the one before it ends.
    first
        First side of each curve (C + 1,).
    rank
        Where the side opposite each corner is in this order (F, 3), -1 where it is not on the boundary.
    positions
        Points of the surface (V, d).
    """

    point: Ints
    curve: Ints
    start: Floats
    first: Ints
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
        """Return places (n,) brought into their curves by whole turns."""
        low, high = self.limits[curve].T
        length = np.maximum(high - low, np.finfo(np.float64).tiny)
        return np.asarray(low + np.mod(place - low, length))

    def at(self, place: Floats, curve: Ints) -> Floats:
        """Return the points (n, d) at these arc lengths (n,), of any number of turns, on these curves (n,)."""
        place = self.wrapped(place, curve)
        side = np.searchsorted(self.start, place, side="right") - 1
        side = np.clip(side, self.first[curve], self.first[curve + 1] - 1)
        length = np.maximum(self.start[side + 1] - self.start[side], np.finfo(np.float64).tiny)
        share = np.clip((place - self.start[side]) / length, 0.0, 1.0)[:, None]
        after = np.where(side + 1 == self.first[self.curve[side] + 1], self.first[self.curve[side]], side + 1)
        return np.asarray((1.0 - share) * self.positions[self.point[side]] + share * self.positions[self.point[after]])

    def turns(self, reach: float) -> Floats:
        """Return by how many degrees the curve turns at the start of each side (B,), seen in space.

        It is the angle between the chords to the points at arc length ``reach`` before and after, or a twelfth of a
        shorter curve, so that teeth much smaller than that do not count.
        """
        low, high = self.limits[self.curve].T
        reach_here = np.minimum(reach, _REACH * (high - low))
        here = self.positions[self.point, :3]
        back, ahead = (self.at(self.start[:-1] + way * reach_here, self.curve)[:, :3] - here for way in (-1.0, 1.0))
        lengths = np.linalg.norm(back, axis=1) * np.linalg.norm(ahead, axis=1)
        cosine = np.divide(-(back * ahead).sum(axis=1), lengths, out=np.ones_like(lengths), where=lengths > 0.0)
        return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))

    def corners(self, reach: float, sharp_ends: Ints) -> tuple[Ints, Floats]:
        """Return the sides (n,) that start at a corner, and how much the curve turns there (n,).

        Parameters
        ----------
        reach
            Arc length over which turns are measured. Of corners nearer to each other than that only the one of
            the larger turn counts, but for those that are as sharp over an eighth of it.
        sharp_ends
            Points of the surface at which a crease meets the boundary; they are corners too, before all others.
        """
        turn, fine = self.turns(reach), self.turns(_FINE * reach)
        turn[np.isin(self.point, sharp_ends)] = 180.0
        candidate = np.flatnonzero(turn > _TURN)
        low, high = self.limits[self.curve[candidate]].T
        near = np.minimum(reach, _REACH * (high - low)) * np.where(fine[candidate] > _TURN, _FINE, 1.0)
        chosen: list[int] = []
        taken = np.zeros(len(candidate), dtype=bool)
        for k in np.argsort(-turn[candidate], kind="stable").tolist():
            if taken[k]:
                continue
            chosen.append(int(candidate[k]))
            apart = np.abs(self.start[candidate] - self.start[candidate[k]])
            apart = np.minimum(apart, (high - low) - apart)
            taken |= (self.curve[candidate] == self.curve[candidate[k]]) & (apart < near)
        sides = np.array(sorted(chosen), dtype=np.int64)
        return sides, turn[sides]


def boundary_curves(positions: Floats, faces: Faces, face_neighbours: FaceIndices) -> BoundaryCurves:
    """Return the boundary curves of an oriented manifold surface.

    Parameters
    ----------
    positions
        Points of the surface (V, d); arc length is measured between these.
    faces
        Triangles (F, 3).
    face_neighbours
        Face across the side opposite each corner (F, 3), -1 at the boundary.
    """
    face, corner = np.nonzero(face_neighbours < 0)
    tail, head = faces[face, (corner + 1) % 3].astype(np.int64), faces[face, (corner + 2) % 3].astype(np.int64)
    leaving = {point: side for side, point in enumerate(tail.tolist())}
    heads = head.tolist()
    order: list[int] = []
    first = [0]
    left = np.ones(len(face), dtype=bool)
    for begin in range(len(face)):
        side = begin
        while left[side]:
            left[side] = False
            order.append(side)
            side = leaving[heads[side]]
        if len(order) > first[-1]:
            first.append(len(order))
    sides = np.array(order, dtype=np.int64)
    rank = np.full(faces.shape, -1, dtype=np.int64)
    rank[face[sides], corner[sides]] = np.arange(len(sides))
    length = np.linalg.norm(positions[head[sides]] - positions[tail[sides]], axis=1)
    return BoundaryCurves(
        point=tail[sides],
        curve=np.repeat(np.arange(len(first) - 1), np.diff(first)),
        start=np.concatenate([[0.0], np.cumsum(length)]),
        first=np.array(first, dtype=np.int64),
        rank=rank,
        positions=np.asarray(positions),
    )
