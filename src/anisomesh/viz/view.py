"""Where to look: a view of everything and a close-up of the most stretched triangles."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from anisomesh._arrays import FaceScalars, Points, Vector3
from anisomesh.mesh.surface import Surface
from anisomesh.viz.camera import View, camera_axes, framed

_FACES_IN_CLOSEUP = 150
_CANDIDATES = 400


def triangle_stretch(surface: Surface) -> FaceScalars:
    """Return how far each triangle is stretched (F,): 1 for an equilateral one, infinite without area.

    Notes
    -----
    The ratio of the singular values of the linear map from an equilateral triangle. With the side lengths
    a, b, c and the area A, ``q = (a^2 + b^2 + c^2) / (4 sqrt(3) A)`` is half the sum of the ratio and its
    inverse, hence the ratio is ``q + sqrt(q^2 - 1)``.
    """
    squares = (surface.edge_lengths[surface.face_edges] ** 2).sum(axis=1)
    half_sum = np.full(surface.n_faces, np.inf)
    np.divide(squares, 4 * np.sqrt(3) * surface.face_areas, out=half_sum, where=surface.face_areas > 0)
    half_sum = np.maximum(half_sum, 1.0)
    return np.asarray(half_sum + np.sqrt(half_sum**2 - 1))


def whole_view(points: Points, aspect: float) -> View:
    """Look along the shortest side of the bounding box, turned a little, with every point in view.

    Parameters
    ----------
    points
        What has to be in view (V, 3).
    aspect
        Width of the picture divided by its height.
    """
    return framed(points, camera_axes(points), aspect)


def closeup(surface: Surface, view: View, aspect: float) -> View:
    """Look at the place where the visible triangles are most stretched, about 150 of them in view.

    Notes
    -----
    Compares the mean logarithm of the stretch around a few hundred faces that are seen from the front, lowered
    where the surface does not fill the neighbourhood, and takes the best that nothing hides.
    """
    towards = view.axes[2]
    centroids = surface.points[surface.faces].mean(axis=1)
    facing = np.maximum(surface.face_normals @ towards, 0.0)
    stretch = np.log(np.clip(triangle_stretch(surface), 1.0, 30.0))
    front = np.flatnonzero(facing > 0.6)
    if len(front) == 0:
        front = np.arange(surface.n_faces)
    candidates = front[:: max(1, len(front) // _CANDIDATES)]
    radius = 1.5 * _half_height(surface.area / surface.n_faces, view, aspect)
    around = cKDTree(centroids).query_ball_point(centroids[candidates], radius)
    covered = [(surface.face_areas[faces] * facing[faces]).sum() / (np.pi * radius**2) for faces in around]
    score = np.array([stretch[faces].mean() for faces in around]) * np.minimum(covered, 1.0)
    ranked = np.argsort(score, kind="stable")[::-1]
    best = next((k for k in ranked if _visible(surface, centroids[candidates[k]], towards)), ranked[0])
    half_height = _half_height(float(surface.face_areas[around[best]].mean()), view, aspect)
    return View(centre=centroids[candidates[best]], axes=view.axes, half_height=half_height)


def _half_height(face_area: float, view: View, aspect: float) -> float:
    """Return the half height of a close-up that shows the wanted number of faces of this area."""
    half_height = 0.5 * np.sqrt(_FACES_IN_CLOSEUP * face_area / aspect)
    return float(np.clip(half_height, 0.04 * view.half_height, 0.2 * view.half_height))


def _visible(surface: Surface, point: Vector3, towards: Vector3) -> bool:
    """Tell whether no face lies between a point of the surface and the viewer."""
    a, b, c = (surface.points[surface.faces[:, corner]] - point for corner in range(3))
    weights = np.stack([np.cross(b, c) @ towards, np.cross(c, a) @ towards, np.cross(a, b) @ towards])
    total = weights.sum(axis=0)
    hit = ((weights >= 0).all(axis=0) | (weights <= 0).all(axis=0)) & (total != 0)
    depths = np.stack([a @ towards, b @ towards, c @ towards])
    depth = (weights[:, hit] * depths[:, hit]).sum(axis=0) / total[hit]
    return not bool((depth > 1e-6 * surface.diagonal).any())
