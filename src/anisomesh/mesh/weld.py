"""Finding points that coincide, exactly or within a distance."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph
from scipy.spatial import cKDTree

from anisomesh._arrays import PointLabels, Points


def coincident(points: Points, tolerance: float = 0.0) -> PointLabels:
    """Return for every point the lowest index of a point that it coincides with, (V,).

    Parameters
    ----------
    points
        Coordinates (V, 3).
    tolerance
        Distance up to which points coincide, in the unit of the points; 0 asks for equal coordinates.

    Notes
    -----
    With a tolerance the relation is made transitive: a chain of close points becomes one point.
    """
    if tolerance > 0:
        pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
        weights = np.ones(len(pairs), dtype=np.bool_)
        graph = sparse.coo_matrix((weights, (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
        group = csgraph.connected_components(graph, directed=False)[1]
    else:
        order = np.lexsort(points.T)
        sorted_points = points[order]
        new = np.ones(len(points), dtype=np.int64)
        new[1:] = (sorted_points[1:] != sorted_points[:-1]).any(axis=1)
        group = np.empty(len(points), dtype=np.int64)
        group[order] = np.cumsum(new) - 1
    lowest = np.full(len(points), len(points), dtype=np.int64)
    np.minimum.at(lowest, group, np.arange(len(points)))
    labels: PointLabels = lowest[group].astype(np.int32)
    return labels
