"""What an embedding is, and how well its stretch matches the metric."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EmbeddedPoints, FaceScalars, PointTensors
from anisomesh.embedding.gradient import FaceGradient, FaceTensors, larger_eigenvalue
from anisomesh.mesh.surface import Surface


class EmbeddingStatus(StrEnum):
    """Why the iteration stopped."""

    EXACT = "the metric is a multiple of the identity: no extra coordinates are needed"
    GIVEN = "the extra coordinates were given"
    CONVERGED = "converged"
    ITERATION_LIMIT = "iteration limit reached; raise max_iterations for a closer match of the metric"


@dataclass(frozen=True, kw_only=True)
class StretchStatistics:
    """Ratio of the largest to the smallest length factor per face, asked by the metric and achieved.

    Attributes
    ----------
    asked_mean, asked_max, achieved_mean, achieved_max
        Area-weighted mean and maximum of the ratios.
    log_error
        Area-weighted mean of ``|log(achieved / asked)|``.
    low, median, high
        The 5 %, 50 % and 95 % quantiles, by area, of achieved / asked.
    """

    asked_mean: float
    asked_max: float
    achieved_mean: float
    achieved_max: float
    log_error: float
    low: float
    median: float
    high: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Embedding:
    """A surface in d dimensions: columns 0 to 2 are ``scale`` times its coordinates, the others carry the metric.

    Attributes
    ----------
    points
        Embedded points (V, d).
    scale
        Factor of the first three columns.
    residual
        Root of the area integral of the squared difference between the gradient of the extra coordinates and the
        asked one, relative to the asked one; 0 when exact.
    iterations
        Number of global solves.
    status
        Why the iteration stopped.
    stretch
        Achieved against asked stretch.
    """

    points: EmbeddedPoints
    scale: float
    residual: float
    iterations: int
    status: EmbeddingStatus
    stretch: StretchStatistics


class Embedder(Protocol):
    """Anything that embeds a surface according to a metric."""

    def __call__(self, surface: Surface, tensors: PointTensors, /) -> Embedding:
        """Embed a surface with metric tensors (V, 3, 3)."""
        ...


def achieved_stretch(gradient: FaceGradient, embedded: EmbeddedPoints) -> FaceScalars:
    """Return the stretch (F,) of each face between the surface of a gradient and its embedding (V, d).

    The stretch is the ratio of the singular values, larger over smaller, of the linear map from the plane of the
    face to the embedding; 1 for a face without area.
    """
    jacobian = (gradient.operator @ embedded).reshape(len(gradient.areas), 2, -1)
    return asked_stretch(jacobian @ jacobian.transpose(0, 2, 1))


def asked_stretch(metric: FaceTensors) -> FaceScalars:
    """Return the stretch (F,) that a metric in the planes of the faces (F, 2, 2) asks for; 1 where it is zero."""
    larger = larger_eigenvalue(metric)
    smaller = metric[:, 0, 0] + metric[:, 1, 1] - larger
    ratio = np.divide(larger, smaller, out=np.ones_like(larger), where=smaller > 1e-14 * larger)
    return np.asarray(np.sqrt(np.maximum(ratio, 1.0)))


def stretch_statistics(gradient: FaceGradient, metric: FaceTensors, embedded: EmbeddedPoints) -> StretchStatistics:
    """Compare the stretch of an embedding (V, d) with the one that a metric on the faces (F, 2, 2) asks for."""
    asked, achieved = asked_stretch(metric), achieved_stretch(gradient, embedded)
    weight = gradient.areas / max(float(gradient.areas.sum()), np.finfo(np.float64).tiny)
    low, median, high = _quantiles(achieved / asked, weight, (0.05, 0.5, 0.95))
    return StretchStatistics(
        asked_mean=float(weight @ asked),
        asked_max=float(asked.max()),
        achieved_mean=float(weight @ achieved),
        achieved_max=float(achieved.max()),
        log_error=float(weight @ np.abs(np.log(achieved / asked))),
        low=low,
        median=median,
        high=high,
    )


def _quantiles(
    values: npt.NDArray[np.float64], weight: npt.NDArray[np.float64], levels: tuple[float, ...]
) -> list[float]:
    order = np.argsort(values)
    at = np.searchsorted(np.cumsum(weight[order]), levels)
    return [float(value) for value in values[order][np.minimum(at, len(values) - 1)]]
