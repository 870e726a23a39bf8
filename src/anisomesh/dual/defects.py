"""What keeps a dual triangulation from being a valid mesh, and where."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceVectors
from anisomesh.cvt.diagram import Diagram
from anisomesh.dual.cells import Cells
from anisomesh.dual.triangulate import Dual
from anisomesh.surface import geometry, topology


@dataclass(frozen=True, eq=False)
class Defects:
    """Bad triangles and bad cells of a dual.

    Attributes
    ----------
    flipped
        Triangles (T,) whose normal is turned against the facet that holds their diagram vertex.
    tangled
        Triangles (T,) with a corner twice, with the corners of another triangle, at an edge that is not
        shared by two triangles (or one, on the boundary), or at a corner whose triangles form no single fan.
    no_disk
        Cell components (C,) that are no disks.
    """

    flipped: npt.NDArray[np.bool_]
    tangled: npt.NDArray[np.bool_]
    no_disk: npt.NDArray[np.bool_]

    @property
    def n(self) -> int:
        """Number of bad triangles and cells."""
        return int((self.flipped | self.tangled).sum() + self.no_disk.sum())


def find_defects(diagram: Diagram, cells: Cells, dual: Dual, face_normals: FaceVectors) -> Defects:
    """Return the defects of a dual triangulation; ``face_normals`` (F, 3) are those of the diagram's faces."""
    facet = diagram.facet[diagram.polygon_of[dual.vertex]]
    cross = geometry.face_cross(dual.points[:, :3], dual.faces)
    flipped = np.einsum("tk,tk->t", cross, face_normals[facet]) <= 0.0
    return Defects(flipped=flipped, tangled=_tangled(dual.faces, len(cells.site)), no_disk=cells.euler != 1)


def _tangled(faces: npt.NDArray[np.int32], n_points: int) -> npt.NDArray[np.bool_]:
    """Return the triangles (T,) around which the connectivity is not that of a manifold."""
    if len(faces) == 0:
        return np.zeros(0, dtype=bool)
    ordered = np.sort(faces, axis=1)
    repeated = (ordered[:, 0] == ordered[:, 1]) | (ordered[:, 1] == ordered[:, 2])
    _, inverse, count = np.unique(ordered, axis=0, return_inverse=True, return_counts=True)
    edges, face_edges = topology.edges_of(faces)
    uses = np.bincount(face_edges.ravel(), minlength=len(edges))
    bad_point = np.zeros(n_points, dtype=bool)
    bad_point[topology.nonmanifold_points(faces)] = True
    return repeated | (count[inverse.ravel()] > 1) | (uses[face_edges] > 2).any(axis=1) | bad_point[faces].any(axis=1)


def insertion_points(diagram: Diagram, cells: Cells, dual: Dual, defects: Defects, spacing: float) -> npt.NDArray[np.float64]:
    """Return embedded points (n, d) where new sites take the defects apart.

    For a bad triangle that is its diagram vertex, for a bad cell its point farthest from the site; both are
    vertices of the diagram, whose distance to the nearest site is that to the site of their cell. Points
    nearer than ``spacing`` to a site are left out, and of points whose empty balls overlap only the one
    farthest from its site is taken in this round.
    """
    vertex = np.concatenate(
        [dual.vertex[defects.flipped | defects.tangled], _farthest(diagram, cells.of_polygon, defects.no_disk)]
    )
    position = diagram.at(diagram.facet[diagram.polygon_of[vertex]], diagram.barycentric[vertex])
    radius = np.linalg.norm(position - diagram.sites[diagram.site[diagram.polygon_of[vertex]]], axis=1)
    order = np.argsort(-radius, kind="stable")
    position, radius = position[order], radius[order]
    chosen: list[int] = []
    for k in range(len(position)):
        if radius[k] <= spacing:
            break
        if not chosen or (np.linalg.norm(position[chosen] - position[k], axis=1) >= radius[chosen]).all():
            chosen.append(k)
    return position[chosen]


def _farthest(diagram: Diagram, of_polygon: npt.NDArray[np.int32], wanted: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """Return, for each component wanted, its diagram vertex farthest from the site."""
    vertex = np.flatnonzero(wanted[of_polygon[diagram.polygon_of]])
    if len(vertex) == 0:
        return vertex
    polygon = diagram.polygon_of[vertex]
    position = diagram.at(diagram.facet[polygon], diagram.barycentric[vertex])
    distance = np.linalg.norm(position - diagram.sites[diagram.site[polygon]], axis=1)
    component = of_polygon[polygon]
    order = np.lexsort((-distance, component))
    first = np.unique(component[order], return_index=True)[1]
    return vertex[order[first]]
