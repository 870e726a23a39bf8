"""Views of a whole surface and close-ups of its most stretched triangles."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from anisomesh._arrays import Points, Vector3
from anisomesh.mesh.surface import Surface
from anisomesh.viz.camera import View, camera_axes, framed

_FACES_IN_CLOSEUP = 150  # heuristic
_CLOSEUP_HALF_HEIGHTS = (0.04, 0.2)  # of the half height of the whole view; heuristic
_MAX_CLOSEUP_CANDIDATES = 400  # faces that are compared; bounds the time
_MIN_FACING_COSINE = 0.6  # between normal and viewing direction of a face that may be the centre; heuristic
_NEIGHBOURHOOD_RADIUS = 1.5  # half heights of the close-up, around a candidate; heuristic
_MAX_SCORED_STRETCH = 30.0  # a larger stretch counts as this one, so that degenerate triangles do not win; heuristic
_OCCLUSION_TOLERANCE = 1e-6  # bounding-box diagonals; rounding of the depth of the face itself


def whole_view(points: Points, aspect: float) -> View:
    """Return a view oblique to the shortest side of the bounding box that shows every point.

    Parameters
    ----------
    points
        The points to show (V, 3).
    aspect
        Width of the picture divided by its height.
    """
    return framed(points, camera_axes(points), aspect)


def closeup(surface: Surface, view: View, aspect: float) -> View:
    """Return a close-up of the visible place with the most stretched triangles, with about 150 triangles in view.

    Parameters
    ----------
    surface
        The surface.
    view
        View of the whole surface; the close-up has its axes.
    aspect
        Width of the picture divided by its height.

    Notes
    -----
    The score of a place is the mean logarithm of the stretch around a front-facing face, times the share of the
    neighbourhood that the surface covers. The best place that no other face hides is taken.
    """
    towards = view.axes[2]
    centroids = surface.points[surface.faces].mean(axis=1)
    facing = np.maximum(surface.face_normals @ towards, 0.0)
    stretch = np.log(np.clip(surface.face_stretch, 1.0, _MAX_SCORED_STRETCH))
    front = np.flatnonzero(facing > _MIN_FACING_COSINE)
    if len(front) == 0:
        front = np.arange(surface.n_faces)
    candidates = front[:: max(1, len(front) // _MAX_CLOSEUP_CANDIDATES)]
    radius = _NEIGHBOURHOOD_RADIUS * _half_height(surface.area / surface.n_faces, view, aspect)
    around = cKDTree(centroids).query_ball_point(centroids[candidates], radius)
    covered = [(surface.face_areas[faces] * facing[faces]).sum() / (np.pi * radius**2) for faces in around]
    score = np.array([stretch[faces].mean() for faces in around]) * np.minimum(covered, 1.0)
    ranked = np.argsort(score, kind="stable")[::-1]
    best = next((k for k in ranked if _visible(surface, centroids[candidates[k]], towards)), ranked[0])
    half_height = _half_height(float(surface.face_areas[around[best]].mean()), view, aspect)
    return View(centre=centroids[candidates[best]], axes=view.axes, half_height=half_height)


def _half_height(face_area: float, view: View, aspect: float) -> float:
    """Return the half height of a close-up that shows about 150 faces of this mean area, within limits."""
    low, high = (share * view.half_height for share in _CLOSEUP_HALF_HEIGHTS)
    return float(np.clip(0.5 * np.sqrt(_FACES_IN_CLOSEUP * face_area / aspect), low, high))


def _visible(surface: Surface, point: Vector3, towards: Vector3) -> bool:
    """Return whether no face lies between a point of the surface and the viewer."""
    a, b, c = (surface.points[surface.faces[:, corner]] - point for corner in range(3))
    weights = np.stack([np.cross(b, c) @ towards, np.cross(c, a) @ towards, np.cross(a, b) @ towards])
    total = weights.sum(axis=0)
    hit = ((weights >= 0).all(axis=0) | (weights <= 0).all(axis=0)) & (total != 0)
    depths = np.stack([a @ towards, b @ towards, c @ towards])
    depth = (weights[:, hit] * depths[:, hit]).sum(axis=0) / total[hit]
    return not bool((depth > _OCCLUSION_TOLERANCE * surface.diagonal).any())
