"""Transfer of a metric from a surface to points near it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import CornerTensors, FaceLabels, Faces, Points, PointTensors
from anisomesh.errors import MetricError
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.metric.field import MetricField, mean_at_points
from anisomesh.metric.patches import smooth_patches
from anisomesh.metric.tensors import metric_root

_INSET = 0.1  # of the way from a corner to the barycentre: on its side of a crease also where a triangle is off it
_PLACES_PER_BLOCK = 65_536  # bounds the memory for the corners of faces

Barycentric = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PlacedMetric:
    """A metric field, and the closest points of the surface on which it is given."""

    surface: ClosestPoints
    field: MetricField

    def roots(self, places: Points) -> PointTensors:
        """Return symmetric square roots of the metric (n, 3, 3) at the closest points to places (n, 3)."""
        return roots_near(self.surface, self.field, places)

    def roots_on(self, surface: Surface, faces: FaceLabels, weights: Barycentric) -> PointTensors:
        """Return the roots (n, 3, 3) at barycentric coordinates (n, 3) of faces (n,) of a surface near this one.

        If it is the same surface, nothing has to be searched for.
        """
        own = self.surface.surface
        if np.array_equal(surface.faces, own.faces) and np.array_equal(surface.points, own.points):
            return _interpolated(own, self.field, faces, weights)
        return self.roots(np.einsum("nc,ncx->nx", weights, surface.points[surface.faces[faces]]))


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
    return _weighted(roots, surface.faces, *reference.locate(query_points))


def transfer_to_corners(reference: ClosestPoints, field: MetricField, surface: Surface) -> PointTensors | CornerTensors:
    """Return the roots of a metric field of a reference at the points (V, 3, 3) of another surface near it.

    Where the field jumps across creases they are returned at the corners of its faces (F, 3, 3, 3), from the closest
    point of the reference to a place just inside the corner, on its side of the crease.
    """
    if field.corner_tensors is None:
        return transfer_metric_roots(reference, metric_root(field.tensors), surface.points)
    corners = surface.points[surface.faces]
    inside = corners + _INSET * (corners.mean(axis=1, keepdims=True) - corners)
    return roots_near(reference, field, inside.reshape(-1, 3)).reshape(-1, 3, 3, 3)


def field_near(reference: ClosestPoints, field: MetricField, surface: Surface, crease_angle: float) -> MetricField:
    """Return the metric field on a surface near a reference that has a metric field.

    Where the field jumps across creases, the patches are bounded by the edges of the surface that bend by more degrees
    than ``crease_angle``.
    """
    roots = transfer_to_corners(reference, field, surface)
    tensors = roots @ roots
    if field.corner_tensors is None:
        return replace(field, tensors=tensors)
    patch = smooth_patches(surface, crease_angle, 1).labels
    return replace(field, tensors=mean_at_points(surface, tensors), corner_tensors=tensors, patch=patch)


def roots_near(reference: ClosestPoints, field: MetricField, places: Points) -> PointTensors:
    """Return the roots (n, 3, 3) of a metric field of a reference at the closest points to places (n, 3)."""
    return _interpolated(reference.surface, field, *reference.locate(places))


def _interpolated(surface: Surface, field: MetricField, faces: FaceLabels, weights: Barycentric) -> PointTensors:
    """Return the roots (n, 3, 3) of a field at barycentric coordinates (n, 3) of faces (n,) of its surface."""
    if field.corner_tensors is None:
        return _weighted(metric_root(field.tensors), surface.faces, faces, weights)
    corners = np.arange(3 * surface.n_faces).reshape(-1, 3)
    return _weighted(metric_root(field.corner_tensors.reshape(-1, 3, 3)), corners, faces, weights)


def _weighted(roots: PointTensors, corners: Faces, faces: FaceLabels, weights: Barycentric) -> PointTensors:
    """Return the means (n, 3, 3) of the roots at the corners (F, 3) of faces (n,), with weights (n, 3)."""
    result = np.empty((len(faces), 3, 3))
    for first in range(0, len(faces), _PLACES_PER_BLOCK):
        block = slice(first, first + _PLACES_PER_BLOCK)
        result[block] = np.einsum("nc,ncij->nij", weights[block], roots[corners[faces[block]]])
    return result
