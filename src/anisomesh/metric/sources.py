"""Metric sources that measure the surface or are precomputed."""

from __future__ import annotations

from dataclasses import dataclass

from anisomesh._arrays import PointTensors
from anisomesh.mesh.surface import Surface
from anisomesh.metric.curvature import principal_curvatures
from anisomesh.metric.field import MetricField
from anisomesh.metric.tensors import (
    DEFAULT_LIMITS,
    DEFAULT_SMOOTHING,
    approximation_metric,
    curvature_metric,
    uniform_metric,
    validate_metric,
)


@dataclass(frozen=True, kw_only=True)
class Curvature:
    """The paper's metric: triangles of equal size, stretched along the direction of smaller curvature.

    Parameters
    ----------
    limits
        Lowest and highest curvature magnitude, 1/length at bounding-box diagonal 1; the stretch is at most the square
        root of their quotient.
    smoothing
        Number of one-ring averages of the tensors, 0 for none.
    radius
        Rings of edges over which curvature is fitted, at least 2.

    References
    ----------
    NASM, curvature metric M = R diag(1, r^2, 1) R^t; see :func:`~anisomesh.metric.tensors.curvature_metric`.
    """

    limits: tuple[float, float] = DEFAULT_LIMITS
    smoothing: int = DEFAULT_SMOOTHING
    radius: int = 5

    def __call__(self, surface: Surface) -> MetricField:
        """Return the metric at the points of a surface."""
        curvature = principal_curvatures(surface, radius=self.radius)
        return MetricField(tensors=curvature_metric(surface, curvature, limits=self.limits, smoothing=self.smoothing))


@dataclass(frozen=True, kw_only=True)
class Approximation:
    """The metric of least L2 approximation error: the size of triangles follows curvature as well.

    Parameters are the same as for :class:`Curvature`.

    References
    ----------
    See :func:`~anisomesh.metric.tensors.approximation_metric`.
    """

    limits: tuple[float, float] = DEFAULT_LIMITS
    smoothing: int = DEFAULT_SMOOTHING
    radius: int = 5

    def __call__(self, surface: Surface) -> MetricField:
        """Return the metric at the points of a surface."""
        curvature = principal_curvatures(surface, radius=self.radius)
        tensors = approximation_metric(surface, curvature, limits=self.limits, smoothing=self.smoothing)
        return MetricField(tensors=tensors)


@dataclass(frozen=True)
class Uniform:
    """The Euclidean metric: isotropic triangles of equal size."""

    def __call__(self, surface: Surface) -> MetricField:
        """Return the metric at the points of a surface."""
        return MetricField(tensors=uniform_metric(surface))


@dataclass(frozen=True, eq=False)
class PrecomputedTensors:
    """Tensors known beforehand at the points of the surface that the source is called with.

    Parameters
    ----------
    tensors
        Symmetric positive definite matrices (V, 3, 3).
    """

    tensors: PointTensors

    def __call__(self, surface: Surface) -> MetricField:
        """Return the metric at the points of a surface.

        Raises
        ------
        MetricError
            If the tensors are not symmetric positive definite, or not one per point.
        """
        return MetricField(tensors=validate_metric(self.tensors, surface))
