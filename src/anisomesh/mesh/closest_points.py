"""Closest points of a surface, and which way it faces there."""

from __future__ import annotations

from functools import cached_property

import igl
import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from anisomesh._arrays import FaceMask, FaceVectors, Points
from anisomesh.mesh.geometry import corner_angles, unit
from anisomesh.mesh.intersections import self_intersections
from anisomesh.mesh.surface import Surface

_ON_SIDE = 1e-6
_BLOCK = 16_384  # queries at a time, so that the memory in between is bounded
_MARGIN = 0.01  # of the square root of twice the area of a triangle
_CLEAR = 1e-3  # least cosine between normals that agree clearly
_ROUNDING = 1e-9  # of cosines, and of sums of unit normals
_SAME_SHEET = 1e-7  # of the diagonal: sheets so near to each other lie on each other

Vectors = npt.NDArray[np.float64]
Rows = npt.NDArray[np.int64]


class ClosestPoints:
    """A search tree over the facets of a surface, built once for many queries."""

    def __init__(self, surface: Surface) -> None:
        self.surface = surface
        self._faces = surface.faces.astype(np.int64)
        self._tree = igl.AABB()
        self._tree.init(surface.points, self._faces)

    def squared_distances(self, queries: Vectors) -> npt.NDArray[np.float64]:
        """Return the squared distance (n,) of each point (n, 3) to the surface."""
        return np.asarray(self._query(queries)[0])

    def locate(self, queries: Vectors) -> tuple[Rows, Vectors]:
        """Return facet (n,) and barycentric coordinates (n, 3) of the closest point to each point (n, 3)."""
        facet, weights = np.empty(len(queries), dtype=np.int64), np.empty((len(queries), 3))
        for first in range(0, len(queries), _BLOCK):
            block = slice(first, first + _BLOCK)
            _, facet[block], closest = self._query(queries[block])
            weights[block] = barycentric(self.surface.points[self.surface.faces[facet[block]]], closest)
        return facet, weights

    def normals(self, queries: Vectors) -> FaceVectors:
        """Return the normal of the surface at the closest point to each query (n, 3), of any length.

        Inside a facet that is the facet's normal, on an edge the sum of the unit normals of the faces there, at a
        point their sum weighted by the angles at the point. On an edge whose faces lie on each other it is zero.

        References
        ----------
        Baerentzen, Aanaes, "Signed distance computation using the angle weighted pseudonormal", 2005.
        """
        return self.normals_at(*self.locate(queries))

    def normals_at(self, facet: Rows, weights: Vectors) -> FaceVectors:
        """Return the same for points given by facet (n,) and barycentric coordinates (n, 3)."""
        at_zero = weights < _ON_SIDE
        normals = self.surface.face_normals[facet].copy()
        on_edge = np.flatnonzero(at_zero.sum(axis=1) == 1)
        edge = self.surface.face_edges[facet[on_edge], np.argmax(at_zero[on_edge], axis=1)]
        normals[on_edge] = self._edge_normals[edge]
        at_point = np.flatnonzero(at_zero.sum(axis=1) == 2)
        point = self.surface.faces[facet[at_point], np.argmin(at_zero[at_point], axis=1)]
        normals[at_point] = self._point_normals[point]
        return normals

    def inverted(self, corners: Vectors) -> FaceMask:
        """Return which triangles (n, 3, 3) face away from the surface where it is closest to their barycentre.

        A triangle without area is not turned, nor is one at a right angle to the surface. Where two sheets of the
        surface lie on each other and face opposite ways, one of them is enough.
        """
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return np.asarray(self._cosines(normals, corners.mean(axis=1)) < -_ROUNDING)

    def clearly_facing(self, corners: Vectors) -> FaceMask:
        """Return which triangles (n, 3, 3) are not turned by a margin.

        Also where the surface is closest to points a little over and under the barycentre, the normals agree by more
        than rounding. A triangle half way between the two sides of a thin part, or in a concave corner, is turned or
        not by the rounding of distances alone; it does not face clearly.
        """
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        centre = corners.mean(axis=1)
        lift = _MARGIN * unit(normals) * np.sqrt(np.linalg.norm(normals, axis=1, keepdims=True))
        cosines = [self._cosines(normals, place) for place in (centre, centre + lift, centre - lift)]
        return np.asarray(np.min(cosines, axis=0) > _CLEAR)

    def _cosines(self, normals: Vectors, queries: Vectors) -> npt.NDArray[np.float64]:
        """Return the cosine (n,) between normals of any length and those of the surface closest to the queries.

        Where a sheet of the surface lies on the closest one, the larger cosine.
        """
        facet, weights = self.locate(queries)
        normals = unit(normals)
        cosines = np.einsum("nx,nx->n", normals, unit(self.normals_at(facet, weights)))
        against = np.flatnonzero(cosines < _CLEAR)
        if len(against) == 0 or self._opposite.nnz == 0:
            return np.asarray(cosines)
        start, count = self._opposite.indptr[facet[against]], np.diff(self._opposite.indptr)[facet[against]]
        which = np.repeat(against, count)
        other = self._opposite.indices[np.repeat(start + count - np.cumsum(count), count) + np.arange(count.sum())]
        place = np.einsum("nc,ncx->nx", weights[which], self.surface.points[self.surface.faces[facet[which]]])
        there = squared_distances_to(self.surface.points[self.surface.faces[other]], place)
        same = there <= (_SAME_SHEET * self.surface.diagonal) ** 2
        found = np.einsum("nx,nx->n", normals[which], self.surface.face_normals[other])
        np.maximum.at(cosines, which[same], found[same])
        return np.asarray(cosines)

    def _query(self, queries: Vectors) -> tuple[npt.NDArray[np.float64], Rows, Vectors]:
        queries = np.ascontiguousarray(queries, dtype=np.float64).reshape(-1, 3)
        if len(queries) == 0:
            return np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, 3))
        squared, facet, closest = self._tree.squared_distance(self.surface.points, self._faces, queries)
        return np.asarray(squared), np.asarray(facet, dtype=np.int64), np.asarray(closest)

    @cached_property
    def _opposite(self) -> csr_array:
        """Facets that lie on each facet and face the other way (F, F)."""
        surface = self.surface
        first, second = self_intersections(surface).T
        normals, size = surface.face_normals, surface.n_faces
        apart = surface.points[surface.faces[second]] - surface.points[surface.faces[first, 0]][:, None]
        height = np.abs(np.einsum("ncx,nx->nc", apart, normals[first])).max(axis=1)
        flat = (height <= _SAME_SHEET * surface.diagonal) & (
            np.einsum("nx,nx->n", normals[first], normals[second]) < 0.0
        )
        rows, columns = np.concatenate([[first, second], [second, first]], axis=1)[:, np.tile(flat, 2)]
        return csr_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(size, size))

    @cached_property
    def _edge_normals(self) -> Vectors:
        surface = self.surface
        return _summed(surface.face_edges, np.ones((surface.n_faces, 3)), surface.face_normals, len(surface.edges))

    @cached_property
    def _point_normals(self) -> Vectors:
        surface = self.surface
        return _summed(
            surface.faces, corner_angles(surface.points[surface.faces]), surface.face_normals, surface.n_points
        )


def barycentric(corners: npt.NDArray[np.float64], points: Points) -> npt.NDArray[np.float64]:
    """Return barycentric coordinates (n, 3) of points of triangles (n, 3, 3); on a flat one, along its longest side."""
    sides = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    normal = np.cross(sides[:, 1], sides[:, 2])
    squared = np.einsum("nx,nx->n", normal, normal)
    longest_squared = np.einsum("ncx,ncx->nc", sides, sides)
    to_corners = corners - points[:, None, :]
    parts = np.cross(to_corners[:, [1, 2, 0]], to_corners[:, [2, 0, 1]])
    weights = np.einsum("ncx,nx->nc", parts, normal)
    flat = squared <= 1e-20 * longest_squared.max(axis=1) ** 2
    weights = np.maximum(np.where(flat[:, None], 0.0, weights), 0.0)
    rows = np.flatnonzero(flat)
    side = np.argmax(longest_squared[rows], axis=1)
    start, end = (side + 1) % 3, (side + 2) % 3
    along = np.einsum("nx,nx->n", points[rows] - corners[rows, start], sides[rows, side])
    length = longest_squared[rows, side]
    share = np.clip(np.divide(along, length, out=np.zeros_like(along), where=length > 0.0), 0.0, 1.0)
    weights[rows, start], weights[rows, end] = 1.0 - share, share
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def squared_distances_to(corners: Vectors, points: Vectors) -> npt.NDArray[np.float64]:
    """Return the squared distance (n,) of points (n, 3) to triangles (n, 3, 3), one to one."""
    sides = corners[:, [1, 2, 0]] - corners
    to_point = points[:, None, :] - corners
    length = np.einsum("ncx,ncx->nc", sides, sides)
    share = np.einsum("ncx,ncx->nc", to_point, sides)
    share = np.clip(np.divide(share, length, out=np.zeros_like(share), where=length > 0.0), 0.0, 1.0)
    to_sides = to_point - share[:, :, None] * sides
    squared = np.einsum("ncx,ncx->nc", to_sides, to_sides).min(axis=1)
    normal = unit(np.cross(sides[:, 0], sides[:, 1]))
    inside = (np.einsum("ncx,nx->nc", np.cross(sides, to_point), normal) >= 0.0).all(axis=1) & normal.any(axis=1)
    height = np.einsum("nx,nx->n", to_point[:, 0], normal)
    return np.asarray(np.where(inside, height**2, squared))


def _summed(
    target: npt.NDArray[np.int32], weight: npt.NDArray[np.float64], normals: Vectors, size: int
) -> npt.NDArray[np.float64]:
    """Return the face normals summed over the edges or points (F, 3) of the faces, with weights (F, 3).

    Sums that are rounding alone, where faces lie on each other and face opposite ways, are zero.
    """
    terms = weight[:, :, None] * normals[:, None, :]
    columns = [np.bincount(target.ravel(), terms[:, :, axis].ravel(), minlength=size) for axis in range(3)]
    sums: Vectors = np.stack(columns, axis=1).astype(np.float64)
    sums[np.linalg.norm(sums, axis=1) < _ROUNDING] = 0.0
    return sums
