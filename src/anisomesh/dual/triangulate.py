"""The dual of the restricted Voronoi diagram: the restricted Delaunay triangulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh.cvt.diagram import Diagram
from anisomesh.dual.cells import Cells


@dataclass(frozen=True, eq=False)
class Dual:
    """Triangles that join cell components.

    Attributes
    ----------
    points
        One point per component (C, d) in the embedding.
    faces
        Components of each triangle (T, 3), oriented as the input facet in which they meet.
    vertex
        Vertex of the diagram that each triangle is dual to (T,).
    """

    points: Points
    faces: Faces
    vertex: npt.NDArray[np.int64]


def dual_mesh(diagram: Diagram, cells: Cells) -> Dual:
    """Return the dual triangulation of a diagram.

    A triangle stands for every point where three cells meet, and joins the components that meet there, not
    the sites, so both sides of a thin sheet get vertices of their own. A component that is the whole cell of
    its site takes the position of the site, which the normal metric has drawn to the features; another takes
    its centroid.

    Notes
    -----
    Counter-clockwise around a vertex of the polygon of site i follow the cell behind the edge that arrives
    and the cell behind the edge that leaves; each vertex is taken once, from its polygon of lowest site.
    """
    before, after = diagram.label[diagram.previous], diagram.label
    own = diagram.site[diagram.polygon_of]
    vertex = np.flatnonzero((before > own) & (after > own))
    facet = diagram.facet[diagram.polygon_of[vertex]]
    polygons = np.stack(
        [
            diagram.polygon_of[vertex],
            diagram.polygon_index(facet, before[vertex]),
            diagram.polygon_index(facet, after[vertex]),
        ],
        axis=1,
    )
    points = np.where(cells.alone[:, None], diagram.sites[cells.site], cells.centroid)
    return Dual(points=points, faces=cells.of_polygon[polygons].astype(np.int32), vertex=vertex)
