"""Elementary geometry of triangles: normals, angles, flatness, and the frame in which remeshing is computed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, FaceVectors, Points, PointVectors, Vector3

_FLAT_THICKNESS = 1e-8  # area over squared longest side; thinner triangles have normals that are rounding; heuristic


def cross(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the cross products (..., 3) of vectors (..., 3): what :func:`numpy.cross` does, several times as fast."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    product[..., 0] = ay * bz - az * by
    product[..., 1] = az * bx - ax * bz
    product[..., 2] = ax * by - ay * bx
    return product


def face_cross(points: Points, faces: Faces) -> FaceVectors:
    """Return the cross products (F, 3) of two sides of each face: unit normal times twice the area."""
    a, b, c = points[faces[:, 0]], points[faces[:, 1]], points[faces[:, 2]]
    return cross(b - a, c - a)


def unit(vectors: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the vectors (..., d) divided by their length; zero vectors stay zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0))


def thickness(corners: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return area over squared longest side (n,) of triangles (n, 3, 3): 0 if degenerate, 0.433 if equilateral."""
    sides = corners - corners[:, [1, 2, 0]]
    area = 0.5 * np.linalg.norm(cross(sides[:, 0], sides[:, 1]), axis=1)
    longest = (sides**2).sum(axis=2).max(axis=1)
    return np.asarray(np.divide(area, longest, out=np.zeros_like(area), where=longest > 0.0))


def is_flat(corners: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Return which triangles (n, 3, 3) have no area: a thickness below 1e-8, so that rounding decides their normal."""
    return np.asarray(thickness(corners) < _FLAT_THICKNESS)


def corner_angles(corners: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the corner angles (n, 3), in radians, of triangles (n, 3, 3); 0 beside a side of length zero."""
    ahead = unit(corners[:, [1, 2, 0]] - corners)
    back = unit(corners[:, [2, 0, 1]] - corners)
    sine = np.linalg.norm(cross(ahead, back), axis=2)
    return np.asarray(np.arctan2(sine, np.einsum("fcx,fcx->fc", ahead, back)))


def point_normals(points: Points, faces: Faces) -> PointVectors:
    """Return the area-weighted unit normals (V, 3) of points; zero at a point without faces."""
    cross = face_cross(points, faces)
    corners = faces.ravel()
    sums = [np.bincount(corners, np.repeat(cross[:, axis], 3), minlength=len(points)) for axis in range(3)]
    return unit(np.stack(sums, axis=1).astype(np.float64))


@dataclass(frozen=True)
class Frame:
    """The map between model units and the frame of computation, in which the bounding box has centre 0 and diagonal 1.

    Remeshing works in this frame, so that tolerances and curvature limits are independent of the model's size.

    Attributes
    ----------
    centre
        Bounding-box centre (3,) in model units.
    scale
        Bounding-box diagonal in model units; 1 if that is zero.
    """

    centre: Vector3
    scale: float

    def to_unit(self, points: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """Map points (n, 3) from model units to the frame of computation."""
        return np.asarray((points - self.centre) / self.scale)

    def to_model(self, points: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """Map points (n, 3) from the frame of computation to model units."""
        return np.asarray(points * self.scale + self.centre)


def sums_at_points(values: npt.NDArray[np.float64], faces: Faces, n_points: int) -> npt.NDArray[np.float64]:
    """Return the sums (V, ...) of face values (F, ...) over the faces at each point."""
    flat, corners = np.repeat(values.reshape(len(faces), math.prod(values.shape[1:])), 3, axis=0), faces.ravel()
    sums = [np.bincount(corners, column, minlength=n_points) for column in flat.T]
    return np.stack(sums, axis=1).astype(np.float64).reshape(n_points, *values.shape[1:])


def unit_frame(points: Points) -> Frame:
    """Return the frame in which points (V, 3) have bounding-box diagonal 1 and centre 0."""
    low, high = points.min(axis=0), points.max(axis=0)
    return Frame(centre=0.5 * (low + high), scale=float(np.linalg.norm(high - low)) or 1.0)


def even_edge_length(area: float, n_vertices: int) -> float:
    """Return the edge length of a mesh of equilateral triangles with this area and number of vertices."""
    return float(np.sqrt(2.0 * area / (np.sqrt(3.0) * n_vertices)))
