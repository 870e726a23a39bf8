"""Polygons of Voronoi cells for a picture, and the lines between the cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Indices, Points
from anisomesh.io.rvd import PolygonMesh

POINT_MERGE_TOLERANCE = 1e-7  # bounding-box diagonals; well above rounding, well below a pixel


@dataclass(frozen=True, kw_only=True)
class CellPolygons:
    """Polygons with the number of their cell, to draw with one colour per cell.

    Parameters
    ----------
    points
        Points (P, 3) in model units.
    offsets
        Start of each polygon in ``corners``, and the end of the last (polygons + 1,).
    corners
        Index of the point at each corner, one polygon after the other (corners,).
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
        """Return the sides of polygons that bound their cell, as pairs of points (n, 2).

        Notes
        -----
        Neighbouring polygons share whole sides. Points are compared by position, since polygons need not share points.
        """
        start = np.asarray(self.corners, dtype=np.int64)
        ahead = np.arange(1, len(start) + 1)
        ahead[np.asarray(self.offsets)[1:] - 1] = np.asarray(self.offsets)[:-1]
        end = start[ahead]
        diagonal = float(np.linalg.norm(np.ptp(self.points, axis=0))) or 1.0
        grid = np.round((self.points - self.points.min(axis=0)) / (POINT_MERGE_TOLERANCE * diagonal)).astype(np.int64)
        place = np.unique(grid, axis=0, return_inverse=True)[1].ravel()
        label = np.repeat(np.asarray(self.labels, dtype=np.int64), np.diff(self.offsets))
        sides = np.stack([np.minimum(place[start], place[end]), np.maximum(place[start], place[end]), label], axis=1)
        _, first, count = np.unique(sides, axis=0, return_index=True, return_counts=True)
        chosen = first[(count == 1) & (sides[first, 0] != sides[first, 1])]
        return np.stack([start[chosen], end[chosen]], axis=1)


def voronoi_cells(mesh: PolygonMesh) -> CellPolygons:
    """Return the polygons of a restricted Voronoi diagram, from ``RemeshResult.polygons()``, for a picture."""
    return CellPolygons(points=mesh.points, offsets=mesh.offset, corners=np.arange(len(mesh.points)), labels=mesh.cell)
