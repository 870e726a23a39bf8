"""The embedding of a surface, and how well its stretch agrees with the metric."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EmbeddedPoints, FaceScalars
from anisomesh.embedding.gradient import FaceGradient, FaceTensors, larger_eigenvalue

_MIN_ANISOTROPY = 1e-14  # smaller over larger eigenvalue of a face metric; below it rounding decides the ratio


class EmbeddingStatus(StrEnum):
    """How the embedding was found, or why the iteration stopped."""

    EXACT = "the metric is a multiple of the identity: no extra coordinates are needed"
    PRECOMPUTED = "the extra coordinates were precomputed"
    CONVERGED = "converged"
    ITERATION_LIMIT = "iteration limit reached; raise max_iterations for better agreement with the metric"


@dataclass(frozen=True, kw_only=True)
class StretchStatistics:
    """Stretch of the faces, as the metric prescribes it (target) and as the embedding has it (achieved).

    The stretch of a face is the ratio, at least 1, of the largest to the smallest factor of length in its plane.

    Attributes
    ----------
    target_mean, target_max, achieved_mean, achieved_max
        Area-weighted mean and maximum of the stretch.
    log_error
        Area-weighted mean of ``|log(achieved / target)|``.
    low, median, high
        The 5 %, 50 % and 95 % quantiles, by area, of achieved / target.
    """

    target_mean: float
    target_max: float
    achieved_mean: float
    achieved_max: float
    log_error: float
    low: float
    median: float
    high: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Embedding:
    """A surface in d dimensions: ``scale`` times its coordinates, and d - 3 extra coordinates that carry the metric.

    Attributes
    ----------
    points
        Embedded points (V, d), columns 0 to 2 are ``scale`` times the points of the surface.
    scale
        Factor of the first three columns.
    residual
        Root of the area integral of |G - T|^2 over that of |T|^2, with G the gradient of the extra coordinates and T
        the target gradient; 0 if exact.
    iterations
        Number of global solves.
    status
        How the embedding was found, or why the iteration stopped.
    stretch
        Achieved and target stretch.
    """

    points: EmbeddedPoints
    scale: float
    residual: float
    iterations: int
    status: EmbeddingStatus
    stretch: StretchStatistics


def achieved_stretch(gradient: FaceGradient, embedded: EmbeddedPoints) -> FaceScalars:
    """Return the stretch (F,) of each face of a surface by its embedding (V, d).

    It is the ratio of larger to smaller singular value of the linear map from the plane of the face to the embedding;
    1 for a degenerate face.
    """
    jacobian = (gradient.operator @ embedded).reshape(len(gradient.areas), 2, -1)
    return target_stretch(jacobian @ jacobian.transpose(0, 2, 1))


def target_stretch(metric: FaceTensors) -> FaceScalars:
    """Return the stretch (F,) of a metric in the planes of the faces (F, 2, 2); 1 where the metric is singular."""
    larger = larger_eigenvalue(metric)
    smaller = metric[:, 0, 0] + metric[:, 1, 1] - larger
    ratio = np.divide(larger, smaller, out=np.ones_like(larger), where=smaller > _MIN_ANISOTROPY * larger)
    return np.asarray(np.sqrt(np.maximum(ratio, 1.0)))


def stretch_statistics(gradient: FaceGradient, metric: FaceTensors, embedded: EmbeddedPoints) -> StretchStatistics:
    """Return the statistics of the stretch of an embedding (V, d) and of a metric on the faces (F, 2, 2)."""
    target, achieved = target_stretch(metric), achieved_stretch(gradient, embedded)
    weight = gradient.areas / max(float(gradient.areas.sum()), np.finfo(np.float64).tiny)
    low, median, high = _quantiles(achieved / target, weight, (0.05, 0.5, 0.95))
    return StretchStatistics(
        target_mean=float(weight @ target),
        target_max=float(target.max()),
        achieved_mean=float(weight @ achieved),
        achieved_max=float(achieved.max()),
        log_error=float(weight @ np.abs(np.log(achieved / target))),
        low=low,
        median=median,
        high=high,
    )


def _quantiles(
    values: npt.NDArray[np.float64], weight: npt.NDArray[np.float64], levels: tuple[float, ...]
) -> list[float]:
    """Return weighted quantiles of values (F,); weights (F,) have sum 1."""
    order = np.argsort(values)
    at = np.searchsorted(np.cumsum(weight[order]), levels)
    return [float(value) for value in values[order][np.minimum(at, len(values) - 1)]]
