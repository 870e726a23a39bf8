"""Unit normals and orthonormal frames of the tangent planes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import PointVectors
from anisomesh.mesh.geometry import unit
from anisomesh.mesh.surface import Surface

TangentFrames = npt.NDArray[np.float64]
"""Two orthonormal tangent vectors at each point (V, 2, 3)."""


def unit_normals(surface: Surface) -> PointVectors:
    """Return unit point normals (V, 3): the z axis at points without a normal (without faces of positive area)."""
    return replace_zero_normals(surface.point_normals)


def replace_zero_normals(normals: PointVectors) -> PointVectors:
    """Return the normals (V, 3) with the z axis in place of zero vectors."""
    return np.where(normals.any(axis=1, keepdims=True), normals, (0.0, 0.0, 1.0))


def tangent_frames(normals: PointVectors) -> TangentFrames:
    """Return two orthonormal tangent vectors (V, 2, 3) for unit normals; (first, second, normal) is right-handed.

    The first vector is perpendicular to the coordinate axis that is farthest from the normal.
    """
    axis = np.zeros_like(normals)
    np.put_along_axis(axis, np.argmin(np.abs(normals), axis=1)[:, None], 1.0, axis=1)
    first = unit(np.cross(axis, normals))
    return np.stack([first, np.cross(normals, first)], axis=1)
