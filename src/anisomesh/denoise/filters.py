"""Filters that move the points of a surface: Taubin smoothing and bilateral filtering of normals."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array, diags_array, eye_array

from anisomesh._arrays import FaceVectors, Points
from anisomesh.mesh.geometry import unit
from anisomesh.mesh.surface import Surface

_SHRINK, _GROW = 0.5, -0.53  # shares of the way to the mean of the neighbours: a pass band of about .1
_MAX_FACES_AT_POINT = 64  # points with more, as in the middle of a fan, make no neighbours: all pairs would be too many
_CENTRE_WIDTH = 0.9  # deviation of the weights by distance, in roots of the mean area of faces: about their distance


def taubin_smoothed(surface: Surface, steps: int) -> Surface:
    """Return a surface smoothed by steps that shrink and grow it in turn; its boundary stays.

    References
    ----------
    Taubin, "A signal processing approach to fair surface design", 1995.
    """
    averages, free = neighbour_averages(surface), ~surface.on_boundary[:, None]
    points = surface.points
    for _ in range(steps):
        for share in (_SHRINK, _GROW):
            points = points + share * free * (averages @ points - points)
    return surface.with_points(points)


def bilateral_filtered(
    surface: Surface, *, rounds: int = 5, normal_width: float = 0.35, point_steps: int = 10
) -> Surface:
    """Return a surface whose normals were filtered, each by the normals near it that are like it; its boundary stays.

    Parameters
    ----------
    surface
        An oriented surface.
    rounds
        Number of times that the normals are filtered.
    normal_width
        Standard deviation of the weights by the difference of unit normals.
    point_steps
        Steps in which the points follow the filtered normals.

    Notes
    -----
    A normal becomes the mean of the normals of the faces that share a point with its face, weighted by area, by the
    distance of barycentres and by the difference of normals; so creases stay. Then each point takes the mean of its
    steps onto the planes through the barycentres of its faces with their new normals.

    References
    ----------
    Zheng, Fu, Au, Tai, "Bilateral normal filtering for mesh denoising", 2011; Sun, Rosin, Martin, Langbein, "Fast and
    effective feature-preserving mesh denoising", 2007 (points).
    """
    at_points = _faces_at_points(surface)
    few = at_points.sum(axis=1) <= _MAX_FACES_AT_POINT
    near = csr_array(at_points[few].T @ at_points[few] + eye_array(surface.n_faces))
    rows = np.repeat(np.arange(surface.n_faces), np.diff(near.indptr))
    centres = surface.points[surface.faces].mean(axis=1)
    width = _CENTRE_WIDTH * np.sqrt(surface.area / surface.n_faces)
    distance = ((centres[rows] - centres[near.indices]) ** 2).sum(axis=1)
    fixed = surface.face_areas[near.indices] * np.exp(-distance / (2.0 * width**2))
    normals = surface.face_normals
    for _ in range(rounds):
        difference = ((normals[rows] - normals[near.indices]) ** 2).sum(axis=1)
        near.data = fixed * np.exp(-difference / (2.0 * normal_width**2))
        normals = unit(near @ normals)
    return surface.with_points(_following(surface, at_points, normals, point_steps))


def neighbour_averages(surface: Surface) -> csr_array:
    """Return the matrix (V, V) that takes the mean over the neighbours of each point, or its own value without any."""
    n = surface.n_points
    ends = np.concatenate([surface.edges, surface.edges[:, ::-1]])
    alone = np.setdiff1d(np.arange(n), ends)
    rows, columns = np.concatenate([ends, np.stack([alone, alone], axis=1)]).T
    matrix = csr_array((np.ones(len(rows)), (rows, columns)), shape=(n, n))
    return csr_array(diags_array(1.0 / matrix.sum(axis=1)) @ matrix)


def _faces_at_points(surface: Surface) -> csr_array:
    """Return the matrix (V, F) that is 1 where a face is at a point."""
    face = np.repeat(np.arange(surface.n_faces), 3)
    shape = (surface.n_points, surface.n_faces)
    return csr_array((np.ones(len(face)), (surface.faces.ravel(), face)), shape=shape)


def _following(surface: Surface, at_points: csr_array, normals: FaceVectors, steps: int) -> Points:
    """Return the points (V, 3) after steps towards the planes of their faces with other normals (F, 3)."""
    share = np.where(surface.on_boundary, 0.0, 1.0) / np.maximum(at_points.sum(axis=1), 1.0)
    points: npt.NDArray[np.float64] = surface.points
    outer = (normals[:, :, None] * normals[:, None, :]).reshape(-1, 9)
    matrices = (at_points @ outer).reshape(-1, 3, 3)
    for _ in range(steps):
        centres = points[surface.faces].mean(axis=1)
        towards = at_points @ (normals * np.einsum("fx,fx->f", normals, centres)[:, None])
        points = points + share[:, None] * (towards - np.einsum("vij,vj->vi", matrices, points))
    return points
