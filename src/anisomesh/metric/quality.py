"""Shape of triangles measured in the metric."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, FaceScalars, Points, PointTensors
from anisomesh.errors import MetricError
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.metric.tensors import compute_metric, metric_root

_BLOCK = 16_384  # triangles at a time, so that the memory in between is bounded

Corners = npt.NDArray[np.float64]


def anisotropic_quality(points: Points, faces: Faces, roots: PointTensors) -> FaceScalars:
    """Return the quality G of each triangle in the metric, (F,): 1 for an equilateral one, 0 for a flat one.

    Parameters
    ----------
    points, faces
        The triangles.
    roots
        Symmetric square roots Q of the metric at the points (V, 3, 3).

    Notes
    -----
    G = 2 sqrt(3) S / (p h) with area S, half perimeter p and longest side h of the triangle after it is mapped by
    the mean of Q over its corners. In the paper's Heron formula s must be (a + b + c) / 2; the area is taken from
    the cross product here, which is as exact and does not cancel.

    References
    ----------
    NASM, section 4.1 (G_avg is the mean of these).
    """
    result = np.empty(len(faces))
    for first in range(0, len(faces), _BLOCK):
        block = faces[first : first + _BLOCK]
        result[first : first + _BLOCK] = _quality(points[block], roots[block].mean(axis=1))
    return result


def _quality(corners: Corners, roots: PointTensors) -> FaceScalars:
    """Return the quality of triangles (n, 3, 3) with one root each (n, 3, 3)."""
    mapped = np.einsum("fij,fcj->fci", roots, corners - corners[:, :1])
    sides = mapped[:, [2, 0, 1]] - mapped[:, [1, 2, 0]]
    lengths = np.sqrt(np.einsum("fci,fci->fc", sides, sides))
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 1], sides[:, 2]), axis=1)
    denominator = 0.5 * lengths.sum(axis=1) * lengths.max(axis=1)
    regular = 2.0 * np.sqrt(3.0)
    return np.asarray(np.divide(regular * area, denominator, out=np.zeros_like(area), where=denominator > 0.0))


def quality_on(reference: ClosestPoints, surface: Surface) -> FaceScalars:
    """Return the quality G (F,) of the triangles of a remesh in the paper's metric of its reference.

    Both at bounding-box diagonal 1 of the reference; each vertex takes the metric from the closest point.
    """
    roots = metric_root(compute_metric(reference.surface).tensors)
    return anisotropic_quality(surface.points, surface.faces, transfer_metric_roots(reference, roots, surface.points))


def transfer_metric_roots(reference: ClosestPoints, roots: PointTensors, query_points: Points) -> PointTensors:
    """Return the metric roots at points (n, 3) near a surface, (n, 3, 3).

    Parameters
    ----------
    reference
        Search tree of the surface on which the metric is given.
    roots
        Symmetric square roots Q of the metric at its points (V, 3, 3).
    query_points
        Where Q is wanted; each takes it from the closest point of the surface, by linear interpolation over the
        facet there.

    Raises
    ------
    MetricError
        If there is not one root per point of the surface.
    """
    surface = reference.surface
    if roots.shape != (surface.n_points, 3, 3):
        raise MetricError(f"roots has shape {roots.shape}; expected ({surface.n_points}, 3, 3)")
    facet, weights = reference.locate(query_points)
    return np.asarray(np.einsum("nc,ncij->nij", weights, roots[surface.faces[facet]]))
