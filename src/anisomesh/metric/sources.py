"""Metric sources that measure the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh._values import real_number, whole_number
from anisomesh.errors import OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.metric.curvature import DEFAULT_RADIUS, principal_curvatures
from anisomesh.metric.field import MetricField
from anisomesh.metric.patches import smooth_patches
from anisomesh.metric.tensors import (
    DEFAULT_LIMITS,
    DEFAULT_SMOOTHING,
    approximation_metric,
    curvature_metric,
    uniform_metric,
)

_MAX_RADIUS = 50  # rings of edges; the time of a fit grows with the square


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
        Rings of edges over which curvature is fitted, 2 to 50.
    crease_angle
        Edges whose dihedral angle deviates from flat by more degrees than this are creases, 180 for none. Curvature is
        neither fitted nor averaged across them, so that flat faces have none.

    Raises
    ------
    OptionError
        If a parameter is out of range.

    References
    ----------
    NASM, curvature metric M = R diag(1, r^2, 1) R^t; see :func:`~anisomesh.metric.tensors.curvature_metric`.
    """

    limits: tuple[float, float] = DEFAULT_LIMITS
    smoothing: int = DEFAULT_SMOOTHING
    radius: int = DEFAULT_RADIUS
    crease_angle: float = 40.0

    def __post_init__(self) -> None:
        _check_fit(self.limits, self.smoothing, self.radius, self.crease_angle)

    def __call__(self, surface: Surface) -> MetricField:
        """Return the metric at the points of a surface."""
        patches = smooth_patches(surface, self.crease_angle, self.radius)
        curvature = principal_curvatures(patches.surface, radius=self.radius)
        return patches.field(curvature_metric(patches.surface, curvature, limits=self.limits, smoothing=self.smoothing))


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
    radius: int = DEFAULT_RADIUS
    crease_angle: float = 40.0

    def __post_init__(self) -> None:
        _check_fit(self.limits, self.smoothing, self.radius, self.crease_angle)

    def __call__(self, surface: Surface) -> MetricField:
        """Return the metric at the points of a surface."""
        patches = smooth_patches(surface, self.crease_angle, self.radius)
        curvature = principal_curvatures(patches.surface, radius=self.radius)
        return patches.field(
            approximation_metric(patches.surface, curvature, limits=self.limits, smoothing=self.smoothing)
        )


def _check_fit(limits: object, smoothing: object, radius: object, crease_angle: object) -> None:
    """Check the parameters of a measured metric."""
    if not isinstance(limits, tuple) or len(limits) != 2:
        raise OptionError(f"limits = {limits!r}; expected two numbers, the lowest and the highest curvature")
    low, high = (real_number("limits", limit) for limit in limits)
    if not 0.0 < low <= high < np.inf:
        raise OptionError(f"limits = {limits}; expected two numbers with 0 < low <= high")
    whole_number("smoothing", smoothing, 0)
    if whole_number("radius", radius, 2) > _MAX_RADIUS:
        raise OptionError(f"radius = {radius}; expected at most {_MAX_RADIUS} rings of edges")
    if not 0.0 <= real_number("crease_angle", crease_angle) <= 180.0:
        raise OptionError(f"crease_angle = {crease_angle}; expected 0 to 180 degrees")


@dataclass(frozen=True)
class Uniform:
    """The Euclidean metric: isotropic triangles of equal size."""

    def __call__(self, surface: Surface) -> MetricField:
        """Return the metric at the points of a surface."""
        return MetricField(tensors=uniform_metric(surface))
