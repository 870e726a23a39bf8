"""Line fields (2-RoSy fields): one unsigned direction with a magnitude at each point."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import sparse

from anisomesh._arrays import PointScalars, PointTensors, PointVectors
from anisomesh.mesh.surface import Surface
from anisomesh.metric.tangent import TangentFrames

LineField = npt.NDArray[np.complex128]
"""Magnitude at twice the angle to the first frame vector (V,), so that opposite directions are equal numbers."""

MAX_LOG_STRETCH_SQUARED = float(np.log(400.0))  # dimensionless: the limits of the curvature metric, 400 / 1

_MIN_EIGENVALUE = 1e-30  # guard against division by zero only


def line_field_of_directions(directions: PointVectors, magnitude: PointScalars, frames: TangentFrames) -> LineField:
    """Return the line field (V,) of directions with magnitudes.

    Perpendicular directions give opposite numbers, so sums of these numbers average lines without a choice of signs.

    Parameters
    ----------
    directions
        Tangent vectors (V, 3); neither their sign nor their length matters.
    magnitude
        Magnitude of each line (V,).
    frames
        Tangent frames (V, 2, 3).

    References
    ----------
    Knoppel, Crane, Pinkall, Schroder, "Globally optimal direction fields", 2013 (representation).
    """
    along = np.einsum("vx,vix->vi", directions, frames)
    angle = np.arctan2(along[:, 1], along[:, 0])
    return np.asarray(magnitude * np.exp(2j * angle))


def directions_of_line_field(field: LineField, frames: TangentFrames) -> PointVectors:
    """Return the unit tangent direction (V, 3) of each line; its sign is arbitrary."""
    angle = 0.5 * np.angle(field)
    return np.asarray(np.cos(angle)[:, None] * frames[:, 0] + np.sin(angle)[:, None] * frames[:, 1])


def projectors_of_line_field(field: LineField, frames: TangentFrames) -> PointTensors:
    """Return the projector v v^t (V, 3, 3) onto the direction v of each line."""
    directions = directions_of_line_field(field, frames)
    return np.asarray(directions[:, :, None] * directions[:, None, :])


def principal_stretch(tensors: PointTensors) -> tuple[PointVectors, PointScalars]:
    """Return the eigenvector of the largest eigenvalue (V, 3) and the logarithm of largest over middle (V,).

    For the curvature metric (eigenvalues 1, 1, r^2) these are v_max and 2 log r. For the metric of an embedding
    (eigenvalue 1 along the normal, at least 1 in the tangent plane) they are direction and logarithm of the squared
    stretch.
    """
    values, vectors = np.linalg.eigh(tensors)
    return np.asarray(vectors[:, :, 2]), np.asarray(np.log(values[:, 2] / np.maximum(values[:, 1], _MIN_EIGENVALUE)))


def line_field_components(
    directions: PointVectors, log_stretch_squared: PointScalars, frames: TangentFrames
) -> npt.NDArray[np.float32]:
    """Return real and imaginary part (V, 2), in single precision, of the line field of :func:`principal_stretch`."""
    field = line_field_of_directions(directions, log_stretch_squared, frames)
    return np.stack([field.real, field.imag], axis=1).astype(np.float32)


def tensors_of_line_field(components: npt.NDArray[Any], frames: TangentFrames) -> PointTensors:
    """Return the curvature metric (V, 3, 3), eigenvalues 1, 1 and r^2, of a line field (V, 2) with magnitude 2 log r.

    Larger magnitudes are cut off at ``MAX_LOG_STRETCH_SQUARED``.
    """
    field = components[:, 0].astype(np.float64) + 1j * components[:, 1].astype(np.float64)
    stretch_squared = np.exp(np.minimum(np.abs(field), MAX_LOG_STRETCH_SQUARED))
    return np.asarray(np.eye(3) + (stretch_squared - 1.0)[:, None, None] * projectors_of_line_field(field, frames))


def one_ring_averages(
    surface: Surface, normals: PointVectors, frames: TangentFrames
) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Return two matrices (V, V) that average a scalar and a line field over each point and its neighbours.

    Parameters
    ----------
    surface, normals, frames
        The surface, its unit normals (V, 3) and tangent frames (V, 2, 3).

    Notes
    -----
    A neighbour's frame is transported by the smallest rotation that takes its normal to the normal of the point,
    which keeps the magnitude of a line; a projection would shrink lines on curved surfaces. A neighbour has as weight
    the cosine of the angle between the two normals, and none beyond 90 degrees, so that nothing is averaged across a
    fold; the point itself has weight 1.
    """
    i, j = np.concatenate([surface.edges, surface.edges[:, ::-1]]).T
    cosine = np.einsum("ex,ex->e", normals[i], normals[j])
    near = cosine > 0.0
    i, j, cosine = i[near], j[near], cosine[near]
    carried = frames[j, 0]
    lift = np.einsum("ex,ex->e", carried, normals[i]) / (1.0 + cosine)
    carried = carried - lift[:, None] * (normals[i] + normals[j])
    along = np.einsum("ex,ekx->ek", carried, frames[i])
    turn = np.exp(2j * np.arctan2(along[:, 1], along[:, 0]))
    own = np.arange(surface.n_points)
    rows, columns = np.concatenate([own, i]), np.concatenate([own, j])
    weight = np.concatenate([np.ones(len(own)), cosine])
    weight /= np.bincount(rows, weight)[rows]
    shape = (surface.n_points, surface.n_points)
    scalar = sparse.csr_matrix((weight, (rows, columns)), shape=shape)
    line = sparse.csr_matrix((weight * np.concatenate([np.ones(len(own)), turn]), (rows, columns)), shape=shape)
    return scalar, line
