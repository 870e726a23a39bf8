"""Transfer of a metric from a surface to points near it."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import Points, PointTensors
from anisomesh.errors import MetricError
from anisomesh.mesh.closest_points import ClosestPoints


def transfer_metric_roots(reference: ClosestPoints, roots: PointTensors, query_points: Points) -> PointTensors:
    """Return the metric roots (n, 3, 3) at the closest points of a surface.

    Parameters
    ----------
    reference
        Search tree of the surface on which the metric is defined.
    roots
        Symmetric square roots Q of the metric at the points of the surface (V, 3, 3).
    query_points
        Points (n, 3). The root at the closest point is interpolated linearly over its facet.

    Raises
    ------
    MetricError
        If there is not one root per point of the surface.

    References
    ----------
    NASM, section 4.1 (closest points).
    """
    surface = reference.surface
    if roots.shape != (surface.n_points, 3, 3):
        raise MetricError(f"roots has shape {roots.shape}; expected ({surface.n_points}, 3, 3)")
    facet, weights = reference.locate(query_points)
    return np.asarray(np.einsum("nc,ncij->nij", weights, roots[surface.faces[facet]]))
