"""An embedding whose extra coordinates are given, as by a network, and the metric that it has."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import EmbeddedPoints, PointTensors
from anisomesh.embedding.base import Embedding, EmbeddingStatus, stretch_statistics
from anisomesh.embedding.gradient import face_gradient, face_tensors
from anisomesh.mesh.geometry import sums_at_points
from anisomesh.mesh.surface import Surface


def given_embedding(surface: Surface, extra: EmbeddedPoints, tensors: PointTensors) -> Embedding:
    """Return the embedding [xyz, extra] of a surface, from extra coordinates (V, k) and the metric asked (V, 3, 3)."""
    points, gradient = np.concatenate([surface.points, extra], axis=1), face_gradient(surface)
    metric = face_tensors(surface, tensors, gradient.frames)
    return Embedding(
        points=points,
        scale=1.0,
        residual=0.0,
        iterations=0,
        status=EmbeddingStatus.GIVEN,
        stretch=stretch_statistics(gradient, metric, points),
    )


def pulled_back_metric(surface: Surface, extra: EmbeddedPoints) -> PointTensors:
    """Return the metric (V, 3, 3) that lengths in the embedding [xyz, extra] are.

    On a face it is the identity and the sum of g g^t over the gradients g of the extra coordinates (V, k), so 1 along
    the normal; at a point the mean of the faces around it by area, the identity where there are none.
    """
    gradient = face_gradient(surface)
    slopes = (gradient.operator @ extra).reshape(surface.n_faces, 2, -1)
    in_space = np.einsum("fkx,fkc->fxc", gradient.frames, slopes)
    weighted = gradient.areas[:, None, None] * (in_space @ in_space.transpose(0, 2, 1))
    total = sums_at_points(weighted, surface.faces, surface.n_points)
    area = sums_at_points(gradient.areas, surface.faces, surface.n_points)[:, None, None]
    return np.asarray(np.eye(3) + np.divide(total, area, out=np.zeros_like(total), where=area > 0.0))
