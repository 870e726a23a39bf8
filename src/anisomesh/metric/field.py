"""A metric field, and the protocol of what computes one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EmbeddedPoints, Points, PointTensors, real_array
from anisomesh.errors import MetricError
from anisomesh.mesh.surface import Surface
from anisomesh.metric.tensors import validate_metric


@dataclass(frozen=True, kw_only=True, eq=False)
class MetricField:
    """A metric at the points of a surface.

    Attributes
    ----------
    tensors
        Symmetric positive definite matrices M (V, 3, 3) in the coordinate axes; the length of a vector x is
        sqrt(x^t M x). Only ratios of lengths matter.
    points
        Positions (V, 3) that the points of the surface are to have from here on, None to leave them: a source that
        removes noise moves them.
    extra
        Extra coordinates (V, k) that already embed the metric, None if the embedding is still to be computed.
    noise
        Root mean square height by which ``points`` differ from the surface, in mean edge lengths.
    """

    tensors: PointTensors
    points: Points | None = None
    extra: EmbeddedPoints | None = None
    noise: float = 0.0


class MetricSource(Protocol):
    """Anything that computes a metric on a surface.

    It is called with the prepared surface at bounding-box diagonal 1, long edges split, so that lengths and curvatures
    do not depend on the units of the input.
    """

    def __call__(self, surface: Surface, /) -> MetricField:
        """Return the metric at the points of a surface."""
        ...


def checked_field(field: Any, surface: Surface) -> MetricField:
    """Return the result of a metric source for a surface after validation, its arrays in float64.

    Raises
    ------
    MetricError
        If it is not a :class:`MetricField`, an array does not fit the surface, or a tensor is not symmetric positive
        definite.
    """
    if not isinstance(field, MetricField):
        raise MetricError(f"the metric source returned {type(field).__name__}; expected a MetricField")
    tensors = validate_metric(field.tensors, surface)
    points = extra = None
    if field.points is not None:
        points = _finite("points", field.points, (surface.n_points, 3))
    if field.extra is not None:
        width = np.shape(field.extra)[-1] if np.ndim(field.extra) == 2 else 0
        extra = _finite("extra", field.extra, (surface.n_points, width))
    return MetricField(tensors=tensors, points=points, extra=extra, noise=field.noise)


def _finite(name: str, values: Any, shape: tuple[int, ...]) -> npt.NDArray[np.float64]:
    array = real_array(f"{name} of the metric field", values, shape, MetricError)
    if not np.isfinite(array).all():
        raise MetricError(f"{name} of the metric field has a number that is not finite")
    return array
