"""Closest points of a surface, its normals there, and which triangles face away from it."""

from __future__ import annotations

from functools import cached_property

import igl
import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from anisomesh._arrays import FaceMask, FaceVectors, Points
from anisomesh.mesh.geometry import corner_angles, cross, unit
from anisomesh.mesh.intersections import Pairs, self_intersections
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys

_ON_SIDE_WEIGHT = 1e-6  # barycentric coordinate below which a point lies on a side; heuristic, far above rounding
_QUERIES_PER_BLOCK = 16_384  # bounds the temporary arrays of `locate` to a few megabytes
_NORMAL_OFFSET = 0.01  # offset of the second and third query of `clearly_facing` over sqrt(2 area); heuristic
_MIN_AGREEMENT_COSINE = 1e-3  # cosine above which two normals agree clearly; heuristic
_NORMAL_ROUNDING = 1e-9  # generous bound on the rounding of cosines and of sums of unit normals
_COINCIDENT_DISTANCE = 1e-7  # of the bounding-box diagonal: facets no farther apart coincide; heuristic
_FLAT_SQUARED_RATIO = 1e-20  # (2 area / longest side^2)^2 up to which a triangle is treated as a segment; heuristic

Vectors = npt.NDArray[np.float64]  # (n, 3)
Facets = npt.NDArray[np.int64]  # (n,), face indices
Cosines = npt.NDArray[np.float64]  # (n,)


class ClosestPoints:
    """Closest-point queries on a surface by an AABB tree (libigl), built once; lengths in model units."""

    def __init__(self, surface: Surface) -> None:
        self.surface = surface
        self._faces = surface.faces.astype(np.int64)
        self._tree = igl.AABB()
        self._tree.init(surface.points, self._faces)

    def squared_distances(self, queries: Vectors) -> npt.NDArray[np.float64]:
        """Return the squared distance (n,) of each query (n, 3) to the surface."""
        return np.asarray(self._query(queries)[0])

    def locate(self, queries: Vectors) -> tuple[Facets, Vectors]:
        """Return facet (n,) and barycentric coordinates (n, 3) of the closest point to each query (n, 3)."""
        facet, weights = np.empty(len(queries), dtype=np.int64), np.empty((len(queries), 3))
        for first in range(0, len(queries), _QUERIES_PER_BLOCK):
            block = slice(first, first + _QUERIES_PER_BLOCK)
            _, facet[block], closest = self._query(queries[block])
            weights[block] = barycentric(self.surface.points[self.surface.faces[facet[block]]], closest)
        return facet, weights

    def normals(self, queries: Vectors) -> FaceVectors:
        """Return the pseudonormal (n, 3), not normalised, at the closest point to each query (n, 3).

        In the interior of a facet this is the facet's unit normal, on an edge the sum of the unit normals of its
        faces, at a vertex their sum weighted by the corner angles. Opposite normals on an edge give exactly zero.

        References
        ----------
        Baerentzen, Aanaes, "Signed distance computation using the angle weighted pseudonormal", 2005.
        """
        return self.normals_at(*self.locate(queries))

    def normals_at(self, facet: Facets, weights: Vectors) -> FaceVectors:
        """Return the pseudonormals (n, 3) at points given by facet (n,) and barycentric coordinates (n, 3)."""
        at_zero = weights < _ON_SIDE_WEIGHT
        normals = self.surface.face_normals[facet].copy()
        on_edge = np.flatnonzero(at_zero.sum(axis=1) == 1)
        edge = self.surface.face_edges[facet[on_edge], np.argmax(at_zero[on_edge], axis=1)]
        normals[on_edge] = self._edge_normals[edge]
        at_point = np.flatnonzero(at_zero.sum(axis=1) == 2)
        point = self.surface.faces[facet[at_point], np.argmin(at_zero[at_point], axis=1)]
        normals[at_point] = self._point_normals[point]
        return normals

    def inverted(self, corners: Vectors) -> FaceMask:
        """Return which triangles (n, 3, 3) face away from the surface at the point closest to their barycentre.

        Triangles without area and triangles perpendicular to the surface are not inverted. Where two sheets of the
        surface coincide with opposite orientations, a triangle may face either of them.
        """
        normals = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return np.asarray(self._cosines(normals, corners.mean(axis=1)) < -_NORMAL_ROUNDING)

    def clearly_facing(self, corners: Vectors) -> FaceMask:
        """Return which triangles (n, 3, 3) are not inverted by a margin.

        The normals must agree at the points closest to the barycentre and to two points slightly above and below it.
        Halfway between the two sides of a thin part, or in a concave corner, rounding alone would decide whether a
        triangle is inverted; such a triangle does not face the surface clearly. Slightly is a hundredth of the
        triangle's size, or the distance of the barycentre from the surface if that is less: on the face of a plate
        thinner than a hundredth of the triangle nothing is in doubt.
        """
        normals = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        centre = corners.mean(axis=1)
        offset = _NORMAL_OFFSET * np.sqrt(np.linalg.norm(normals, axis=1))
        at_centre = self._cosines(normals, centre)
        lowest = np.minimum(at_centre, self._lowest_cosines(normals, centre, offset))
        doubtful = np.flatnonzero((at_centre > _MIN_AGREEMENT_COSINE) & (lowest <= _MIN_AGREEMENT_COSINE))
        distance = np.sqrt(self.squared_distances(centre[doubtful]))
        nearer = np.maximum(distance, _COINCIDENT_DISTANCE * self.surface.diagonal)
        lowest[doubtful] = np.where(
            nearer < offset[doubtful],
            self._lowest_cosines(normals[doubtful], centre[doubtful], nearer),
            lowest[doubtful],
        )
        return np.asarray(lowest > _MIN_AGREEMENT_COSINE)

    def _lowest_cosines(self, normals: Vectors, centre: Vectors, offset: npt.NDArray[np.float64]) -> Cosines:
        """Return the lower of the cosines (n,) at an offset (n,) above and below the barycentre of each triangle."""
        step = offset[:, None] * unit(normals)
        cosines = self._cosines(np.tile(normals, (2, 1)), np.concatenate([centre + step, centre - step]))
        return np.asarray(cosines.reshape(2, -1).min(axis=0))

    def _cosines(self, normals: Vectors, queries: Vectors) -> Cosines:
        """Return the cosine (n,) between normals (n, 3) of any length and the pseudonormals closest to the queries.

        Where an opposite facet coincides with the closest one, return the larger cosine.
        """
        facet, weights = self.locate(queries)
        normals = unit(normals)
        cosines = np.einsum("nx,nx->n", normals, unit(self.normals_at(facet, weights)))
        opposed = np.flatnonzero(cosines < _MIN_AGREEMENT_COSINE)
        if len(opposed) == 0 or self._opposite_facets.nnz == 0:
            return np.asarray(cosines)
        table = self._opposite_facets
        start, count = table.indptr[facet[opposed]], np.diff(table.indptr)[facet[opposed]]
        query = np.repeat(opposed, count)
        other = table.indices[np.repeat(start + count - np.cumsum(count), count) + np.arange(count.sum())]
        closest = np.einsum("nc,ncx->nx", weights[query], self.surface.points[self.surface.faces[facet[query]]])
        squared = squared_distances_to(self.surface.points[self.surface.faces[other]], closest)
        coincide = squared <= (_COINCIDENT_DISTANCE * self.surface.diagonal) ** 2
        other_cosines = np.einsum("nx,nx->n", normals[query], self.surface.face_normals[other])
        np.maximum.at(cosines, query[coincide], other_cosines[coincide])
        return np.asarray(cosines)

    def _query(self, queries: Vectors) -> tuple[npt.NDArray[np.float64], Facets, Vectors]:
        queries = np.ascontiguousarray(queries, dtype=np.float64).reshape(-1, 3)
        if len(queries) == 0:
            return np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, 3))
        squared, facet, closest = self._tree.squared_distance(self.surface.points, self._faces, queries)
        return np.asarray(squared), np.asarray(facet, dtype=np.int64), np.asarray(closest)

    @cached_property
    def intersecting_pairs(self) -> Pairs:
        """Pairs of facets (n, 2) that intersect, see :func:`~anisomesh.mesh.intersections.self_intersections`."""
        return self_intersections(self.surface)

    @cached_property
    def crossing_facets(self) -> ClosestPoints | None:
        """Closest points of the facets that intersect others or touch them along an edge, or None if there are none."""
        facets = np.union1d(self.intersecting_pairs, self._touching_facets)
        return ClosestPoints(Surface(self.surface.points, self.surface.faces[facets])) if len(facets) else None

    @cached_property
    def _touching_facets(self) -> Facets:
        """Facets (n,) with an edge that lies on an edge between other points, as where a non-manifold edge was cut."""
        surface = self.surface
        place = np.unique(surface.points, axis=0, return_inverse=True)[1].reshape(-1)
        keys = edge_keys(place[surface.edges])
        _, which, count = np.unique(keys, return_inverse=True, return_counts=True)
        touching = surface.edge_faces[count[which.reshape(-1)] > 1]
        return np.unique(touching[touching >= 0]).astype(np.int64)

    @cached_property
    def _opposite_facets(self) -> csr_array:
        """Pairs of coincident facets of opposite orientation, as a symmetric matrix (F, F)."""
        surface = self.surface
        first, second = self.intersecting_pairs.T
        normals, size = surface.face_normals, surface.n_faces
        offsets = surface.points[surface.faces[second]] - surface.points[surface.faces[first, 0]][:, None]
        height = np.abs(np.einsum("ncx,nx->nc", offsets, normals[first])).max(axis=1)
        opposite = np.einsum("nx,nx->n", normals[first], normals[second]) < 0.0
        opposite &= height <= _COINCIDENT_DISTANCE * surface.diagonal
        rows, columns = np.concatenate([[first, second], [second, first]], axis=1)[:, np.tile(opposite, 2)]
        return csr_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(size, size))

    @cached_property
    def _edge_normals(self) -> Vectors:
        surface = self.surface
        return _normal_sums(surface.face_edges, np.ones((surface.n_faces, 3)), surface.face_normals, len(surface.edges))

    @cached_property
    def _point_normals(self) -> Vectors:
        surface = self.surface
        return _normal_sums(
            surface.faces, corner_angles(surface.points[surface.faces]), surface.face_normals, surface.n_points
        )


def barycentric(corners: npt.NDArray[np.float64], points: Points) -> npt.NDArray[np.float64]:
    """Return barycentric coordinates (n, 3) of points (n, 3) in triangles (n, 3, 3), one point for each triangle.

    In a triangle without area, only the two ends of its longest side have weights.
    """
    sides = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    normal = cross(sides[:, 1], sides[:, 2])
    squared = np.einsum("nx,nx->n", normal, normal)
    length_squared = np.einsum("ncx,ncx->nc", sides, sides)
    to_corners = corners - points[:, None, :]
    parts = cross(to_corners[:, [1, 2, 0]], to_corners[:, [2, 0, 1]])
    weights = np.einsum("ncx,nx->nc", parts, normal)
    flat = squared <= _FLAT_SQUARED_RATIO * length_squared.max(axis=1) ** 2
    weights = np.maximum(np.where(flat[:, None], 0.0, weights), 0.0)
    rows = np.flatnonzero(flat)
    side = np.argmax(length_squared[rows], axis=1)
    start, end = (side + 1) % 3, (side + 2) % 3
    along = np.einsum("nx,nx->n", points[rows] - corners[rows, start], sides[rows, side])
    length = length_squared[rows, side]
    fraction = np.clip(np.divide(along, length, out=np.zeros_like(along), where=length > 0.0), 0.0, 1.0)
    weights[rows, start], weights[rows, end] = 1.0 - fraction, fraction
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def squared_distances_to(corners: Vectors, points: Vectors) -> npt.NDArray[np.float64]:
    """Return the squared distance (n,) of each point (n, 3) to the triangle (n, 3, 3) of the same index."""
    sides = corners[:, [1, 2, 0]] - corners
    to_point = points[:, None, :] - corners
    length_squared = np.einsum("ncx,ncx->nc", sides, sides)
    fraction = np.einsum("ncx,ncx->nc", to_point, sides)
    fraction = np.divide(fraction, length_squared, out=np.zeros_like(fraction), where=length_squared > 0.0)
    to_sides = to_point - np.clip(fraction, 0.0, 1.0)[:, :, None] * sides
    squared = np.einsum("ncx,ncx->nc", to_sides, to_sides).min(axis=1)
    normal = unit(cross(sides[:, 0], sides[:, 1]))
    inside = (np.einsum("ncx,nx->nc", cross(sides, to_point), normal) >= 0.0).all(axis=1) & normal.any(axis=1)
    height = np.einsum("nx,nx->n", to_point[:, 0], normal)
    return np.asarray(np.where(inside, height**2, squared))


def _normal_sums(
    target: npt.NDArray[np.int32], weight: npt.NDArray[np.float64], normals: Vectors, size: int
) -> npt.NDArray[np.float64]:
    """Return the weighted sums (size, 3) of face normals at edges or points; ``target`` and ``weight`` are (F, 3).

    Sums of opposite normals, which consist of rounding errors only, are set to zero.
    """
    terms = weight[:, :, None] * normals[:, None, :]
    columns = [np.bincount(target.ravel(), terms[:, :, axis].ravel(), minlength=size) for axis in range(3)]
    sums: Vectors = np.stack(columns, axis=1).astype(np.float64)
    sums[np.linalg.norm(sums, axis=1) < _NORMAL_ROUNDING] = 0.0
    return sums
