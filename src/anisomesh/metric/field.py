"""A metric field, and the protocol of what computes one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EmbeddedPoints, Points, PointTensors
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
    """Return the result of a metric source for a surface after validation.

    Raises
    ------
    MetricError
        If it is not a :class:`MetricField`, an array does not fit the surface, or a tensor is not symmetric positive
        definite.
    """
    if not isinstance(field, MetricField):
        raise MetricError(f"the metric source returned {type(field).__name__}; expected a MetricField")
    n = surface.n_points
    for name, array, width in (("points", field.points, 3), ("extra", field.extra, None)):
        if array is not None and not _fits(array, n, width):
            shape = f"({n}, {width or 'k'})"
            raise MetricError(f"{name} of the metric field has shape {np.shape(array)}; expected finite {shape}")
    validate_metric(field.tensors, surface)
    return field


def _fits(array: npt.NDArray[Any], n: int, width: int | None) -> bool:
    array = np.asarray(array)
    return array.ndim == 2 and len(array) == n and width in (None, array.shape[1]) and bool(np.isfinite(array).all())
