"""Connected components of restricted Voronoi cells, and which of them are no disks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from anisomesh._arrays import FaceIndices
from anisomesh.voronoi.diagram import Diagram

Ints = npt.NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Cells:
    """Components of the cells of a diagram: C of them, ordered by site.

    Attributes
    ----------
    of_polygon
        Component of each polygon (P,).
    site
        Site of each component (C,).
    alone
        Whether the cell of its site has no other component (C,).
    area
        Area of each component (C,) in the embedding.
    centroid
        Centroid of each component (C, d).
    euler
        Euler characteristic of each component (C,); 1 for a disk.
    """

    of_polygon: Ints
    site: Ints
    alone: npt.NDArray[np.bool_]
    area: npt.NDArray[np.float64]
    centroid: npt.NDArray[np.float64]
    euler: Ints


def cells_of(diagram: Diagram, face_neighbours: FaceIndices, face_areas: npt.NDArray[np.float64]) -> Cells:
    """Return the components of the cells.

    Parameters
    ----------
    diagram
        The restricted Voronoi diagram.
    face_neighbours
        Face across each side (F, 3), -1 at a boundary, for the faces of the diagram.
    face_areas
        Area of each face in the embedding (F,).

    Notes
    -----
    Polygons of one site on two facets are joined when both reach the same mesh edge: the diagram on an edge
    is decided from the edge alone, so both reach it or neither does.
    """
    on_side = np.flatnonzero(diagram.label < 0)
    here = diagram.polygon_of[on_side]
    across = face_neighbours[diagram.facet[here], -1 - diagram.label[on_side]]
    inner = across >= 0
    there = diagram.polygon_index(across[inner], diagram.site[here[inner]])
    if (there < 0).any():
        raise RuntimeError("two facets disagree about the diagram on their common edge; please report this mesh")
    n = len(diagram.site)
    graph = coo_array((np.ones(len(there), dtype=np.int8), (here[inner], there)), shape=(n, n))
    _, labels = connected_components(graph, directed=False)
    _, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int32)
    order = np.lexsort((first, diagram.site[first]))
    rank[order] = np.arange(len(first), dtype=np.int32)
    of_polygon: Ints = rank[inverse]
    site = diagram.site[first][order]
    count = np.bincount(site, minlength=len(diagram.sites))
    area, centroid = _mass(diagram, of_polygon, len(site), face_areas)
    return Cells(
        of_polygon=of_polygon,
        site=site,
        alone=count[site] == 1,
        area=area,
        centroid=centroid,
        euler=_euler(diagram, of_polygon, len(site), face_neighbours),
    )


def _mass(
    diagram: Diagram, of_polygon: Ints, n: int, face_areas: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return area (C,) and centroid (C, d) of each component."""
    here = diagram.barycentric.T
    cross = here[0] * here[1][diagram.following] - here[1] * here[0][diagram.following]
    # triangles from barycentric corner c (0, 0, 1) to each edge: signed shares of area and of first moment
    moment = np.empty((len(diagram.site), 3))
    for c, apex in enumerate((0.0, 0.0, 1.0)):
        share = cross * (here[c] + here[c][diagram.following] + apex) / 3.0
        moment[:, c] = np.bincount(diagram.polygon_of, share, minlength=len(diagram.site))
    weight = face_areas[diagram.facet]
    area = np.asarray(np.bincount(of_polygon, diagram.fractions * weight, minlength=n), dtype=np.float64)
    corners = diagram.faces[diagram.facet]
    total = np.empty((n, diagram.points.shape[1]))
    for k, coordinate in enumerate(diagram.points.T):
        total[:, k] = np.bincount(of_polygon, weight * (moment * coordinate[corners]).sum(axis=1), minlength=n)
    centroid = diagram.sites[diagram.site[np.unique(of_polygon, return_index=True)[1]]].copy()
    np.divide(total, area[:, None], out=centroid, where=area[:, None] > 0.0)
    return area, centroid


def _euler(diagram: Diagram, of_polygon: Ints, n: int, face_neighbours: FaceIndices) -> Ints:
    """Return the Euler characteristic of each component (C,), sharing what polygons have in common."""
    side = np.flatnonzero(diagram.label < 0)
    facet = diagram.facet[diagram.polygon_of[side]]
    shared = np.zeros(len(diagram.label), dtype=bool)
    shared[side] = face_neighbours[facet, -1 - diagram.label[side]] >= 0
    point = diagram.point_at(side)
    valence = np.bincount(diagram.faces.ravel(), minlength=len(diagram.points))
    vertex = np.where(shared | shared[diagram.previous], 0.5, 1.0)
    vertex[side[point >= 0]] = 1.0 / valence[point[point >= 0]]
    vertex -= np.where(shared, 0.5, 1.0)  # the edge that leaves it
    euler = np.bincount(of_polygon, np.bincount(diagram.polygon_of, vertex) + 1.0, minlength=n)
    return np.asarray(np.rint(euler), dtype=np.int32)
