"""The restricted Voronoi diagram as data: polygons with symbolic vertices."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EmbeddedPoints, Faces, Sites
from anisomesh.mesh.embedded_surface import EmbeddedSurface

Ints = npt.NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Diagram:
    """Cells of the sites on every facet: P convex polygons with Q vertices in all.

    Polygons are ordered by facet, then by site, their vertices counter-clockwise in the facet. Polygon ``p``
    owns the vertices ``offset[p]`` to ``offset[p + 1] - 1``; edge ``k`` leads from vertex k to the next one.

    Attributes
    ----------
    embedded
        The embedded surface; ``facet`` refers to its faces.
    sites
        Positions (S, d).
    facet, site
        Facet and site of each polygon (P,).
    offset
        First vertex of each polygon (P + 1,).
    label
        Line of each edge (Q,): the site behind a bisector, or -1 - c for the side of the facet opposite corner c.
    barycentric
        Coordinates of the vertices in their facet (Q, 3).
    """

    embedded: EmbeddedSurface
    sites: Sites
    facet: Ints
    site: Ints
    offset: npt.NDArray[np.int64]
    label: Ints
    barycentric: npt.NDArray[np.float64]

    @property
    def points(self) -> EmbeddedPoints:
        """Points of the embedded surface (V, d)."""
        return self.embedded.points

    @property
    def faces(self) -> Faces:
        """Faces of the embedded surface (F, 3)."""
        return self.embedded.faces

    @cached_property
    def polygon_of(self) -> Ints:
        """Polygon of each vertex (Q,)."""
        return np.repeat(np.arange(len(self.site), dtype=np.int32), np.diff(self.offset))

    @cached_property
    def previous(self) -> Ints:
        """Vertex before each vertex in its polygon (Q,)."""
        result = np.arange(-1, len(self.label) - 1, dtype=np.int32)
        result[self.offset[:-1]] = self.offset[1:] - 1
        return result

    @cached_property
    def following(self) -> Ints:
        """Vertex after each vertex in its polygon (Q,)."""
        result = np.arange(1, len(self.label) + 1, dtype=np.int32)
        result[self.offset[1:] - 1] = self.offset[:-1]
        return result

    @cached_property
    def twin(self) -> Ints:
        """The same segment as an edge of the polygon behind each bisector edge (Q,), -1 for other edges."""
        edges = np.flatnonzero(self.label >= 0)
        polygon = self.polygon_of[edges]
        own, other = self.site[polygon].astype(np.int64), self.label[edges]
        key = self.facet[polygon].astype(np.int64) * len(self.sites) + np.minimum(own, other)
        edges = edges[np.argsort(key * len(self.sites) + np.maximum(own, other), kind="stable")]
        result = np.full(len(self.label), -1, dtype=np.int32)
        result[edges[0::2]], result[edges[1::2]] = edges[1::2], edges[0::2]
        return result

    @property
    def positions(self) -> npt.NDArray[np.float64]:
        """Embedded positions of the vertices (Q, d)."""
        return self.at(self.facet[self.polygon_of], self.barycentric)

    @cached_property
    def fractions(self) -> npt.NDArray[np.float64]:
        """Area of each polygon (P,) as a share of its facet."""
        here, there = self.barycentric, self.barycentric[self.following]
        cross = here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]
        return np.asarray(np.bincount(self.polygon_of, cross, minlength=len(self.site)))

    def at(self, facet: npt.NDArray[Any], barycentric: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return embedded positions (n, d) of points given by facet (n,) and barycentric coordinates (n, 3)."""
        return self.embedded.at(facet, barycentric)

    def point_at(self, vertices: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
        """Return the point of the surface that each of these vertices (n,) is, -1 where a bisector ends."""
        before, after = self.label[self.previous[vertices]], self.label[vertices]
        result = np.full(len(vertices), -1, dtype=np.int64)
        here = np.flatnonzero((before < 0) & (after < 0))
        corner = 5 + before[here] + after[here]  # the one that neither side is opposite to: -1 - c each, and 3 in all
        result[here] = self.faces[self.facet[self.polygon_of[vertices[here]]], corner]
        return result

    def polygon_index(self, facet: npt.NDArray[Any], site: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
        """Return the polygon of each (facet, site) pair, -1 where the cell does not reach the facet."""
        keys = self.facet.astype(np.int64) * len(self.sites) + self.site
        wanted = np.asarray(facet, dtype=np.int64) * len(self.sites) + site
        place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        return np.where(keys[place] == wanted, place, -1)


class DiagramPart(NamedTuple):
    """The polygons of some facets, as the kernel writes them."""

    facet: Ints
    site: Ints
    size: Ints
    label: Ints
    barycentric: npt.NDArray[np.float64]

    @classmethod
    def empty(cls, n_polygons: int, n_vertices: int) -> DiagramPart:
        """Return room for this many polygons and vertices."""
        facet, site, size = np.empty((3, n_polygons), dtype=np.int32)
        return cls(facet, site, size, np.empty(n_vertices, dtype=np.int32), np.empty((n_vertices, 3)))


def assemble(embedded: EmbeddedSurface, sites: Sites, parts: list[DiagramPart]) -> Diagram:
    """Return the diagram made of these parts, polygons in the order of facet and site; the list is emptied."""
    facet, site, size = (np.concatenate([part[k] for part in parts]) for k in range(3))
    order = np.lexsort((site, facet))
    offset = np.concatenate([[0], np.cumsum(size[order])])
    start = np.empty(len(order), dtype=np.int64)  # of each polygon in the result
    start[order] = offset[:-1]
    label, barycentric = np.empty(offset[-1], dtype=np.int32), np.empty((offset[-1], 3))
    while parts:  # one at a time, since they take as much room as the result
        part = parts.pop()
        start, here = start[: len(start) - len(part.size)], start[len(start) - len(part.size) :]
        target = np.repeat(here - np.cumsum(part.size) + part.size, part.size) + np.arange(len(part.label))
        label[target], barycentric[target] = part.label, part.barycentric
    return Diagram(embedded, sites, facet[order], site[order], offset, label, barycentric)
