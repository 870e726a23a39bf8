"""The cells of a restricted Voronoi diagram as a complex: connected components and their topology."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.voronoi.diagram import Diagram

Ints = npt.NDArray[np.int32]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CellComplex:
    """A diagram and the C connected components of its cells, ordered by site.

    Attributes
    ----------
    diagram
        The restricted Voronoi diagram.
    of_polygon
        Component of each polygon (P,).
    site
        Site of each component (C,).
    """

    diagram: Diagram
    of_polygon: Ints
    site: Ints

    @property
    def embedded(self) -> EmbeddedSurface:
        """The embedded surface."""
        return self.diagram.embedded

    @property
    def n_components(self) -> int:
        """Number of components C."""
        return len(self.site)

    @cached_property
    def only_component(self) -> npt.NDArray[np.bool_]:
        """Which components (C,) are the whole cell of their site."""
        return np.asarray(np.bincount(self.site, minlength=len(self.diagram.sites))[self.site] == 1)

    @cached_property
    def polygon_areas(self) -> Floats:
        """Area of each polygon (P,) in the embedding."""
        return np.asarray(self.diagram.fractions * self.embedded.face_areas[self.diagram.facet])

    @cached_property
    def area(self) -> Floats:
        """Area of each component (C,) in the embedding."""
        return self.sums(self.polygon_areas)

    @cached_property
    def centroid(self) -> Floats:
        """Centroid of each component (C, d), the site where a component has no area."""
        diagram = self.diagram
        here = diagram.barycentric.T
        cross = here[0] * here[1][diagram.following] - here[1] * here[0][diagram.following]
        # triangles from barycentric corner c (0, 0, 1) to each edge: signed shares of area and of first moment
        moment = np.empty((len(diagram.site), 3))
        for c, apex in enumerate((0.0, 0.0, 1.0)):
            share = cross * (here[c] + here[c][diagram.following] + apex) / 3.0
            moment[:, c] = np.bincount(diagram.polygon_of, share, minlength=len(diagram.site))
        weight = self.embedded.face_areas[diagram.facet]
        corners = diagram.faces[diagram.facet]
        total = np.empty((self.n_components, self.embedded.dimension))
        for k, coordinate in enumerate(diagram.points.T):
            total[:, k] = self.sums(weight * (moment * coordinate[corners]).sum(axis=1))
        result = diagram.sites[self.site].copy()
        np.divide(total, self.area[:, None], out=result, where=self.area[:, None] > 0.0)
        return result

    @cached_property
    def euler(self) -> Ints:
        """Euler characteristic of each component (C,): 1 for a disk.

        Vertices and edges that several polygons share count for each by its share.
        """
        diagram = self.diagram
        side = np.flatnonzero(diagram.label < 0)
        facet = diagram.facet[diagram.polygon_of[side]]
        shared = np.zeros(len(diagram.label), dtype=bool)
        shared[side] = self.embedded.surface.face_neighbours[facet, -1 - diagram.label[side]] >= 0
        point = diagram.point_at(side)
        valence = np.bincount(diagram.faces.ravel(), minlength=len(diagram.points))
        vertex = np.where(shared | shared[diagram.previous], 0.5, 1.0)
        vertex[side[point >= 0]] = 1.0 / valence[point[point >= 0]]
        vertex -= np.where(shared, 0.5, 1.0)  # the edge that leaves it
        of_polygon = np.asarray(np.bincount(diagram.polygon_of, vertex) + 1.0, dtype=np.float64)
        return np.rint(self.sums(of_polygon)).astype(np.int32)

    def sums(self, values: Floats) -> Floats:
        """Return the sum over the polygons of each component (C, ...) of values (P, ...)."""
        flat = values.reshape(len(values), -1)
        sums = [np.bincount(self.of_polygon, column, minlength=self.n_components) for column in flat.T]
        return np.stack(sums, axis=1).astype(np.float64).reshape(self.n_components, *values.shape[1:])


def cell_complex(diagram: Diagram) -> CellComplex:
    """Return the connected components of the cells of a diagram.

    Notes
    -----
    Polygons of one site on two facets are joined where both reach the common mesh edge: the diagram on an edge is
    decided from the edge alone, so either both reach it or neither does.
    """
    on_side = np.flatnonzero(diagram.label < 0)
    here = diagram.polygon_of[on_side]
    across = diagram.embedded.surface.face_neighbours[diagram.facet[here], -1 - diagram.label[on_side]]
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
    return CellComplex(diagram, rank[inverse], diagram.site[first][order])
