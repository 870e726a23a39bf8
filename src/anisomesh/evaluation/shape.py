"""Statistics of the triangles of a mesh: quality in the metric, angles, edge lengths."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from anisomesh._arrays import FaceScalars
from anisomesh.mesh.geometry import corner_angles
from anisomesh.mesh.surface import Surface


@dataclass(frozen=True, kw_only=True)
class ShapeStatistics:
    """Shapes of triangles.

    Attributes
    ----------
    g_mean, g_min, g_low
        Mean, minimum and 5 % quantile of the quality G in the metric, 1 for an equilateral triangle.
    angle_min, angle_low, angle_max
        Smallest angle, 5 % quantile of the smallest angles of the triangles, and largest angle, in degrees in space.
    edge_min, edge_mean, edge_max
        Edge lengths in space, in the units of the mesh.
    edge_variation
        Standard deviation of the edge lengths over their mean.
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


def shape_statistics(surface: Surface, quality: FaceScalars) -> ShapeStatistics:
    """Return the statistics of a mesh whose triangles have these qualities G (F,).

    Notes
    -----
    A triangle without area has G = 0 and its angles count as they are, 0 and 180 degrees.
    """
    angles = np.degrees(corner_angles(surface.points[surface.faces]))
    lengths = surface.edge_lengths
    mean = float(lengths.mean())
    return ShapeStatistics(
        g_mean=float(quality.mean()),
        g_min=float(quality.min()),
        g_low=float(np.quantile(quality, 0.05)),
        angle_min=float(angles.min()),
        angle_low=float(np.quantile(angles.min(axis=1), 0.05)),
        angle_max=float(angles.max()),
        edge_min=float(lengths.min()),
        edge_mean=mean,
        edge_max=float(lengths.max()),
        edge_variation=float(lengths.std()) / mean if mean > 0.0 else 0.0,
    )
