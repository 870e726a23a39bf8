"""The dual of the restricted Voronoi diagram: the restricted Delaunay triangulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceIndices, Faces, Points
from anisomesh.delaunay.dual_edges import chains
from anisomesh.mesh.surface import Surface
from anisomesh.voronoi.cells import Cells
from anisomesh.voronoi.diagram import Diagram


@dataclass(frozen=True, eq=False)
class Dual:
    """Triangles that join cell components, glued along chains of bisector segments.

    Attributes
    ----------
    points
        One point per component (C, d) in the embedding.
    faces
        Components of each triangle (T, 3), oriented as the input facet in which they meet.
    face_edges
        The chain that each side, opposite corner 0, 1, 2, is dual to (T, 3). Triangles with a chain in common are
        neighbours, even where another chain joins the same two components.
    edge_points
        A point of the embedded surface on every chain (K, d), on the boundary if the chain ends there.
    vertex
        Vertex of the diagram that each triangle is dual to (T,).
    """

    points: Points
    faces: Faces
    face_edges: FaceIndices
    edge_points: Points
    vertex: npt.NDArray[np.int64]


def dual_mesh(diagram: Diagram, cells: Cells, surface: Surface) -> Dual:
    """Return the dual triangulation of a diagram.

    A triangle stands for every point where three cells meet, and joins the components that meet there, not
    the sites, so both sides of a thin sheet get vertices of their own. A component that is the whole cell of
    its site takes the position of the site, which the normal metric has drawn to the features; another takes
    its centroid. When every cell is a disk the triangles, glued along chains, make up the surface again.

    Parameters
    ----------
    diagram, cells
        The diagram and the components of its cells.
    surface
        The surface, its faces in the order of the diagram.

    Notes
    -----
    Counter-clockwise around a vertex of the polygon of site i follow the cell behind the edge that arrives
    and the cell behind the edge that leaves; each vertex is taken once, from its polygon of lowest site.
    """
    before, after = diagram.label[diagram.previous], diagram.label
    own = diagram.site[diagram.polygon_of]
    vertex = np.flatnonzero((before > own) & (after > own))
    facet = diagram.facet[diagram.polygon_of[vertex]]
    second = diagram.polygon_index(facet, before[vertex])
    third = diagram.polygon_index(facet, after[vertex])
    polygons = np.stack([diagram.polygon_of[vertex], second, third], axis=1)
    chain = chains(diagram, surface.face_edges)
    # around the vertex, the edge that arrives in the second polygon is the one between second and third
    across = diagram.previous[diagram.twin[diagram.previous[vertex]]]
    return Dual(
        points=np.where(cells.alone[:, None], diagram.sites[cells.site], cells.centroid),
        faces=cells.of_polygon[polygons].astype(np.int32),
        face_edges=np.stack([chain[across], chain[vertex], chain[diagram.previous[vertex]]], axis=1),
        edge_points=_chain_points(diagram, chain, surface.face_neighbours),
        vertex=vertex,
    )


def _chain_points(diagram: Diagram, chain: npt.NDArray[np.int32], face_neighbours: FaceIndices) -> Points:
    """Return the end of every chain on the boundary of the surface, or else the middle of its middle segment (K, d)."""
    segments = np.flatnonzero(chain >= 0)
    segments = segments[np.argsort(chain[segments], kind="stable")]
    count = np.bincount(chain[segments])
    middle = segments[np.cumsum(count) - count + count // 2]
    facet = diagram.facet[diagram.polygon_of[middle]]
    points = diagram.at(facet, 0.5 * (diagram.barycentric[middle] + diagram.barycentric[diagram.following[middle]]))
    facet = diagram.facet[diagram.polygon_of[segments]]
    for vertex, side in (
        (segments, diagram.label[diagram.previous[segments]]),
        (diagram.following[segments], diagram.label[diagram.following[segments]]),
    ):
        ends = np.flatnonzero((side < 0) & (face_neighbours[facet, -1 - np.minimum(side, -1)] < 0))
        points[chain[segments[ends]]] = diagram.at(facet[ends], diagram.barycentric[vertex[ends]])
    return points
