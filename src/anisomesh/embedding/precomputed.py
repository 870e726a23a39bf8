"""Embeddings with precomputed extra coordinates, such as the output of a network, and their metric."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import EmbeddedPoints, PointTensors, real_array
from anisomesh.embedding.base import Embedding, EmbeddingStatus, stretch_statistics
from anisomesh.embedding.gradient import face_gradient, face_tensors
from anisomesh.errors import MetricError, OptionError
from anisomesh.mesh.geometry import sums_at_points
from anisomesh.mesh.surface import Surface


def precomputed_embedding(surface: Surface, extra: EmbeddedPoints, tensors: PointTensors) -> Embedding:
    """Return the embedding [xyz, extra] of a surface.

    Parameters
    ----------
    surface
        The surface.
    extra
        Extra coordinates (V, k), in units of the surface.
    tensors
        Target metric (V, 3, 3), for the statistics of the stretch only.

    Raises
    ------
    OptionError
        If the extra coordinates are not real numbers (V, k).
    MetricError
        If the tensors are not real numbers (V, 3, 3).
    """
    extra = real_array("extra", extra, (surface.n_points, None), OptionError)
    tensors = real_array("tensors", tensors, (surface.n_points, 3, 3), MetricError)
    points, gradient = np.concatenate([surface.points, extra], axis=1), face_gradient(surface)
    metric = face_tensors(surface, tensors, gradient.frames)
    return Embedding(
        points=points,
        scale=1.0,
        residual=0.0,
        iterations=0,
        status=EmbeddingStatus.PRECOMPUTED,
        stretch=stretch_statistics(gradient, metric, points),
    )


def pulled_back_metric(surface: Surface, extra: EmbeddedPoints) -> PointTensors:
    """Return the metric (V, 3, 3) that the embedding [xyz, extra] induces on the surface.

    On a face it is the identity plus the sum of g g^t over the gradients g of the extra coordinates (V, k), so 1 along
    the normal. At a point it is the area-weighted mean over the faces there; the identity without faces.
    """
    gradient = face_gradient(surface)
    components = (gradient.operator @ extra).reshape(surface.n_faces, 2, -1)
    gradients = np.einsum("fkx,fkc->fxc", gradient.frames, components)
    weighted = gradient.areas[:, None, None] * (gradients @ gradients.transpose(0, 2, 1))
    total = sums_at_points(weighted, surface.faces, surface.n_points)
    area = sums_at_points(gradient.areas, surface.faces, surface.n_points)[:, None, None]
    return np.asarray(np.eye(3) + np.divide(total, area, out=np.zeros_like(total), where=area > 0.0))
