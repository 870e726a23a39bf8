"""The immutable triangle mesh that every stage takes and returns."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import (
    EdgeIndices,
    Edges,
    FaceIndices,
    Faces,
    FaceScalars,
    FaceVectors,
    PointMask,
    Points,
    PointVectors,
)
from anisomesh.errors import MeshError
from anisomesh.mesh import geometry, topology
from anisomesh.mesh.html import html_table


@dataclass(frozen=True, eq=False)
class Surface:
    """An immutable triangle mesh in 3-D.

    Parameters
    ----------
    points
        Coordinates (V, 3) in model units; copied to float64.
    faces
        Point indices (F, 3), counted from 0, counter-clockwise seen from outside; copied to int32.

    Raises
    ------
    MeshError
        If an array has the wrong shape, a coordinate is not finite, an index is out of range or not an integer, or
        there is no face.

    Notes
    -----
    Only what is listed under Raises is validated. Surfaces may be non-manifold, inconsistently oriented, open or
    degenerate and may have unused points; :func:`~anisomesh.repair.prepare.prepare` makes an oriented manifold.

    Every other attribute is derived from the two arrays, computed on first use and cached: the edges (E, 2), the
    adjacency of faces and edges, normals, areas and lengths. Lengths are in model units and normals are unit vectors.
    Indices are int32, -1 means "none". Column ``c`` of the tables (F, 3) per side refers to the side *opposite* corner
    ``c``, from corner ``c + 1`` to ``c + 2``. ``points`` and ``faces`` are read-only; do not write to derived tables
    either, since stages and threads share them.
    """

    points: Points
    faces: Faces

    def __post_init__(self) -> None:
        points, faces = _validated(self.points, self.faces)
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "faces", faces)

    def __repr__(self) -> str:
        return f"Surface({self.n_points:,} points, {self.n_faces:,} faces)"

    def _repr_html_(self) -> str:
        return html_table("Surface", [("points", f"{self.n_points:,}"), ("faces", f"{self.n_faces:,}")])

    @property
    def n_points(self) -> int:
        """Number of points, V."""
        return len(self.points)

    @property
    def n_faces(self) -> int:
        """Number of faces, F."""
        return len(self.faces)

    @cached_property
    def _edge_tables(self) -> tuple[Edges, FaceIndices]:
        return topology.edges_of(self.faces)

    @property
    def edges(self) -> Edges:
        """Unique undirected edges (E, 2), lower index first, in lexicographic order."""
        return self._edge_tables[0]

    @property
    def face_edges(self) -> FaceIndices:
        """Index of the edge opposite each corner, (F, 3)."""
        return self._edge_tables[1]

    @cached_property
    def edge_face_count(self) -> npt.NDArray[np.int32]:
        """Number of faces at each edge, (E,): 1 at a boundary edge, 2 in the interior, more at a non-manifold edge."""
        return np.bincount(self.face_edges.ravel(), minlength=len(self.edges)).astype(np.int32)

    @cached_property
    def edge_faces(self) -> EdgeIndices:
        """The two faces at each edge, (E, 2): the second is -1 at a boundary edge, both at a non-manifold edge."""
        return topology.edge_faces(self.face_edges, len(self.edges))

    @cached_property
    def on_boundary(self) -> PointMask:
        """Which points (V,) are end points of a boundary edge."""
        mask = np.zeros(self.n_points, dtype=bool)
        mask[self.edges[self.edge_face_count == 1]] = True
        return mask

    @cached_property
    def face_neighbours(self) -> FaceIndices:
        """Face across the side opposite each corner, (F, 3); -1 at boundary and non-manifold edges."""
        return topology.face_neighbours(self.face_edges, self.edge_faces)

    @cached_property
    def face_normals(self) -> FaceVectors:
        """Unit normals of the faces (F, 3); zero where a face has no area."""
        return geometry.unit(geometry.face_cross(self.points, self.faces))

    @cached_property
    def face_areas(self) -> FaceScalars:
        """Areas of the faces (F,), in model units squared."""
        return np.asarray(0.5 * np.linalg.norm(geometry.face_cross(self.points, self.faces), axis=1))

    @cached_property
    def face_stretch(self) -> FaceScalars:
        """Stretch of the faces (F,): 1 for an equilateral one, infinite for one without area.

        Notes
        -----
        The ratio of the singular values of the linear map from an equilateral triangle. With side lengths a, b, c and
        area A, ``q = (a^2 + b^2 + c^2) / (4 sqrt(3) A)`` is half the sum of the ratio and its inverse, so the ratio is
        ``q + sqrt(q^2 - 1)``.
        """
        squares = (self.edge_lengths[self.face_edges] ** 2).sum(axis=1)
        half_sum = np.full(self.n_faces, np.inf)
        np.divide(squares, 4.0 * np.sqrt(3.0) * self.face_areas, out=half_sum, where=self.face_areas > 0.0)
        half_sum = np.maximum(half_sum, 1.0)
        return np.asarray(half_sum + np.sqrt(half_sum**2 - 1.0))

    @cached_property
    def point_normals(self) -> PointVectors:
        """Area-weighted unit normals of the points (V, 3); zero at a point without faces."""
        return geometry.point_normals(self.points, self.faces)

    @cached_property
    def area(self) -> float:
        """Total area in model units squared."""
        return float(self.face_areas.sum())

    @cached_property
    def volume(self) -> float | None:
        """Enclosed volume, negative if the faces are oriented inwards; None if the surface has a boundary."""
        if self.on_boundary.any():
            return None
        a, b, c = np.moveaxis(self.points[self.faces] - self.points[self.faces].mean(axis=(0, 1)), 1, 0)
        return float(np.einsum("fx,fx->", a, np.cross(b, c)) / 6.0)

    @cached_property
    def diagonal(self) -> float:
        """Length of the diagonal of the bounding box, in model units."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @cached_property
    def edge_lengths(self) -> npt.NDArray[np.float64]:
        """Lengths of the edges (E,), in model units."""
        return np.asarray(np.linalg.norm(self.points[self.edges[:, 0]] - self.points[self.edges[:, 1]], axis=1))

    def with_points(self, points: npt.NDArray[Any]) -> Surface:
        """Return a surface with the same faces on other points (V, 3)."""
        return Surface(np.asarray(points), self.faces)


def _validated(points: npt.NDArray[Any], faces: npt.NDArray[Any]) -> tuple[Points, Faces]:
    try:
        points, faces = np.asarray(points), np.asarray(faces)
    except ValueError as error:
        raise MeshError(
            f"points or faces have rows of different lengths ({error}); triangulate polygons first"
        ) from error
    if points.dtype.kind not in "biuf":
        raise MeshError(f"points has dtype {points.dtype}; expected real numbers")
    points = np.array(points, dtype=np.float64, order="C")
    if points.ndim != 2 or points.shape[1] != 3:
        raise MeshError(f"points has shape {points.shape}; expected (V, 3), one row x, y, z for each point")
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise MeshError(f"faces has shape {faces.shape}; expected (F, 3); triangulate polygons first")
    if len(faces) == 0:
        raise MeshError("the mesh has no face; expected at least one triangle")
    if not np.issubdtype(faces.dtype, np.integer):
        raise MeshError(f"faces has dtype {faces.dtype}; expected integers; convert with faces.astype(int)")
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise MeshError(
            f"points[{bad[0]}] = {points[bad[0]].tolist()} is not finite ({len(bad)} such points); correct them"
        )
    bad = np.flatnonzero(((faces < 0) | (faces >= len(points))).any(axis=1))
    if len(bad):
        raise MeshError(
            f"faces[{bad[0]}] = {faces[bad[0]].tolist()} has an index out of range; expected 0 to {len(points) - 1} "
            f"since there are {len(points)} points ({len(bad)} such faces)"
        )
    faces = np.array(faces, dtype=np.int32, order="C")
    points.flags.writeable = False
    faces.flags.writeable = False
    return points, faces
