"""The boundary loops of an open surface as polylines, and their corners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh.features.polylines import FeaturePolylines, Floats, Ints
from anisomesh.mesh.surface import Surface

CORNER_TURN = 45.0  # degrees by which a boundary or crease turns at a corner; heuristic
_FINE_SCALE = 1.0 / 8.0  # of the arc length over which turns are measured: corners sharp at this scale too are all kept
_MAX_TURN_SCALE = 1.0 / 12.0  # of the length of a loop: longest arc length over which its turns are measured


@dataclass(frozen=True, eq=False)
class BoundaryLoops(FeaturePolylines):
    """Boundary loops as closed polylines, the surface on their left."""

    def turns(self, reach: float) -> Floats:
        """Return the turning angle in space, in degrees, at the start of each segment (B,).

        It is measured between the chords to the points at arc length ``reach`` before and after, or a twelfth of a
        shorter loop, so that much smaller notches do not count.
        """
        low, high = self.limits[self.polyline].T
        reach_here = np.minimum(reach, _MAX_TURN_SCALE * (high - low))
        here = self.positions[self.tail, :3]
        back, ahead = (self.at(self.start[:-1] + way * reach_here, self.polyline)[:, :3] - here for way in (-1.0, 1.0))
        lengths = np.linalg.norm(back, axis=1) * np.linalg.norm(ahead, axis=1)
        cosine = np.divide(-(back * ahead).sum(axis=1), lengths, out=np.ones_like(lengths), where=lengths > 0.0)
        return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))

    def corners(self, reach: float, sharp_ends: Ints, kept: Ints | None = None) -> tuple[Ints, Floats]:
        """Return the segments (n,) that start at a corner, and the turning angles there (n,) in degrees.

        Parameters
        ----------
        reach
            Arc length over which turns are measured. Of several corners within it only the sharpest is kept, unless
            the others are as sharp when measured over an eighth of it.
        sharp_ends
            Points of the surface where a crease meets the boundary, or a vertex is wanted: as sharp as can be.
        kept
            Points of these that are as sharp over an eighth of the reach, so that sharper ones near them do not count.
        """
        turn, fine = self.turns(reach), self.turns(_FINE_SCALE * reach)
        turn[np.isin(self.tail, sharp_ends)] = 180.0
        if kept is not None:
            fine[np.isin(self.tail, kept)] = 180.0
        candidate = np.flatnonzero(turn > CORNER_TURN)
        low, high = self.limits[self.polyline[candidate]].T
        near = np.minimum(reach, _MAX_TURN_SCALE * (high - low)) * np.where(
            fine[candidate] > CORNER_TURN, _FINE_SCALE, 1.0
        )
        chosen: list[int] = []
        taken = np.zeros(len(candidate), dtype=bool)
        for k in np.argsort(-turn[candidate], kind="stable").tolist():
            if taken[k]:
                continue
            chosen.append(int(candidate[k]))
            apart = np.abs(self.start[candidate] - self.start[candidate[k]])
            apart = np.minimum(apart, (high - low) - apart)
            taken |= (self.polyline[candidate] == self.polyline[candidate[k]]) & (apart < near)
        segments = np.array(sorted(chosen), dtype=np.int64)
        return segments, turn[segments]


def trace_boundary(positions: Floats, surface: Surface) -> BoundaryLoops:
    """Return the boundary loops of an oriented manifold surface.

    Parameters
    ----------
    positions
        Points in R^d (V, d), between which arc length is measured.
    surface
        The surface.
    """
    faces, face_neighbours = surface.faces, surface.face_neighbours
    face, corner = np.nonzero(face_neighbours < 0)
    tail, head = faces[face, (corner + 1) % 3].astype(np.int64), faces[face, (corner + 2) % 3].astype(np.int64)
    leaving = {point: side for side, point in enumerate(tail.tolist())}
    heads = head.tolist()
    order: list[int] = []
    sizes: list[int] = []
    left = np.ones(len(face), dtype=bool)
    for begin in range(len(face)):
        side, before = begin, len(order)
        while left[side]:
            left[side] = False
            order.append(side)
            side = leaving[heads[side]]
        if len(order) > before:
            sizes.append(len(order) - before)
    sides = np.array(order, dtype=np.int64)
    segment_of_side = np.full(faces.shape, -1, dtype=np.int64)
    segment_of_side[face[sides], corner[sides]] = np.arange(len(sides))
    edge = surface.face_edges[face[sides], corner[sides]].astype(np.int64)
    ends = np.stack([tail[sides], head[sides]], axis=1)
    return BoundaryLoops.of_segments(
        positions, ends, sizes, [True] * len(sizes), edge=edge, segment_of_side=segment_of_side
    )
