"""A metric field, and the protocol of what computes one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import CornerTensors, EmbeddedPoints, FaceLabels, Points, PointTensors, real_array
from anisomesh._values import real_number
from anisomesh.errors import MetricError
from anisomesh.mesh.geometry import sums_at_points
from anisomesh.mesh.surface import Surface
from anisomesh.metric.tensors import validate_metric, validate_tensors

MAX_COORDINATE = 1e6  # of embedded points, in bounding-box diagonals: far above any metric, far below overflow
_MAX_GROWTH = 10.0  # by which a source that removes noise may change the size of the surface


@dataclass(frozen=True, kw_only=True, eq=False)
class MetricField:
    """A metric at the points of a surface.

    Attributes
    ----------
    tensors
        Symmetric positive definite matrices M (V, 3, 3) in the coordinate axes; the length of a vector x is
        sqrt(x^t M x). Only ratios of lengths matter.
    corner_tensors
        The metric at the corners of the faces (F, 3, 3, 3), where it jumps across creases; None if it is continuous,
        so that the corners have ``tensors[faces]``. ``tensors`` are then averages over the faces at a point.
    patch
        Number of the smooth patch of each face (F,), bounded by creases, if there are ``corner_tensors``.
    points
        Positions (V, 3) that the points of the surface are to have from here on, None to leave them: a source that
        removes noise moves them.
    extra
        Extra coordinates (V, k) that already embed the metric, None if the embedding is still to be computed.
    noise
        Root mean square height by which ``points`` differ from the surface, in mean edge lengths.
    remarks
        What a user should know, one sentence each.
    """

    tensors: PointTensors
    corner_tensors: CornerTensors | None = None
    patch: FaceLabels | None = None
    points: Points | None = None
    extra: EmbeddedPoints | None = None
    noise: float = 0.0
    remarks: tuple[str, ...] = ()


class MetricSource(Protocol):
    """Anything that computes a metric on a surface.

    It is called with the prepared surface at bounding-box diagonal 1, long edges split, so that lengths and curvatures
    do not depend on the units of the input. It is called several times, each time with edges split that are too long in
    the metric of the last call.
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
        points = _bounded("points", field.points, (surface.n_points, 3))
        growth = float(np.linalg.norm(np.ptp(points, axis=0))) / surface.diagonal
        if not 1.0 / _MAX_GROWTH < growth < _MAX_GROWTH:
            raise MetricError(f"points of the metric field change the size of the surface by a factor of {growth:.3g}")
    if field.extra is not None:
        extra = _bounded("extra", field.extra, (surface.n_points, None))
    noise = real_number("noise of the metric field", field.noise, MetricError)
    if not (np.isfinite(noise) and noise >= 0.0):
        raise MetricError(f"noise of the metric field is {noise}; expected a length of at least 0")
    corners = None
    if field.corner_tensors is not None:
        shape = (surface.n_faces, 3, 3, 3)
        given = real_array("corner_tensors of the metric field", field.corner_tensors, shape, MetricError)
        corners = validate_tensors(given.reshape(-1, 3, 3), np.arange(3 * surface.n_faces), "corner_tensors").reshape(
            shape
        )
    patch = None
    if field.patch is not None:
        given = real_array("patch of the metric field", field.patch, (surface.n_faces,), MetricError)
        patch = np.unique(given, return_inverse=True)[1].astype(np.int32)
    if not (isinstance(field.remarks, tuple) and all(isinstance(remark, str) for remark in field.remarks)):
        raise MetricError(f"remarks of the metric field are {field.remarks!r}; expected a tuple of sentences")
    return replace(field, tensors=tensors, corner_tensors=corners, patch=patch, points=points, extra=extra, noise=noise)


def mean_at_points(surface: Surface, corner_tensors: CornerTensors) -> PointTensors:
    """Return the area-weighted means (V, 3, 3) of tensors at the corners; the identity at points without area."""
    sums = np.zeros((surface.n_points, 3, 3))
    np.add.at(sums, surface.faces, surface.face_areas[:, None, None, None] * corner_tensors)
    area = sums_at_points(surface.face_areas, surface.faces, surface.n_points)[:, None, None]
    identity = np.broadcast_to(np.eye(3), sums.shape)
    return np.asarray(np.divide(sums, area, out=np.array(identity), where=area > 0.0))


def _bounded(name: str, values: Any, shape: tuple[int | None, ...]) -> npt.NDArray[np.float64]:
    array = real_array(f"{name} of the metric field", values, shape, MetricError)
    if not (np.abs(array) <= MAX_COORDINATE).all():
        raise MetricError(f"{name} of the metric field has a number that is not finite or above {MAX_COORDINATE:g}")
    return array
