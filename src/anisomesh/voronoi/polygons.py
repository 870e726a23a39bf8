"""The cells of a restricted Voronoi diagram as polygons in space."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import Points
from anisomesh.io.rvd import PolygonMesh
from anisomesh.voronoi.cells import CellComplex


def cell_polygons(cells: CellComplex, points: Points) -> PolygonMesh:
    """Return the polygons of a diagram in space.

    Parameters
    ----------
    cells
        The cells of the diagram.
    points
        Positions in space (V, 3) of the points of the embedded surface.
    """
    diagram = cells.diagram
    corners = points[diagram.faces[diagram.facet[diagram.polygon_of]]]
    positions = np.einsum("qc,qcx->qx", diagram.barycentric, corners)
    return PolygonMesh(points=positions, offset=diagram.offset, cell=cells.of_polygon)
