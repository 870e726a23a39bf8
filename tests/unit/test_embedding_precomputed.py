"""Precomputed embeddings and their metric."""

import numpy as np
import pytest

from anisomesh.embedding.base import EmbeddingStatus
from anisomesh.embedding.direct import embed
from anisomesh.embedding.precomputed import precomputed_embedding, pulled_back_metric
from anisomesh.mesh.surface import Surface
from anisomesh.metric.tensors import compute_metric
from anisomesh.shapes.analytic import ellipsoid, open_patch


def test_linear_coordinates_on_a_plane_have_the_metric_of_their_slopes():
    plane = open_patch(lambda x, y: 0.0 * x, n=8)
    slopes = np.random.default_rng(0).normal(size=(3, 5))
    slopes[2] = 0.0  # nothing across the plane
    tensors = pulled_back_metric(plane, plane.points @ slopes)
    np.testing.assert_allclose(tensors, np.tile(np.eye(3) + slopes @ slopes.T, (plane.n_points, 1, 1)), atol=1e-9)


def test_lengths_of_edges_in_the_metric_are_those_in_the_embedding():
    surface = ellipsoid((1.0, 0.6, 0.3), 4)
    extra = np.stack([np.sin(3.0 * surface.points[:, 0]), surface.points[:, 1] ** 2], axis=1)
    tensors = pulled_back_metric(surface, extra)
    start, end = surface.edges.T
    way, mean = surface.points[end] - surface.points[start], 0.5 * (tensors[start] + tensors[end])
    lengths = np.sqrt(np.einsum("ex,exy,ey->e", way, mean, way))
    embedded = precomputed_embedding(surface, extra, pulled_back_metric(surface, extra)).points
    off = np.abs(lengths / np.linalg.norm(embedded[end] - embedded[start], axis=1) - 1.0)
    assert np.median(off) < 0.01
    assert off.max() < 0.15  # triangles are not small against the curvature at the rim


def test_the_metric_of_a_direct_embedding_comes_back():
    surface = ellipsoid((1.0, 0.6, 0.3), 4)
    surface = surface.with_points(surface.points / surface.diagonal)
    direct = embed(surface, compute_metric(surface), max_iterations=30)
    extra = direct.points[:, 3:]
    given = precomputed_embedding(surface, extra, pulled_back_metric(surface, extra))
    np.testing.assert_allclose(given.points, direct.points, atol=1e-6)
    assert (given.status, given.iterations, given.scale) == (EmbeddingStatus.PRECOMPUTED, 0, 1.0)
    assert given.stretch.log_error < 0.05
    assert given.stretch.achieved_mean == pytest.approx(direct.stretch.achieved_mean)


def test_points_without_faces_have_the_identity():
    surface = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], [[0, 1, 2]])
    tensors = pulled_back_metric(surface, surface.points[:, :2] * 2.0)
    np.testing.assert_array_equal(tensors[3], np.eye(3))
    np.testing.assert_allclose(tensors[0], np.diag([5.0, 5.0, 1.0]))
