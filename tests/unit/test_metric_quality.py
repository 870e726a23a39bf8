"""Quality of triangles in a metric, and how a metric is carried to another mesh."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from anisomesh.errors import MetricError
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.metric.quality import anisotropic_quality
from anisomesh.metric.tensors import metric_root
from anisomesh.metric.transfer import transfer_metric_roots
from anisomesh.shapes.analytic import ellipsoid, sphere
from conftest import examples

EQUILATERAL = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, np.sqrt(3) / 2, 0]])
ONE = np.array([[0, 1, 2]])


def identity(n):
    return np.tile(np.eye(3), (n, 1, 1))


def heron_quality(a, b, c):
    s = 0.5 * (a + b + c)
    area = np.sqrt(s * (s - a) * (s - b) * (s - c))
    return 2 * np.sqrt(3) * area / (s * max(a, b, c))


def test_equilateral_triangle_is_perfect():
    np.testing.assert_allclose(anisotropic_quality(EQUILATERAL, ONE, identity(3)), 1.0)


def test_right_isosceles_triangle():
    points = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0]])
    expected = heron_quality(2, 2, np.sqrt(8))
    np.testing.assert_allclose(anisotropic_quality(points, ONE, identity(3)), expected)


@pytest.mark.parametrize("third", [[0.5, 0, 0], [1, 0, 0], [0, 0, 0]])
def test_flat_triangle_has_quality_zero(third):
    points = np.array([[0.0, 0, 0], [1, 0, 0], third])
    assert anisotropic_quality(points, ONE, identity(3)) == 0.0
    assert anisotropic_quality(0 * points, ONE, identity(3)) == 0.0


@given(seed=st.integers(0, 2**31))
@examples(30)
def test_stretched_triangle_is_perfect_in_the_metric_that_stretches_it(seed):
    rng = np.random.default_rng(seed)
    half = rng.standard_normal((3, 3))
    metric = half @ half.T + 0.05 * np.eye(3)
    root = metric_root(metric[None])
    rotation = Rotation.random(rng=rng).as_matrix()
    points = EQUILATERAL @ rotation.T @ np.linalg.inv(root[0]) + rng.standard_normal(3)
    np.testing.assert_allclose(anisotropic_quality(points, ONE, np.repeat(root, 3, axis=0)), 1.0)


@given(seed=st.integers(0, 2**31))
@examples(30)
def test_quality_lies_between_zero_and_one_and_turns_with_the_triangle(seed):
    rng = np.random.default_rng(seed)
    points, faces = rng.standard_normal((12, 3)), rng.permutation(12).reshape(-1, 3)
    half = rng.standard_normal((12, 3, 3))
    roots = metric_root(half @ half.transpose(0, 2, 1) + 0.01 * np.eye(3))
    quality = anisotropic_quality(points, faces, roots)
    assert ((quality > 0) & (quality <= 1 + 1e-12)).all()
    rotation = Rotation.random(rng=rng).as_matrix()
    turned = anisotropic_quality(points @ rotation.T, faces, rotation @ roots @ rotation.T)
    np.testing.assert_allclose(turned, quality, rtol=1e-8)
    np.testing.assert_allclose(anisotropic_quality(7 * points, faces, 3 * roots), quality, rtol=1e-8)


def test_quality_is_heron_of_the_mapped_sides():
    rng = np.random.default_rng(0)
    points = rng.standard_normal((3, 3))
    half = rng.standard_normal((3, 3, 3))
    roots = metric_root(half @ half.transpose(0, 2, 1))
    sides = [roots.mean(axis=0) @ (points[i] - points[j]) for i, j in ((0, 1), (1, 2), (2, 0))]
    expected = heron_quality(*np.linalg.norm(sides, axis=1))
    np.testing.assert_allclose(anisotropic_quality(points, ONE, roots), expected)


def test_roots_at_the_points_themselves_are_unchanged():
    surface = ellipsoid((1.0, 0.6, 0.3), 2)
    roots = np.random.default_rng(0).standard_normal((surface.n_points, 3, 3))
    np.testing.assert_allclose(transfer_metric_roots(ClosestPoints(surface), roots, surface.points), roots, atol=1e-9)


def test_linear_field_is_interpolated_exactly_above_and_below_the_surface():
    grid = np.array([[x, y, 0.0] for x in range(4) for y in range(4)])
    faces = np.array([[4 * x + y, 4 * x + y + 4, 4 * x + y + 5] for x in range(3) for y in range(3)])
    other = np.array([[4 * x + y, 4 * x + y + 5, 4 * x + y + 1] for x in range(3) for y in range(3)])
    surface = Surface(grid, np.concatenate([faces, other]))
    base, slope = np.arange(9.0).reshape(3, 3), np.ones((3, 3))

    def field(points):
        return base + (2 * points[:, 0] - 3 * points[:, 1])[:, None, None] * slope

    queries = np.random.default_rng(0).uniform([0, 0, -1], [3, 3, 1], (200, 3))
    np.testing.assert_allclose(
        transfer_metric_roots(ClosestPoints(surface), field(grid), queries), field(queries), atol=1e-9
    )


def test_roots_of_wrong_shape_are_refused():
    with pytest.raises(MetricError, match=r"expected \(12, 3, 3\)"):
        transfer_metric_roots(ClosestPoints(sphere(0)), identity(11), np.zeros((1, 3)))
