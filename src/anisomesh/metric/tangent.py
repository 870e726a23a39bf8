"""Frames of the tangent planes and the averaging of line fields between them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import sparse

from anisomesh._arrays import PointTensors, PointVectors
from anisomesh.mesh.geometry import unit
from anisomesh.mesh.surface import Surface

Frames = npt.NDArray[np.float64]
LineField = npt.NDArray[np.complex128]


def unit_normals(surface: Surface) -> PointVectors:
    """Return the point normals (V, 3) with the z axis where a point has none, so that all are unit vectors."""
    return or_z_axis(surface.point_normals)


def or_z_axis(normals: PointVectors) -> PointVectors:
    """Return unit normals (V, 3) with the z axis in place of those that are zero."""
    return np.where(normals.any(axis=1, keepdims=True), normals, (0.0, 0.0, 1.0))


def tangent_frames(normals: PointVectors) -> Frames:
    """Return two orthonormal tangent vectors (V, 2, 3) for unit normals; (first, second, normal) is right-handed."""
    axis = np.zeros_like(normals)
    np.put_along_axis(axis, np.argmin(np.abs(normals), axis=1)[:, None], 1.0, axis=1)
    first = unit(np.cross(axis, normals))
    return np.stack([first, np.cross(normals, first)], axis=1)


def line_field(directions: PointVectors, magnitude: npt.NDArray[np.float64], frames: Frames) -> LineField:
    """Return tangent lines as complex numbers (V,): the magnitude at twice the angle to the first frame vector.

    A line has no sign: opposite directions give the same number, perpendicular ones opposite numbers, so that
    sums of these numbers average lines correctly.
    """
    along = np.einsum("vx,vix->vi", directions, frames)
    angle = np.arctan2(along[:, 1], along[:, 0])
    return np.asarray(magnitude * np.exp(2j * angle))


def line_directions(field: LineField, frames: Frames) -> PointVectors:
    """Return the unit direction (V, 3) of each line; the sign is arbitrary."""
    angle = 0.5 * np.angle(field)
    return np.asarray(np.cos(angle)[:, None] * frames[:, 0] + np.sin(angle)[:, None] * frames[:, 1])


def line_tensors(field: LineField, frames: Frames) -> PointTensors:
    """Return the projector v v^t (V, 3, 3) on the direction v of each line."""
    directions = line_directions(field, frames)
    return np.asarray(directions[:, :, None] * directions[:, None, :])


def one_ring_average(
    surface: Surface, normals: PointVectors, frames: Frames
) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Return the averages of a scalar and of a line field over each point and its neighbours, as (V, V) matrices.

    Notes
    -----
    A neighbour's frame is carried over by the smallest rotation that takes its normal to the point's normal,
    which keeps the magnitude of a line; projecting it would shrink lines where the surface bends. A neighbour
    counts with the cosine of the angle between the two normals and not at all beyond 90 degrees, so nothing
    leaks across a fold; the point itself counts 1.
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
