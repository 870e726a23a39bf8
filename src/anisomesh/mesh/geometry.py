"""Elementary geometry of triangles: cross products, normals, the frame that everything is computed in."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, FaceVectors, Points, PointVectors, Vector3

_FLAT = 1e-8  # thickness below which a triangle has no area to speak of


def face_cross(points: Points, faces: Faces) -> FaceVectors:
    """Return the cross product of two sides of each face (F, 3): normal times twice the area."""
    a, b, c = points[faces[:, 0]], points[faces[:, 1]], points[faces[:, 2]]
    return np.asarray(np.cross(b - a, c - a))


def unit(vectors: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the vectors (..., d) divided by their length; zero vectors stay zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0))


def thickness(corners: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return area over squared longest side (n,) of triangles (n, 3, 3): 0 for a flat one, 0.433 for a regular one."""
    sides = corners - corners[:, [1, 2, 0]]
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    longest = (sides**2).sum(axis=2).max(axis=1)
    return np.asarray(np.divide(area, longest, out=np.zeros_like(area), where=longest > 0.0))


def is_flat(corners: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Return which triangles (n, 3, 3) are less than 1e-8 thick, so without area: rounding decides where they face."""
    return np.asarray(thickness(corners) < _FLAT)


def corner_angles(corners: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the angles in radians (n, 3) at the corners of triangles (n, 3, 3); 0 beside a side without length."""
    ahead = unit(corners[:, [1, 2, 0]] - corners)
    back = unit(corners[:, [2, 0, 1]] - corners)
    sine = np.linalg.norm(np.cross(ahead, back), axis=2)
    return np.asarray(np.arctan2(sine, np.einsum("fcx,fcx->fc", ahead, back)))


def point_normals(points: Points, faces: Faces) -> PointVectors:
    """Return area-weighted unit normals (V, 3); zero at a point without faces."""
    cross = face_cross(points, faces)
    corners = faces.ravel()
    sums = [np.bincount(corners, np.repeat(cross[:, axis], 3), minlength=len(points)) for axis in range(3)]
    return unit(np.stack(sums, axis=1).astype(np.float64))


@dataclass(frozen=True)
class Frame:
    """The similarity between model units and the frame of computation.

    Everything is computed on a copy centred at the bounding-box centre with bounding-box diagonal 1, so that
    tolerances and curvature limits mean the same on every model.
    """

    centre: Vector3
    scale: float

    def to_unit(self, points: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """Map points (n, 3) from model units to the frame of computation."""
        return np.asarray((points - self.centre) / self.scale)

    def to_model(self, points: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """Map points (n, 3) back to model units."""
        return np.asarray(points * self.scale + self.centre)


def sums_at_points(values: npt.NDArray[np.float64], faces: Faces, n_points: int) -> npt.NDArray[np.float64]:
    """Return the sums of values of faces (F, ...) over the faces at each point (V, ...)."""
    flat, corners = np.repeat(values.reshape(len(faces), math.prod(values.shape[1:])), 3, axis=0), faces.ravel()
    sums = [np.bincount(corners, column, minlength=n_points) for column in flat.T]
    return np.stack(sums, axis=1).astype(np.float64).reshape(n_points, *values.shape[1:])


def unit_frame(points: Points) -> Frame:
    """Return the frame in which these points (V, 3) have bounding-box diagonal 1 and centre 0."""
    low, high = points.min(axis=0), points.max(axis=0)
    return Frame(centre=0.5 * (low + high), scale=float(np.linalg.norm(high - low)) or 1.0)
