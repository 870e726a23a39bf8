"""Metric tensors: the squared length x^t M x that a remesh should give to a vector x at a point of the surface."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import PointScalars, PointTensors, real_array
from anisomesh.errors import MetricError, OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.metric.curvature import PrincipalCurvatures, principal_curvatures
from anisomesh.metric.line_field import LineField, line_field_of_directions, one_ring_averages, projectors_of_line_field
from anisomesh.metric.names import METRIC_NAMES, MetricName
from anisomesh.metric.tangent import TangentFrames, tangent_frames, unit_normals

DEFAULT_LIMITS = (1.0, 400.0)  # 1/length at bounding-box diagonal 1: stretch r of at most 20
DEFAULT_SMOOTHING = 3  # one-ring averages; chosen on training meshes

_MAX_ASYMMETRY = 1e-8  # largest difference of M and M^t, over the largest entry of M: single precision is accepted
_LARGEST_ENTRY = 1e100  # so that products of three eigenvalues neither overflow nor, inverted, underflow
_MIN_CONDITION = 1e-12  # smallest eigenvalue over largest entry: above the rounding of eigenvalues


def compute_metric(
    surface: Surface,
    kind: MetricName | npt.NDArray[Any] = "curvature",
    *,
    limits: tuple[float, float] = DEFAULT_LIMITS,
    smoothing: int = DEFAULT_SMOOTHING,
    radius: int = 5,
) -> PointTensors:
    """Return the tensors (V, 3, 3) of a built-in metric, or validated input tensors.

    Parameters
    ----------
    surface
        The surface at bounding-box diagonal 1 (the curvature limits refer to it).
    kind
        ``"curvature"`` (of the paper: triangles stretched along the direction of smaller curvature, area not
        prescribed), ``"approximation"`` (size follows curvature as well: least mean squared error for a number of
        triangles), ``"uniform"`` (isotropic), or tensors (V, 3, 3).
    limits
        Lowest and highest curvature magnitude, 1/length at bounding-box diagonal 1.
    smoothing
        Number of one-ring averages of the tensors, 0 for none.
    radius
        Rings of edges over which curvature is fitted, at least 2.

    Returns
    -------
    tensors
        Symmetric positive definite, dimensionless for ``"curvature"`` and ``"uniform"``; only ratios of lengths
        matter.

    Raises
    ------
    MetricError
        If input tensors are not symmetric positive definite, or not one per point.
    OptionError
        If the name is unknown or an option is out of range.
    """
    if not isinstance(kind, str):
        return validate_metric(kind, surface)
    if kind not in METRIC_NAMES:
        raise OptionError(
            f"metric {kind!r} is unknown; expected one of {', '.join(METRIC_NAMES)}, or tensors (V, 3, 3)"
        )
    if kind == "uniform":
        return uniform_metric(surface)
    metric = curvature_metric if kind == "curvature" else approximation_metric
    return metric(surface, principal_curvatures(surface, radius=radius), limits=limits, smoothing=smoothing)


def curvature_metric(
    surface: Surface,
    curvature: PrincipalCurvatures,
    *,
    limits: tuple[float, float] = DEFAULT_LIMITS,
    smoothing: int = DEFAULT_SMOOTHING,
) -> PointTensors:
    """Return the metric of the paper, M = R diag(1, r^2, 1) R^t, R = [v_min, v_max, n], r = sqrt(|k_max / k_min|).

    Parameters
    ----------
    surface, curvature
        The surface at bounding-box diagonal 1 and its principal curvatures.
    limits
        Lowest and highest curvature magnitude, 1/length; r is at most the square root of their quotient.
    smoothing
        Number of one-ring averages of log r and v_max, as a line field.

    Returns
    -------
    tensors
        Symmetric positive definite (V, 3, 3), dimensionless; the eigenvalues along the normal and v_min are 1.

    Raises
    ------
    OptionError
        If the limits are not 0 < low <= high, or smoothing is negative.

    Notes
    -----
    v_max is averaged as the line field 2 log r * exp(2 i angle), transported between tangent planes: opposite
    directions agree and perpendicular ones cancel, so r tends to 1 where neighbours disagree (umbilics), and no sign
    has to be chosen. The paper averages r and signed directions separately. Fewer averages than the default leave
    noise in the metric that triangles cannot follow; more reduce the stretch and widen the influence of creases.

    References
    ----------
    NASM, section 3.1 and equation 1.
    """
    low, high = _clamped(curvature, limits)
    _, field, frames = _smoothed_logarithm(surface, curvature, np.zeros_like(low), np.log(high / low), smoothing)
    stretch_squared = np.exp(np.abs(field))
    return np.asarray(np.eye(3) + (stretch_squared - 1.0)[:, None, None] * projectors_of_line_field(field, frames))


def approximation_metric(
    surface: Surface,
    curvature: PrincipalCurvatures,
    *,
    limits: tuple[float, float] = DEFAULT_LIMITS,
    smoothing: int = DEFAULT_SMOOTHING,
) -> PointTensors:
    """Return the metric of least mean squared distance, |H| det|H|^(-1/6), H the second fundamental form.

    Parameters
    ----------
    surface, curvature
        The surface at bounding-box diagonal 1 and its principal curvatures.
    limits
        Lowest and highest curvature magnitude, 1/length; the lowest bounds the size of triangles on flat parts.
    smoothing
        Number of one-ring averages of the logarithm of the tensor.

    Returns
    -------
    tensors
        Symmetric positive definite (V, 3, 3), in length^(-2/3); only ratios of lengths matter. The eigenvalue along
        the normal is the smaller tangent one, as in the curvature metric.

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
    mean, field, frames = _smoothed_logarithm(
        surface, curvature, np.log(low * high) / 3.0, np.log(high / low), smoothing
    )
    difference = np.abs(field)
    smaller, larger = np.exp(mean - 0.5 * difference), np.exp(mean + 0.5 * difference)
    spherical = smaller[:, None, None] * np.eye(3)
    return np.asarray(spherical + (larger - smaller)[:, None, None] * projectors_of_line_field(field, frames))


def uniform_metric(surface: Surface) -> PointTensors:
    """Return the identity at every point (V, 3, 3)."""
    return np.tile(np.eye(3), (surface.n_points, 1, 1))


def validate_metric(
    tensors: npt.ArrayLike, surface: Surface, *, numbers: npt.NDArray[np.integer] | None = None
) -> PointTensors:
    """Return tensors (V, 3, 3) as exactly symmetric float64, after validation.

    Parameters
    ----------
    tensors
        One symmetric positive definite matrix per point, in the coordinate axes. Lengths are sqrt(x^t M x); only
        their ratios matter.
    surface
        The surface with the V points.
    numbers
        Numbers of the points (V,) in messages; by default their indices.

    Raises
    ------
    MetricError
        If the shape is wrong, or a matrix is not real and finite, not symmetric (to 1e-8 of its largest entry), not
        positive definite or nearly singular (smallest eigenvalue up to 1e-12 of the largest entry), or its largest
        entry is not between 1e-100 and 1e100; counts such points and names the first.
    """
    matrices = real_array("metric", tensors, (surface.n_points, 3, 3), MetricError)
    return validate_tensors(matrices, np.arange(len(matrices)) if numbers is None else numbers, "metric")


def validate_tensors(matrices: PointTensors, numbers: npt.NDArray[np.integer], name: str) -> PointTensors:
    """Return tensors (n, 3, 3) as exactly symmetric ones; errors as :func:`validate_metric`, with name and numbers."""

    def reject(invalid: npt.ArrayLike, reason: str, eigenvalues: npt.NDArray[np.float64] | None = None) -> None:
        where = np.flatnonzero(invalid)
        if len(where):
            first = where[np.argmin(numbers[where])]
            count, total = len(np.unique(numbers[where])), len(np.unique(numbers))
            spectrum = "" if eigenvalues is None else ", ".join(f"{value:.4g}" for value in eigenvalues[first])
            raise MetricError(
                f"{name}[{numbers[first]}] = {matrices[first].tolist()} {reason} "
                f"({f'eigenvalues {spectrum}; ' if spectrum else ''}like this: {count:,} of {total:,}); "
                "expected a symmetric positive definite 3x3 matrix everywhere"
            )

    reject(~np.isfinite(matrices).all(axis=(1, 2)), "has an entry that is not finite")
    largest = np.abs(matrices).max(axis=(1, 2))
    reject(largest > _LARGEST_ENTRY, f"has an entry above {_LARGEST_ENTRY:g}")
    skew = np.abs(matrices - matrices.transpose(0, 2, 1)).max(axis=(1, 2))
    reject(skew > _MAX_ASYMMETRY * largest, "is not symmetric")
    symmetric = 0.5 * (matrices + matrices.transpose(0, 2, 1))
    eigenvalues = np.linalg.eigvalsh(symmetric)
    reject(eigenvalues[:, 0] <= 0.0, "is not positive definite", eigenvalues)
    reject(eigenvalues[:, 0] <= _MIN_CONDITION * largest, "is nearly singular", eigenvalues)
    reject(largest < 1.0 / _LARGEST_ENTRY, f"has no entry above {1 / _LARGEST_ENTRY:g}")
    return np.asarray(symmetric)


def metric_root(tensors: PointTensors) -> PointTensors:
    """Return the symmetric square roots Q (V, 3, 3), Q Q = M; x -> Q x maps unit balls of the metric to spheres."""
    eigenvalues, vectors = np.linalg.eigh(tensors)
    return np.asarray((vectors * np.sqrt(np.maximum(eigenvalues, 0.0))[:, None, :]) @ vectors.transpose(0, 2, 1))


def area_factors_of_tensors(tensors: PointTensors, normals: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the area in the metric (n, 3, 3) over the area (n,) in planes with unit normals (n, 3); 0 without normal.

    It is the root of det M n^t M^-1 n.
    """
    inverse = np.linalg.solve(tensors, normals[:, :, None])[:, :, 0]
    return np.asarray(np.sqrt(np.maximum(np.linalg.det(tensors) * np.einsum("nx,nx->n", normals, inverse), 0.0)))


def _clamped(curvature: PrincipalCurvatures, limits: tuple[float, float]) -> tuple[PointScalars, PointScalars]:
    """Return the smaller and the larger curvature magnitude (V,), clamped to the limits."""
    low, high = limits
    if not 0.0 < low <= high < np.inf:
        raise OptionError(f"curvature limits are {limits}; expected two numbers with 0 < low <= high")
    magnitude = np.clip(np.abs(curvature.values), low, high)
    return magnitude[:, 0], magnitude[:, 1]


def _smoothed_logarithm(
    surface: Surface, curvature: PrincipalCurvatures, mean: PointScalars, difference: PointScalars, smoothing: int
) -> tuple[PointScalars, LineField, TangentFrames]:
    """Return mean and line field (difference along v_max) of the log-eigenvalues after averaging, and the frames."""
    if smoothing < 0:
        raise OptionError(f"smoothing is {smoothing}; expected 0 or more one-ring averages")
    normals = unit_normals(surface)
    frames = tangent_frames(normals)
    field = line_field_of_directions(curvature.directions[:, 1], difference, frames)
    if smoothing:
        scalar_average, line_average = one_ring_averages(surface, normals, frames)
        for _ in range(smoothing):
            mean, field = scalar_average @ mean, line_average @ field
    return mean, field, frames
