"""Boundary points that nearly coincide: cracks left by rounding, which a weld tolerance closes."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from anisomesh.mesh.surface import Surface

AUTO_WELD = 1e-5  # of the bounding-box diagonal: above the rounding of files of six digits, below any detail; heuristic
_MOST_OF_EDGE = 0.1  # of the shortest edge at a point, up to which another is near, not a neighbour; heuristic
_N_NEIGHBOURS = 4  # points that are looked at


def weld_distance(surface: Surface, tolerance: float | Literal["auto"]) -> float:
    """Return a weld tolerance in model units; ``"auto"`` is 1e-5 of the bounding-box diagonal."""
    return AUTO_WELD * surface.diagonal if tolerance == "auto" else tolerance


def count_near_boundary_points(surface: Surface) -> int:
    """Return how many boundary points lie within 1e-5 of the diagonal of another boundary point, but not on it.

    Notes
    -----
    Points are near only if their distance is below a tenth of the edges at them, so that dense boundaries do not count.
    """
    boundary = np.flatnonzero(surface.on_boundary)
    if len(boundary) < 2:
        return 0
    shortest = np.full(surface.n_points, math.inf)
    np.minimum.at(shortest, surface.edges, surface.edge_lengths[:, None])
    points, limit = surface.points[boundary], AUTO_WELD * surface.diagonal
    distance, other = cKDTree(points).query(
        points, k=_N_NEIGHBOURS, distance_upper_bound=math.nextafter(limit, math.inf)
    )
    found = np.isfinite(distance) & (distance > 0.0)
    edge = np.append(shortest[boundary], 0.0)  # where there are fewer points the tree returns their number
    found &= distance < _MOST_OF_EDGE * np.minimum(edge[:-1, None], edge[other])
    return int(np.count_nonzero(found.any(axis=1)))
