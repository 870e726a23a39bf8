"""Start positions: on the surface, in proportion to the weights, from the generator alone."""

import naive_rvd as naive
import numpy as np
import pytest

from anisomesh.cvt.energy import NormalMetric
from anisomesh.cvt.sampling import resample_by_energy, sample_surface
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.shapes import analytic as shapes
from anisomesh.voronoi.restricted import RestrictedVoronoi


def test_counts_per_run_of_faces_differ_from_the_expectation_by_less_than_two():
    surface = shapes.torus(n_major=12, n_minor=8)
    rng = np.random.default_rng(0)
    weights = rng.exponential(size=surface.n_faces)
    weights[::5] = 0.0
    n = 400
    # move the faces apart, so that the face of a point is known
    corners = surface.points[surface.faces] + 10.0 * np.arange(surface.n_faces)[:, None, None]
    points, faces = corners.reshape(-1, 3), np.arange(3 * surface.n_faces).reshape(-1, 3)
    sample = sample_surface(points, faces, weights, n, rng)
    face = np.argmin(np.linalg.norm(sample[:, None] - corners.mean(axis=1)[None], axis=2), axis=1)
    assert np.all(weights[face] > 0)
    count = np.cumsum(np.bincount(face, minlength=surface.n_faces))
    expected = n * np.cumsum(weights) / weights.sum()
    assert np.abs(count - expected).max() <= 1.0


def test_points_lie_in_their_triangle_and_average_to_its_centroid():
    rng = np.random.default_rng(1)
    points = rng.normal(size=(3, 8))
    sample = sample_surface(points, np.array([[0, 1, 2]]), np.ones(1), 20_000, rng)
    basis = points[1:] - points[0]
    share, residual, *_ = np.linalg.lstsq(basis.T, (sample - points[0]).T, rcond=None)
    assert residual.max() < 1e-20
    assert share.min() >= 0.0
    assert share.sum(axis=0).max() <= 1.0 + 1e-12
    np.testing.assert_allclose(share.mean(axis=1), 1 / 3, atol=0.01)
    # uniform: second moments of a triangle in barycentric coordinates are 1/6 and 1/12
    np.testing.assert_allclose(share @ share.T / 20_000, [[1 / 6, 1 / 12], [1 / 12, 1 / 6]], atol=0.01)


def test_the_generator_is_the_only_source_of_randomness():
    surface = shapes.sphere(1)
    one, same, other = (
        sample_surface(surface.points, surface.faces, surface.face_areas, 30, np.random.default_rng(seed))
        for seed in (5, 5, 6)
    )
    np.testing.assert_array_equal(one, same)
    assert not np.array_equal(one, other)


@pytest.mark.parametrize("n", [1, 7, 500])
def test_scale_of_the_weights_does_not_matter(n):
    surface = shapes.sphere(1)
    samples = [
        sample_surface(surface.points, surface.faces, scale * surface.face_areas, n, np.random.default_rng(0))
        for scale in (1.0, 1024.0)
    ]
    assert samples[0].shape == (n, 3)
    np.testing.assert_array_equal(*samples)


def test_resampling_by_energy_gathers_sites_at_creases_for_a_sharp_metric_only():
    surface = shapes.box(n=10)
    voronoi = RestrictedVoronoi(EmbeddedSurface.in_space(surface))
    rng = np.random.default_rng(0)
    sites = naive.random_sites(surface.points, surface.faces, 400, rng)
    sites[11] = sites[12]  # an empty cell

    def near_crease(x):
        return np.mean(np.sort(np.abs(x - np.round(x)), axis=1)[:, 1] < 0.05)

    plain, sharp = (near_crease(resample_by_energy(voronoi, sites, NormalMetric(s), rng)) for s in (1.0, 15.0))
    assert sharp > 1.5 * plain
    assert resample_by_energy(voronoi, sites, NormalMetric(15.0), rng).shape == sites.shape
