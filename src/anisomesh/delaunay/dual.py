"""The dual of the restricted Voronoi diagram: the restricted Delaunay triangulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EmbeddedPoints, FaceIndices, Faces, PointScalars
from anisomesh.delaunay.dual_edges import dual_edges
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.voronoi.cells import CellComplex, cell_complex
from anisomesh.voronoi.diagram import Diagram


@dataclass(frozen=True, eq=False)
class Dual:
    """Triangles that join cell components, glued along dual edges: a delta complex.

    Attributes
    ----------
    points
        One point per component (C, d) in the embedding.
    faces
        Components of each triangle (T, 3), oriented like the facet in which they meet.
    face_edges
        The dual edge opposite corner 0, 1, 2 of each triangle (T, 3). Triangles with a common dual edge are neighbours,
        even where another dual edge joins the same two components.
    edge_points
        A point of the embedded surface on every dual edge (K, d), on the boundary if the dual edge ends there.
    vertex
        Vertex of the diagram that each triangle is dual to (T,).
    """

    points: EmbeddedPoints
    faces: Faces
    face_edges: FaceIndices
    edge_points: EmbeddedPoints
    vertex: npt.NDArray[np.int64]


def dual_mesh(cells: CellComplex) -> Dual:
    """Return the dual triangulation of a diagram.

    A triangle stands for every point where three cells meet. It joins the components that meet there, not the sites,
    so both sides of a thin sheet get vertices of their own. A component that is the whole cell of its site has the
    position of the site, which the normal metric has drawn to the features; any other its centroid. If all cells are
    disks, the triangles glued along dual edges are homeomorphic to the surface.

    Notes
    -----
    Counter-clockwise around a vertex of the polygon of site i follow the cell behind the incoming edge and the cell
    behind the outgoing edge; each vertex is taken once, from its polygon of lowest site.
    """
    diagram = cells.diagram
    before, after = diagram.label[diagram.previous], diagram.label
    own = diagram.site[diagram.polygon_of]
    vertex = np.flatnonzero((before > own) & (after > own))
    facet = diagram.facet[diagram.polygon_of[vertex]]
    second = diagram.polygon_index(facet, before[vertex])
    third = diagram.polygon_index(facet, after[vertex])
    polygons = np.stack([diagram.polygon_of[vertex], second, third], axis=1)
    edge = dual_edges(diagram)
    # around the vertex, the edge that arrives in the second polygon is the one between second and third
    across = diagram.previous[diagram.twin[diagram.previous[vertex]]]
    return Dual(
        points=np.where(cells.only_component[:, None], diagram.sites[cells.site], cells.centroid),
        faces=cells.of_polygon[polygons].astype(np.int32),
        face_edges=np.stack([edge[across], edge[vertex], edge[diagram.previous[vertex]]], axis=1),
        edge_points=_edge_points(diagram, edge),
        vertex=vertex,
    )


def dual_squared_errors(diagram: Diagram, weights: PointScalars | None = None) -> PointScalars | None:
    """Return the squared distance of each point of the surface (V,) to the dual of a diagram, None if that is empty.

    They are multiplied by weights (V,) if there are any.
    """
    dual, embedded = dual_mesh(cell_complex(diagram)), diagram.embedded
    if len(dual.faces) == 0:
        return None
    mesh = Surface(dual.points[:, :3] / embedded.scale, dual.faces)
    squared = ClosestPoints(mesh).squared_distances(embedded.surface.points)
    return squared if weights is None else weights * squared


def _edge_points(diagram: Diagram, edge: npt.NDArray[np.int32]) -> EmbeddedPoints:
    """Return the end of every dual edge on the boundary, or else the middle of its middle segment (K, d)."""
    segments = np.flatnonzero(edge >= 0)
    segments = segments[np.argsort(edge[segments], kind="stable")]
    count = np.bincount(edge[segments])
    middle = segments[np.cumsum(count) - count + count // 2]
    facet = diagram.facet[diagram.polygon_of[middle]]
    points = diagram.at(facet, 0.5 * (diagram.barycentric[middle] + diagram.barycentric[diagram.following[middle]]))
    facet = diagram.facet[diagram.polygon_of[segments]]
    face_neighbours = diagram.embedded.surface.face_neighbours
    for vertex, side in (
        (segments, diagram.label[diagram.previous[segments]]),
        (diagram.following[segments], diagram.label[diagram.following[segments]]),
    ):
        ends = np.flatnonzero((side < 0) & (face_neighbours[facet, -1 - np.minimum(side, -1)] < 0))
        points[edge[segments[ends]]] = diagram.at(facet[ends], diagram.barycentric[vertex[ends]])
    return points
