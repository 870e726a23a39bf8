"""Creases and corners of a surface: edges by their dihedral angle, and points where creases end, meet or turn."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Points
from anisomesh.mesh import geometry
from anisomesh.mesh.surface import Surface

_FLAT = 1e-3  # radians
_TURN = 45.0  # degrees by which a crease turns at a corner


def sharp_edges(surface: Surface, angle: float) -> npt.NDArray[np.bool_]:
    """Return which edges (E,) have faces whose normals differ by more than an angle in degrees."""
    first, second = surface.edge_faces.T
    cosine = np.einsum("ex,ex->e", surface.face_normals[first], surface.face_normals[second])
    return np.asarray((second >= 0) & (cosine < np.cos(np.radians(angle))))


def share_of_flat_edges(surface: Surface) -> float:
    """Return the share of the inner edges whose faces are in one plane, to a thousandth of a radian.

    Parts that were designed have many, surfaces that were measured next to none.
    """
    first, second = surface.edge_faces[surface.edge_faces[:, 1] >= 0].T
    sine = np.linalg.norm(np.cross(surface.face_normals[first], surface.face_normals[second]), axis=1)
    return float((sine < _FLAT).mean()) if len(sine) else 1.0


def corners(surface: Surface, sharp: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Return which points (V,) are ends of sharp edges but not of two that go on in about the same direction."""
    ends = surface.edges[sharp]
    along = geometry.unit(surface.points[ends[:, 1]] - surface.points[ends[:, 0]])
    count = np.bincount(ends.ravel(), minlength=surface.n_points)
    outward = np.zeros((surface.n_points, 3))
    np.add.at(outward, ends[:, 0], along)
    np.add.at(outward, ends[:, 1], -along)
    straight = (count == 2) & (np.linalg.norm(outward, axis=1) < 2.0 * np.sin(np.radians(_TURN) / 2.0))
    return np.asarray((count > 0) & ~straight)


def points_along(surface: Surface, edges: npt.NDArray[np.bool_], spacing: float) -> Points:
    """Return points (n, 3) on the marked edges (E,), both ends included, no farther apart than a spacing."""
    ends = surface.points[surface.edges[edges]]
    count = np.ceil(surface.edge_lengths[edges] / spacing).astype(np.int64) + 1
    which = np.repeat(np.arange(len(count)), count)
    place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    share = (place / np.maximum(count[which] - 1, 1))[:, None]
    return np.asarray((1.0 - share) * ends[which, 0] + share * ends[which, 1])
