"""The stretch that vertices can follow on narrow patches, such as the walls of thin plates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceLabels, FaceScalars, FaceVectors
from anisomesh.mesh.geometry import even_edge_length, unit
from anisomesh.mesh.surface import Surface
from anisomesh.metric.field import MetricField, mean_at_points

_ROUNDS = 4  # of spacing and limits, which depend on each other; they change by a few per cent after two


def limit_to_patches(field: MetricField, surface: Surface, n_vertices: int) -> MetricField:
    """Return a metric field without the stretch that triangles cannot have because a patch is too narrow.

    Parameters
    ----------
    field
        The metric of the surface. It is returned as it is if it has no patches.
    surface
        The surface.
    n_vertices
        Number of vertices asked for.

    Notes
    -----
    In a metric with eigenvalues a < b, vertices at the distance h lie h / sqrt(a) apart along the direction of a. If
    the patch ends after a length H < h / sqrt(a), the triangles are that much shorter, and as narrow as before they
    would be less stretched than the metric asks for: on the wall of a thin plate most vertices would go to the two
    rims. The stretch sqrt(b / a) is multiplied by sqrt(a) H / h there, down to 1.
    """
    if field.corner_tensors is None or field.patch is None:
        return field
    tensors = field.corner_tensors.mean(axis=1)
    values, vectors = np.linalg.eigh(tensors)
    across = unit(np.cross(surface.face_normals, vectors[:, :, 2]))
    length = np.sqrt(values[:, 1]) * _extent(surface, field.patch, across)
    factor = np.ones(surface.n_faces)
    for _ in range(_ROUNDS):
        large = np.maximum(values[:, 1], values[:, 2] * factor**2)
        area = float((surface.face_areas * np.sqrt(values[:, 1] * large)).sum())
        spacing = even_edge_length(area, n_vertices)
        factor = np.minimum(1.0, length / spacing)
    narrow = factor < 1.0
    if not narrow.any():
        return field
    corners = np.array(field.corner_tensors)
    values, vectors = np.linalg.eigh(corners[narrow])
    values[..., 2] = np.maximum(values[..., 1], values[..., 2] * factor[narrow, None] ** 2)
    corners[narrow] = (vectors * values[..., None, :]) @ vectors.swapaxes(-1, -2)
    return replace(field, tensors=mean_at_points(surface, corners), corner_tensors=corners)


def _extent(surface: Surface, patch: FaceLabels, direction: FaceVectors) -> FaceScalars:
    """Return the mean length (F,) of the patch of each face along a direction field: area over projected width.

    The projected width is half the integral of |direction . conormal| along the boundary of the patch; a closed patch
    has an infinite length.
    """
    width: npt.NDArray[np.float64] = np.zeros(int(patch.max()) + 1)
    first, second = surface.edge_faces.T
    ends = surface.points[surface.edges]
    for face, other in ((first, second), (second, first)):
        at_rim = (face >= 0) & ((other < 0) | (patch[face] != patch[other]))
        inside = face[at_rim]
        conormal = np.cross(ends[at_rim, 1] - ends[at_rim, 0], surface.face_normals[inside])
        along = np.abs(np.einsum("ex,ex->e", conormal, direction[inside]))
        width += np.bincount(patch[inside], 0.5 * along, minlength=len(width))
    area = np.bincount(patch, surface.face_areas, minlength=len(width))
    extent = np.divide(area, width, out=np.full(len(width), np.inf), where=width > 0.0)
    return np.asarray(extent[patch])
