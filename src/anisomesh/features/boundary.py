"""The boundary curves of an open surface and their corners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh.features.polylines import Curves, Floats, Ints
from anisomesh.mesh.surface import Surface

_TURN = 45.0  # degrees by which a curve turns at a corner
_FINE = 1.0 / 8.0  # of the distance over which turns are measured: corners that are sharp at this scale too stay apart
_REACH = 1.0 / 12.0  # of a curve is the longest distance over which its turn at a point is measured


@dataclass(frozen=True, eq=False)
class BoundaryCurves(Curves):
    """The boundary of a surface in R^d as closed polygons, the surface on the left; sides and corners of it."""

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


def boundary_curves(positions: Floats, surface: Surface) -> BoundaryCurves:
    """Return the boundary curves of an oriented manifold surface.

    Parameters
    ----------
    positions
        Where its points are in R^d (V, d); arc length is measured between these.
    surface
        The surface.
    """
    faces, face_neighbours = surface.faces, surface.face_neighbours
    face, corner = np.nonzero(face_neighbours < 0)
    tail, head = faces[face, (corner + 1) % 3].astype(np.int64), faces[face, (corner + 2) % 3].astype(np.int64)
    leaving = {point: side for side, point in enumerate(tail.tolist())}
    heads = head.tolist()
    order: list[int] = []
    lengths: list[int] = []
    left = np.ones(len(face), dtype=bool)
    for begin in range(len(face)):
        side, before = begin, len(order)
        while left[side]:
            left[side] = False
            order.append(side)
            side = leaving[heads[side]]
        if len(order) > before:
            lengths.append(len(order) - before)
    sides = np.array(order, dtype=np.int64)
    rank = np.full(faces.shape, -1, dtype=np.int64)
    rank[face[sides], corner[sides]] = np.arange(len(sides))
    edge = surface.face_edges[face[sides], corner[sides]].astype(np.int64)
    ends = np.stack([tail[sides], head[sides]], axis=1)
    return BoundaryCurves.along(positions, rank, edge, ends, lengths, [True] * len(lengths))
