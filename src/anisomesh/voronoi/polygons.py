"""The restricted Voronoi diagram as a polygon mesh in space."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Points
from anisomesh.io.rvd import PolygonMesh
from anisomesh.voronoi.diagram import Diagram


def polygon_mesh(diagram: Diagram, of_polygon: npt.NDArray[np.int32], points: Points) -> PolygonMesh:
    """Return the polygons of a diagram on the surface in space whose embedding it lies on.

    Parameters
    ----------
    diagram
        The diagram.
    of_polygon
        Cell component of each polygon (P,).
    points
        Points (V, 3) of the surface in space.
    """
    corners = points[diagram.faces[diagram.facet[diagram.polygon_of]]]
    positions = np.einsum("qc,qcx->qx", diagram.barycentric, corners)
    return PolygonMesh(points=positions, offset=diagram.offset, cell=of_polygon)
