"""Metric tensor fields: what length a remesh should give to every direction at every point."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import PointTensors
from anisomesh.errors import MetricError, OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.metric.curvature import Curvature, principal_curvatures
from anisomesh.metric.names import METRIC_NAMES, MetricName
from anisomesh.metric.tangent import line_field, line_tensors, one_ring_average, tangent_frames, unit_normals

DEFAULT_LIMITS = (1.0, 400.0)
DEFAULT_SMOOTHING = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class Metric:
    """Symmetric positive definite tensors (V, 3, 3) and where they come from, a name or ``"user"``."""

    tensors: PointTensors
    kind: str


def compute_metric(
    surface: Surface,
    kind: MetricName | npt.NDArray[Any] = "curvature",
    *,
    limits: tuple[float, float] = DEFAULT_LIMITS,
    smoothing: int = DEFAULT_SMOOTHING,
    radius: int = 5,
) -> Metric:
    """Return the metric of a surface: one of the named ones, or the given tensors after checking them.

    Parameters
    ----------
    surface
        The surface, scaled to bounding-box diagonal 1 (the curvature limits refer to that).
    kind
        ``"curvature"`` (the paper's: triangles stretched along the direction of small curvature, area kept
        free), ``"approximation"`` (size follows curvature too: the least mean squared error for a number of
        triangles), ``"uniform"`` (isotropic), or tensors (V, 3, 3).
    limits
        Lowest and highest curvature magnitude, 1/length at bounding-box diagonal 1.
    smoothing
        Passes of one-ring averaging of the tensors, 0 for none.
    radius
        Rings of edges over which curvature is fitted, at least 2.

    Raises
    ------
    MetricError
        If given tensors are not symmetric positive definite, or not one per point.
    OptionError
        If the name is unknown or an option is out of range.
    """
    if not isinstance(kind, str):
        return Metric(tensors=validate_metric(kind, surface), kind="user")
    if kind not in METRIC_NAMES:
        raise OptionError(
            f"metric {kind!r} is unknown; expected one of {', '.join(METRIC_NAMES)}, or tensors (V, 3, 3)"
        )
    if kind == "uniform":
        return Metric(tensors=uniform_metric(surface), kind=kind)
    field = curvature_metric if kind == "curvature" else approximation_metric
    curvature = principal_curvatures(surface, radius=radius)
    return Metric(tensors=field(surface, curvature, limits=limits, smoothing=smoothing), kind=kind)


def curvature_metric(
    surface: Surface,
    curvature: Curvature,
    *,
    limits: tuple[float, float] = DEFAULT_LIMITS,
    smoothing: int = DEFAULT_SMOOTHING,
) -> PointTensors:
    """Return the paper's metric, M = R diag(1, r^2, 1) R^t with R = [v_min, v_max, n] and r = sqrt(|k_max / k_min|).

    Parameters
    ----------
    surface, curvature
        The surface at bounding-box diagonal 1 and its principal curvatures.
    limits
        Lowest and highest curvature magnitude; r is at most the square root of their quotient.
    smoothing
        Passes of one-ring averaging of log r and v_max, as a line field without sign.

    Returns
    -------
    tensors
        Symmetric positive definite (V, 3, 3); the eigenvalue along the normal and along v_min is 1.

    Raises
    ------
    OptionError
        If the limits are not 0 < low <= high, or smoothing is negative.

    Notes
    -----
    The line of v_max is averaged as the complex number log r * exp(2 i angle), carried between tangent planes:
    opposite directions agree, perpendicular ones cancel, so r falls to 1 where neighbours disagree (umbilics)
    and no sign has to be chosen. The paper averages r and the directions one by one. Three passes are the default:
    fewer leave noise in the metric that triangles cannot follow, more take stretch away and lengthen the reach into
    creases.

    References
    ----------
    NASM, section 3.1 and equation 1.
    """
    low, high = _clamped(curvature, limits)
    _, line, frames = _smoothed_logarithm(surface, curvature, np.zeros_like(low), np.log(high / low), smoothing)
    stretch_squared = np.exp(np.abs(line))
    return np.asarray(np.eye(3) + (stretch_squared - 1.0)[:, None, None] * line_tensors(line, frames))


def approximation_metric(
    surface: Surface,
    curvature: Curvature,
    *,
    limits: tuple[float, float] = DEFAULT_LIMITS,
    smoothing: int = DEFAULT_SMOOTHING,
) -> PointTensors:
    """Return the metric of least mean squared distance, |H| det|H|^(-1/6), H the curvatures in the tangent plane.

    Parameters
    ----------
    surface, curvature
        The surface at bounding-box diagonal 1 and its principal curvatures.
    limits
        Lowest and highest curvature magnitude; the lowest keeps triangles on flat parts from growing without bound.
    smoothing
        Passes of one-ring averaging of the logarithm of the tensor.

    Returns
    -------
    tensors
        Symmetric positive definite (V, 3, 3). Along the normal the eigenvalue is the smaller tangent one, as in
        the curvature metric, so that the normal adds no length of its own. Only ratios of lengths matter.

    Raises
    ------
    OptionError
        If the limits are not 0 < low <= high, or smoothing is negative.

    References
    ----------
    Nadler, "Piecewise linear best L2 approximation on triangulations", 1986. Alauzet, Loseille, Dervieux, Frey,
    "Multi-dimensional continuous metric for mesh adaptation", 2006 (L^p-optimal metric in 2-D, p = 2).
    """
    low, high = _clamped(curvature, limits)
    mean, line, frames = _smoothed_logarithm(
        surface, curvature, np.log(low * high) / 3.0, np.log(high / low), smoothing
    )
    spread = np.abs(line)
    smaller, larger = np.exp(mean - 0.5 * spread), np.exp(mean + 0.5 * spread)
    spherical = smaller[:, None, None] * np.eye(3)
    return np.asarray(spherical + (larger - smaller)[:, None, None] * line_tensors(line, frames))


def uniform_metric(surface: Surface) -> PointTensors:
    """Return the identity at every point (V, 3, 3)."""
    return np.tile(np.eye(3), (surface.n_points, 1, 1))


def validate_metric(tensors: npt.NDArray[Any], surface: Surface) -> PointTensors:
    """Return tensors (V, 3, 3) as exactly symmetric float64 after checking them.

    Parameters
    ----------
    tensors
        One symmetric positive definite matrix per point of the surface, in the axes of its coordinates. Lengths
        are sqrt(x^t M x); only their ratios matter.
    surface
        The surface that they belong to.

    Raises
    ------
    MetricError
        If the shape is wrong, or a matrix is not finite, not symmetric (beyond 1e-8 of its largest entry) or not
        positive definite; the message names the first such point.
    """
    try:
        given = np.asarray(tensors, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise MetricError(f"metric cannot be read as numbers ({error}); expected an array (V, 3, 3)") from error
    if given.shape != (surface.n_points, 3, 3):
        raise MetricError(f"metric has shape {given.shape}; expected ({surface.n_points}, 3, 3), one tensor per point")
    _refuse(~np.isfinite(given).all(axis=(1, 2)), given, "has an entry that is not finite")
    largest = np.abs(given).max(axis=(1, 2))
    skew = np.abs(given - given.transpose(0, 2, 1)).max(axis=(1, 2))
    _refuse(skew > 1e-8 * largest, given, "is not symmetric")
    symmetric = 0.5 * (given + given.transpose(0, 2, 1))
    smallest = np.linalg.eigvalsh(symmetric)[:, 0]
    _refuse(smallest <= 1e-12 * largest, given, "is not positive definite")
    return symmetric


def metric_root(tensors: PointTensors) -> PointTensors:
    """Return the symmetric square roots Q (V, 3, 3), Q Q = M: x -> Q x maps unit balls of the metric to spheres."""
    eigenvalues, vectors = np.linalg.eigh(tensors)
    return np.asarray((vectors * np.sqrt(np.maximum(eigenvalues, 0.0))[:, None, :]) @ vectors.transpose(0, 2, 1))


def _clamped(
    curvature: Curvature, limits: tuple[float, float]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    low, high = limits
    if not 0.0 < low <= high < np.inf:
        raise OptionError(f"curvature limits are {limits}; expected two numbers with 0 < low <= high")
    magnitude = np.clip(np.abs(curvature.values), low, high)
    return magnitude[:, 0], magnitude[:, 1]


def _smoothed_logarithm(
    surface: Surface,
    curvature: Curvature,
    mean: npt.NDArray[np.float64],
    spread: npt.NDArray[np.float64],
    passes: int,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.complex128], npt.NDArray[np.float64]]:
    """Return mean and line (difference, at twice its angle) of the log-eigenvalues after smoothing, and the frames."""
    if passes < 0:
        raise OptionError(f"smoothing is {passes}; expected 0 or more passes")
    normals = unit_normals(surface)
    frames = tangent_frames(normals)
    line = line_field(curvature.directions[:, 1], spread, frames)
    if passes:
        scalar_average, line_average = one_ring_average(surface, normals, frames)
        for _ in range(passes):
            mean, line = scalar_average @ mean, line_average @ line
    return mean, line, frames


def _refuse(bad: npt.ArrayLike, tensors: npt.NDArray[np.float64], what: str) -> None:
    where = np.flatnonzero(bad)
    if len(where):
        raise MetricError(
            f"metric[{where[0]}] = {tensors[where[0]].tolist()} {what} ({len(where)} such points); "
            "expected a symmetric positive definite 3x3 matrix at every point"
        )
