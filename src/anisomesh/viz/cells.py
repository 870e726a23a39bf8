"""Voronoi cells as they are drawn: polygons in one colour per cell, with the lines between the cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Indices, Points
from anisomesh.io.rvd import PolygonMesh

_SAME_POINT = 1e-7  # of the diagonal


@dataclass(frozen=True, kw_only=True)
class Cells:
    """Polygons to draw with one colour per cell.

    Parameters
    ----------
    points
        Corners (P, 3) in model units.
    offsets
        Where each polygon starts in ``corners``, and the end of the last (polygons + 1,).
    corners
        The point at each corner of each polygon, one polygon after the other.
    labels
        The cell of each polygon (polygons,).
    """

    points: Points
    offsets: Indices
    corners: Indices
    labels: Indices

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return len(np.unique(self.labels))

    def outlines(self) -> npt.NDArray[np.int64]:
        """Return the points at the ends of every side of a polygon beyond which its cell does not go on (n, 2).

        Notes
        -----
        Polygons meet side to side. Points are compared by place, since polygons may each have their own.
        """
        start = np.asarray(self.corners, dtype=np.int64)
        ahead = np.arange(1, len(start) + 1)
        ahead[np.asarray(self.offsets)[1:] - 1] = np.asarray(self.offsets)[:-1]
        end = start[ahead]
        diagonal = float(np.linalg.norm(np.ptp(self.points, axis=0))) or 1.0
        grid = np.round((self.points - self.points.min(axis=0)) / (_SAME_POINT * diagonal)).astype(np.int64)
        place = np.unique(grid, axis=0, return_inverse=True)[1].ravel()
        label = np.repeat(np.asarray(self.labels, dtype=np.int64), np.diff(self.offsets))
        sides = np.stack([np.minimum(place[start], place[end]), np.maximum(place[start], place[end]), label], axis=1)
        _, first, count = np.unique(sides, axis=0, return_index=True, return_counts=True)
        chosen = first[(count == 1) & (sides[first, 0] != sides[first, 1])]
        return np.stack([start[chosen], end[chosen]], axis=1)


def voronoi_cells(mesh: PolygonMesh) -> Cells:
    """Return a restricted Voronoi diagram, as of ``RemeshResult.polygons()``, as cells to draw."""
    return Cells(points=mesh.points, offsets=mesh.offset, corners=np.arange(len(mesh.points)), labels=mesh.cell)
