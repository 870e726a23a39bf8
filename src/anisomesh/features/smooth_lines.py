"""Jagged lines along edges of a smooth surface, straightened: borders of regions of a scan go around its triangles."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import EdgeMask, PointMask, Points
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface

_STEPS = 8  # of Laplacian smoothing; a line from side to side is straight after one, wider steps take a few
_STEP = 0.5  # of the way to the middle of the two neighbours; this ends changes of side at once
_MIN_COSINE = 0.7  # between the normals of a face before and after
_MIN_AREA = 0.2  # of a face, over its area before


def with_smooth_lines(surface: Surface, lines: EdgeMask, fixed: PointMask) -> Surface:
    """Return a surface with points on lines moved along it, such that the lines turn less.

    Parameters
    ----------
    surface
        An oriented manifold surface.
    lines
        Edges (E,) that make up the lines.
    fixed
        Points (V,) that stay, besides ends and junctions of lines.

    Notes
    -----
    Laplacian smoothing, each step projected back onto the surface. Points at faces that would turn by more than 45
    degrees or lose more than four fifths of their area go back to where they were.
    """
    ends = surface.edges[lines]
    count = np.bincount(ends.ravel(), minlength=surface.n_points)
    movable = (count == 2) & ~fixed
    if not movable.any():
        return surface
    reference, points = ClosestPoints(surface), surface.points.copy()
    for _ in range(_STEPS):
        sums = np.zeros_like(points)
        np.add.at(sums, ends[:, 0], points[ends[:, 1]])
        np.add.at(sums, ends[:, 1], points[ends[:, 0]])
        wanted = points[movable] + _STEP * (0.5 * sums[movable] - points[movable])
        facet, weights = reference.locate(wanted)
        trial = points.copy()
        trial[movable] = np.einsum("nc,ncx->nx", weights, surface.points[surface.faces[facet]])
        points = _without_folds(surface, points, trial)
    return surface.with_points(points)


def _without_folds(surface: Surface, before: Points, trial: Points) -> Points:
    """Return points (V, 3) moved from one place to another, but not at faces that would be folded or flattened."""
    back = np.zeros(surface.n_points, dtype=bool)
    while True:
        points = np.where(back[:, None], before, trial)
        moved = surface.with_points(points)
        cosine = np.einsum("fx,fx->f", moved.face_normals, surface.face_normals)
        bad = (cosine < _MIN_COSINE) | (moved.face_areas < _MIN_AREA * surface.face_areas)
        more = np.zeros(surface.n_points, dtype=bool)
        more[surface.faces[bad]] = True
        more &= (before != trial).any(axis=1) & ~back
        if not more.any():
            return points
        back |= more
