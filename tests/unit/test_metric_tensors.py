"""Metric tensors: definitions, checks of given ones, smoothing."""

import numpy as np
import pytest

from anisomesh.errors import MetricError, OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.metric.curvature import PrincipalCurvatures, principal_curvatures
from anisomesh.metric.tangent import tangent_frames
from anisomesh.metric.tensors import (
    approximation_metric,
    compute_metric,
    curvature_metric,
    metric_root,
    uniform_metric,
    validate_metric,
)
from anisomesh.shapes.analytic import cylinder, ellipsoid, open_patch, sphere


def made_up_curvature(surface, low, high, seed=0):
    """Constant curvatures with random tangent directions."""
    normals = surface.point_normals
    angle = np.random.default_rng(seed).uniform(0, 2 * np.pi, surface.n_points)
    frames = tangent_frames(normals)
    steepest = np.cos(angle)[:, None] * frames[:, 0] + np.sin(angle)[:, None] * frames[:, 1]
    values = np.tile([low, high], (surface.n_points, 1))
    directions = np.stack([np.cross(normals, steepest), steepest], axis=1)
    return PrincipalCurvatures(values=values, directions=directions, trusted=np.ones(surface.n_points, dtype=bool))


@pytest.mark.parametrize(
    ("low", "high", "stretch"),
    [(2.0, -8.0, 2.0), (-0.1, 9.0, 3.0), (1.0, 4000.0, 20.0), (0.0, 0.5, 1.0), (7.0, 7.0, 1.0)],
)
def test_curvature_metric_is_the_formula_of_the_paper(low, high, stretch):
    surface = sphere(1)
    curvature = made_up_curvature(surface, low, high)
    rotation = np.stack([curvature.directions[:, 0], curvature.directions[:, 1], surface.point_normals], axis=2)
    expected = rotation @ np.diag([1, stretch**2, 1]) @ rotation.transpose(0, 2, 1)
    np.testing.assert_allclose(curvature_metric(surface, curvature, smoothing=0), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("low", "high"), [(2.0, -8.0), (1.5, 350.0), (5.0, 5.0)])
def test_approximation_metric_is_the_optimal_one(low, high):
    surface = sphere(1)
    curvature = made_up_curvature(surface, low, high)
    hessian = np.diag(np.abs([low, high]))
    small, large = np.diag(hessian * np.linalg.det(hessian) ** (-1 / 6))
    rotation = np.stack([curvature.directions[:, 0], curvature.directions[:, 1], surface.point_normals], axis=2)
    expected = rotation @ np.diag([small, large, small]) @ rotation.transpose(0, 2, 1)
    np.testing.assert_allclose(approximation_metric(surface, curvature, smoothing=0), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("smoothing", [0, 1, 5])
@pytest.mark.parametrize("metric", [curvature_metric, approximation_metric])
def test_sign_of_the_directions_does_not_matter(metric, smoothing):
    surface = ellipsoid((0.5, 0.3, 0.2), 3)
    curvature = principal_curvatures(surface)
    signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(surface.n_points, 2, 1))
    turned = PrincipalCurvatures(
        values=curvature.values, directions=signs * curvature.directions, trusted=curvature.trusted
    )
    np.testing.assert_allclose(
        metric(surface, turned, smoothing=smoothing), metric(surface, curvature, smoothing=smoothing), atol=1e-9
    )


def test_smoothing_keeps_a_uniform_field_on_a_curved_surface():
    surface = cylinder(0.2, 1.0, n_around=24, n_along=20, closed=False)
    around = np.cross([0.0, 0.0, 1.0], surface.point_normals)
    directions = np.stack([np.cross(surface.point_normals, around), around], axis=1)
    values = np.tile([1.0, 16.0], (surface.n_points, 1))
    curvature = PrincipalCurvatures(values=values, directions=directions, trusted=np.ones(surface.n_points, dtype=bool))
    for metric in (curvature_metric, approximation_metric):
        np.testing.assert_allclose(
            metric(surface, curvature, smoothing=6), metric(surface, curvature, smoothing=0), rtol=1e-7, atol=1e-7
        )


def test_smoothing_of_disagreeing_directions_lowers_the_stretch():
    surface = open_patch(lambda x, y: 0.0 * x, n=20)
    curvature = made_up_curvature(surface, 1.0, 100.0)
    raw, smooth = (curvature_metric(surface, curvature, smoothing=k) for k in (0, 10))
    np.testing.assert_allclose(np.linalg.eigvalsh(raw)[:, 2], 100.0)
    assert np.median(np.linalg.eigvalsh(smooth)[:, 2]) < 4.0


def test_smoothing_does_not_leak_across_a_fold():
    """Two sheets facing 150 degrees apart, joined by one triangle: only the lower one is stretched."""
    sheet = open_patch(lambda x, y: 0.0 * x, n=6)
    lower = sheet.points.copy()
    lower[:, 2] -= 0.05 + np.tan(np.pi / 6) * (lower[:, 0] + 1)
    bridge = np.array([[0, sheet.n_points, 1]])
    faces = np.concatenate([sheet.faces, sheet.faces[:, ::-1] + sheet.n_points, bridge])
    surface = Surface(np.concatenate([sheet.points, lower]), faces)
    curvature = made_up_curvature(surface, 1.0, 50.0)
    upper = np.arange(sheet.n_points)
    curvature.values[upper] = 1.0
    metric = curvature_metric(surface, curvature, smoothing=3)
    np.testing.assert_allclose(metric[upper], np.broadcast_to(np.eye(3), metric[upper].shape), atol=1e-9)
    np.testing.assert_array_less(1.01, np.linalg.eigvalsh(metric[sheet.n_points :]).max())


@pytest.mark.parametrize("kind", ["curvature", "approximation", "uniform"])
def test_named_metrics_are_valid(kind):
    surface = ellipsoid((0.5, 0.3, 0.2), 3)
    metric = compute_metric(surface, kind)
    np.testing.assert_array_equal(validate_metric(metric, surface), metric)


def test_uniform_metric_is_the_identity():
    assert (uniform_metric(sphere(1)) == np.eye(3)).all()


def test_unknown_name_is_refused():
    with pytest.raises(OptionError, match="'curvatur' is unknown"):
        compute_metric(sphere(1), "curvatur")


@pytest.mark.parametrize("limits", [(0.0, 4.0), (4.0, 1.0), (-1.0, 4.0), (1.0, np.inf), (np.nan, 2.0)])
def test_wrong_limits_are_refused(limits):
    with pytest.raises(OptionError, match="limits"):
        compute_metric(sphere(1), "curvature", limits=limits)


def test_negative_smoothing_is_refused():
    with pytest.raises(OptionError, match="smoothing"):
        compute_metric(sphere(1), "curvature", smoothing=-1)


def spoiled(kind):
    tensors = np.tile(np.diag([1.0, 2.0, 3.0]), (42, 1, 1))
    tensors[7] = {
        "not finite": np.diag([1.0, np.nan, 1.0]),
        "not symmetric": np.eye(3) + np.eye(3, k=1),
        "not positive definite": np.diag([1.0, -1.0, 1.0]),
        "singular": np.diag([1.0, 0.0, 1.0]),
    }[kind]
    return tensors


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("not finite", "not finite"),
        ("not symmetric", "not symmetric"),
        ("not positive definite", "not positive definite"),
        ("singular", "not positive definite"),
    ],
)
def test_first_bad_tensor_is_named(kind, words):
    with pytest.raises(MetricError, match=rf"metric\[7\].*{words}"):
        compute_metric(sphere(1), spoiled(kind))


@pytest.mark.parametrize("shape", [(42, 3), (41, 3, 3), (42, 2, 2)])
def test_wrong_shape_is_refused(shape):
    with pytest.raises(MetricError, match=r"expected \(42, 3, 3\)"):
        validate_metric(np.ones(shape), sphere(1))


def test_words_are_refused():
    with pytest.raises(MetricError, match="numbers"):
        validate_metric(np.array(["a"]), sphere(1))


def test_given_tensors_are_kept_and_made_exactly_symmetric():
    surface = sphere(1)
    rng = np.random.default_rng(0)
    half = rng.standard_normal((surface.n_points, 3, 3))
    tensors = half @ half.transpose(0, 2, 1) + 0.1 * np.eye(3)
    tensors[:, 0, 1] *= 1 + 1e-12
    metric = compute_metric(surface, tensors)
    assert (metric == metric.transpose(0, 2, 1)).all()
    np.testing.assert_allclose(metric, tensors, rtol=1e-10)
    root = metric_root(metric)
    np.testing.assert_allclose(root @ root, metric, rtol=1e-9, atol=1e-9)
    assert (np.linalg.eigvalsh(root) > 0).all()
