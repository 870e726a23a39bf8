"""Statistics of the triangles of a mesh: quality in a metric, angles, edge lengths."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from anisomesh._arrays import FaceScalars
from anisomesh.features.detect import WEAK_ANGLE, sharp_edges
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.geometry import corner_angles
from anisomesh.mesh.surface import Surface
from anisomesh.metric.field import MetricField
from anisomesh.metric.quality import anisotropic_quality
from anisomesh.metric.sources import Curvature
from anisomesh.metric.transfer import transfer_to_corners
from anisomesh.working.surface import working_surface

_MIN_QUALITY = 0.7  # of the triangles of a reference, below which they are slivers; heuristic
_EVEN_VERTICES = 5_000  # of the even mesh with which they are replaced
_LOW_QUANTILE = 0.05  # of g_low and angle_low; a convention of this report


@dataclass(frozen=True, kw_only=True)
class ShapeStatistics:
    """Shapes of the triangles of a mesh.

    Attributes
    ----------
    g_mean, g_min, g_low
        Mean (the paper's G_avg), minimum and 5 % quantile of the anisotropic quality G, dimensionless: 1 if
        equilateral in the metric, 0 if degenerate.
    angle_min, angle_low, angle_max
        Smallest angle, 5 % quantile of the smallest angles of the triangles, and largest angle, in degrees, Euclidean.
    edge_min, edge_mean, edge_max
        Euclidean edge lengths, in units of the mesh.
    edge_variation
        Standard deviation of the edge lengths divided by their mean; 0 if the mean is 0.
    """

    g_mean: float
    g_min: float
    g_low: float
    angle_min: float
    angle_low: float
    angle_max: float
    edge_min: float
    edge_mean: float
    edge_max: float
    edge_variation: float

    def as_dict(self) -> dict[str, Any]:
        """Return the values under their names, for JSON."""
        return asdict(self)


def quality_in_reference_metric(reference: Surface, surface: Surface) -> FaceScalars:
    """Return the quality G (F,) of the triangles of a remesh in the curvature metric of its reference.

    Parameters
    ----------
    reference
        The reference, at bounding-box diagonal 1. Each corner of the remesh takes the metric of its closest point, on
        its side of a crease.
    surface
        The remesh, in the coordinates of the reference.

    Notes
    -----
    Curvature cannot be measured on slivers. A reference whose triangles have a mean Euclidean quality below .7, by
    area, is triangulated anew first, as for a remesh; other ones are measured as they are.

    References
    ----------
    NASM, section 4.1; see :func:`anisomesh.metric.quality.anisotropic_quality`.
    """
    return quality_in_metric(*reference_metric(reference), surface)


def reference_metric(reference: Surface) -> tuple[ClosestPoints, MetricField]:
    """Return the curvature metric of a reference, at bounding-box diagonal 1, and the surface on which it is known."""
    identity = np.broadcast_to(np.eye(3), (reference.n_points, 3, 3))
    euclidean = anisotropic_quality(reference.points, reference.faces, identity)
    if (euclidean * reference.face_areas).sum() < _MIN_QUALITY * reference.area:
        creases = sharp_edges(reference, WEAK_ANGLE)
        reference = working_surface(reference, _EVEN_VERTICES, creases=creases, tagged=np.zeros_like(creases)).surface
    return ClosestPoints(reference), Curvature()(reference)


def quality_in_metric(closest: ClosestPoints, field: MetricField, surface: Surface) -> FaceScalars:
    """Return the quality G (F,) of the triangles of a mesh in a metric on a surface that is near to it."""
    roots = transfer_to_corners(closest, field, surface)
    return anisotropic_quality(surface.points, surface.faces, roots)


def shape_statistics(surface: Surface, quality: FaceScalars) -> ShapeStatistics:
    """Return the shape statistics of a mesh from the qualities G (F,) of its triangles.

    A degenerate triangle has G = 0 and counts with its angles of 0 and 180 degrees.
    """
    angles = np.degrees(corner_angles(surface.points[surface.faces]))
    lengths = surface.edge_lengths
    mean = float(lengths.mean())
    return ShapeStatistics(
        g_mean=float(quality.mean()),
        g_min=float(quality.min()),
        g_low=float(np.quantile(quality, _LOW_QUANTILE)),
        angle_min=float(angles.min()),
        angle_low=float(np.quantile(angles.min(axis=1), _LOW_QUANTILE)),
        angle_max=float(angles.max()),
        edge_min=float(lengths.min()),
        edge_mean=mean,
        edge_max=float(lengths.max()),
        edge_variation=float(lengths.std()) / mean if mean > 0.0 else 0.0,
    )
