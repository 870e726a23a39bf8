"""The creases of a surface as curves between corners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh.features.polylines import Curves, Floats, Ints
from anisomesh.mesh.surface import Surface


@dataclass(frozen=True, eq=False)
class CreaseCurves(Curves):
    """Creases of a surface in R^d as curves from corner to corner, or closed ones without a corner."""

    @property
    def ends(self) -> Ints:
        """Points at start and end of each curve (C, 2), -1 for closed ones."""
        ends = np.stack([self.point[self.first[:-1]], self.head[self.first[1:] - 1]], axis=1)
        return np.where(self.closed[:, None], -1, ends)


def crease_curves(
    positions: Floats, surface: Surface, creases: npt.NDArray[np.bool_], corners: npt.NDArray[np.bool_]
) -> CreaseCurves:
    """Return the creases of a surface as curves.

    Parameters
    ----------
    positions
        Where its points are in R^d (V, d); arc length is measured between these.
    surface
        The surface.
    creases
        Which of its edges (E,) are on a crease.
    corners
        Points (V,) at which curves end; all points that have one crease or more than two must be among them.
    """
    edge = np.flatnonzero(creases)
    ends = surface.edges[edge].astype(np.int64)
    halves = np.concatenate([ends, ends[:, ::-1]])  # half k goes along edge k % n
    n = len(edge)
    order = np.argsort(halves[:, 0], kind="stable")
    begins = np.searchsorted(halves[order, 0], np.arange(surface.n_points + 1))
    leaving, begins_list, heads = order.tolist(), begins.tolist(), halves[:, 1].tolist()
    at_corner = corners.tolist()
    left = [True] * n
    sides: list[int] = []
    lengths: list[int] = []
    closed: list[bool] = []
    from_corners = order[corners[halves[order, 0]]].tolist()
    for begin in [*from_corners, *range(n)]:
        half, before = begin, len(sides)
        while left[half % n]:
            left[half % n] = False
            sides.append(half)
            point = heads[half]
            if at_corner[point]:
                break
            one, other = leaving[begins_list[point] : begins_list[point + 1]]
            half = one if other % n == half % n else other
        if len(sides) > before:
            lengths.append(len(sides) - before)
            closed.append(not at_corner[heads[sides[-1]]])
    taken = np.array(sides, dtype=np.int64)
    face = surface.edge_faces[edge[taken % n], 0]
    corner = np.argmax(surface.face_edges[face] == edge[taken % n][:, None], axis=1)
    rank = np.full(surface.faces.shape, -1, dtype=np.int64)
    rank[face, corner] = np.arange(len(taken))
    return CreaseCurves.along(positions, rank, edge[taken % n], halves[taken], lengths, closed)
