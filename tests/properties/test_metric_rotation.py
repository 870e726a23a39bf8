"""The metric rotates with the surface."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from anisomesh.metric.tensors import compute_metric
from anisomesh.shapes.analytic import ellipsoid
from conftest import examples

SURFACE = ellipsoid((0.45, 0.3, 0.15), 3)


@pytest.mark.parametrize("kind", ["curvature", "approximation"])
@given(seed=st.integers(0, 2**31))
@examples(10)
def test_metric_turns_with_the_surface(kind, seed):
    rotation = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    turned = compute_metric(SURFACE.with_points(SURFACE.points @ rotation.T), kind)
    expected = rotation @ compute_metric(SURFACE, kind) @ rotation.T
    np.testing.assert_allclose(turned, expected, atol=1e-4 * np.abs(expected).max())


@pytest.mark.parametrize("kind", ["curvature", "approximation"])
def test_metric_hardly_depends_on_the_order_of_points_and_faces(kind):
    """The fit takes its axes from the first neighbour in the lists, which changes it by less than its own error."""
    rng = np.random.default_rng(0)
    order = rng.permutation(SURFACE.n_points)
    back = np.argsort(order)
    faces = back[SURFACE.faces][rng.permutation(SURFACE.n_faces)]
    shuffled = type(SURFACE)(SURFACE.points[order], faces)
    expected = compute_metric(SURFACE, kind)
    np.testing.assert_allclose(compute_metric(shuffled, kind)[back], expected, atol=0.03 * np.abs(expected).max())
