"""Coincident points, exactly or within a distance."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from anisomesh._arrays import PointLabels, Points
from anisomesh.mesh.topology import graph_components


def coincident(points: Points, tolerance: float = 0.0) -> PointLabels:
    """Return for every point (V,) the lowest index of the points that coincide with it, itself included.

    Parameters
    ----------
    points
        Coordinates (V, 3).
    tolerance
        Distance up to which points coincide, in the unit of the points; 0 requires equal coordinates. The relation is
        made transitive, so that a chain of close points becomes one point.
    """
    if tolerance > 0:
        pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
        group = graph_components(pairs, len(points))[1]
    else:
        order = np.lexsort(points.T)
        sorted_points = points[order]
        differs = np.ones(len(points), dtype=np.int64)
        differs[1:] = (sorted_points[1:] != sorted_points[:-1]).any(axis=1)
        if differs.all():
            return np.arange(len(points), dtype=np.int32)
        group = np.empty(len(points), dtype=np.int32)
        group[order] = np.cumsum(differs) - 1
    lowest = np.full(len(points), len(points), dtype=np.int64)
    np.minimum.at(lowest, group, np.arange(len(points)))
    labels: PointLabels = lowest[group].astype(np.int32)
    return labels
