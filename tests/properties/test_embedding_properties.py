"""Properties that every direct embedding has."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from anisomesh.embedding.base import EmbeddingStatus, achieved_stretch
from anisomesh.embedding.direct import embed
from anisomesh.embedding.gradient import face_gradient
from anisomesh.mesh.geometry import unit_frame
from anisomesh.metric.tensors import compute_metric, metric_root
from anisomesh.shapes.analytic import box, ellipsoid, open_patch, torus, twisted_ring
from conftest import examples


def scaled(surface):
    return surface.with_points(unit_frame(surface.points).to_unit(surface.points))


SHAPES = {
    "torus": scaled(torus(1.0, 0.3, 60, 24)),
    "ellipsoid": scaled(ellipsoid((1.0, 0.6, 0.3), 3)),
    "box": scaled(box((1.0, 0.7, 0.4), 8)),
    "open": scaled(open_patch(lambda x, y: 0.3 * np.sin(3 * x) * np.cos(2 * y), n=20)),
    "twisted": scaled(twisted_ring(n_major=60)),
}


@pytest.mark.parametrize("kind", ["curvature", "approximation"])
@pytest.mark.parametrize("name", SHAPES)
def test_residual_never_rises_and_steps_are_counted(name, kind):
    surface = SHAPES[name]
    tensors = compute_metric(surface, kind)
    runs = [embed(surface, tensors, max_iterations=k, tolerance=0.0) for k in (1, 2, 3, 5, 8, 13)]
    residuals = [run.residual for run in runs]
    assert (np.diff(residuals) <= 1e-12).all()
    assert residuals[-1] < residuals[0]
    assert [run.iterations for run in runs] == [1, 2, 3, 5, 8, 13]
    assert residuals[0] < 1.0


@pytest.mark.parametrize("name", SHAPES)
def test_extra_coordinates_bring_the_stretch_closer(name):
    surface = SHAPES[name]
    tensors = compute_metric(surface)
    embedding = embed(surface, tensors, max_iterations=20)
    without = np.log(embedding.stretch.target_mean)
    assert embedding.stretch.log_error < 0.5 * without
    assert 0.7 < embedding.stretch.median < 1.3


@given(seed=st.integers(0, 2**31), name=st.sampled_from(list(SHAPES)))
@examples(10)
def test_embedding_turns_with_the_surface(seed, name):
    surface = SHAPES[name]
    tensors = compute_metric(surface)
    rotation = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    turned = surface.with_points(surface.points @ rotation.T)
    before = embed(surface, tensors)
    after = embed(turned, rotation @ tensors @ rotation.T)
    expected = before.points.copy()
    expected[:, :3] = before.points[:, :3] @ rotation.T
    expected[:, 3:6] = before.points[:, 3:6] @ rotation.T
    np.testing.assert_allclose(after.points, expected, atol=1e-6)
    np.testing.assert_allclose(
        achieved_stretch(face_gradient(turned), after.points),
        achieved_stretch(face_gradient(surface), before.points),
        rtol=1e-4,
    )


@given(factor=st.floats(1e-3, 1e3))
@examples(10)
def test_scaling_the_metric_scales_the_embedding(factor):
    surface = SHAPES["torus"]
    tensors = compute_metric(surface, "approximation")
    one, other = embed(surface, tensors), embed(surface, factor**2 * tensors)
    np.testing.assert_allclose(other.points, factor * one.points, rtol=1e-6, atol=1e-8 * factor)


def test_iteration_stops_by_itself_when_it_gains_nothing():
    surface = SHAPES["open"]
    tensors = compute_metric(surface)
    loose = embed(surface, tensors, max_iterations=200, tolerance=0.05)
    tight = embed(surface, tensors, max_iterations=200, tolerance=0.01)
    assert loose.status is tight.status is EmbeddingStatus.CONVERGED
    assert loose.iterations < tight.iterations < 200
    assert tight.residual < loose.residual


def test_edges_get_the_length_of_the_metric_on_average():
    surface = SHAPES["torus"]
    tensors = compute_metric(surface)
    embedding = embed(surface, tensors, max_iterations=30)
    a, b = surface.edges.T
    root = metric_root(tensors)
    asked = np.linalg.norm(
        np.einsum("exy,ey->ex", 0.5 * (root[a] + root[b]), surface.points[a] - surface.points[b]), axis=1
    )
    found = np.linalg.norm(embedding.points[a] - embedding.points[b], axis=1)
    assert abs(np.median(found / asked) - 1) < 0.05
