"""Sizes that a metric asks for, against closed forms."""

import numpy as np
import pytest

import anisomesh
from anisomesh.embedding.density import area_factors, density_of_sizes
from anisomesh.shapes.analytic import open_patch, sphere, torus

FACTOR = 10.0


def flat(n=40):
    return open_patch(lambda x, y: 0.0 * x, n)


def place(points, surface):
    low = surface.points[:, 0].min()
    return (points[:, 0] - low) / np.ptp(surface.points[:, 0])


def tensors_of(sizes):
    return np.eye(3) / sizes[:, None, None] ** 2


@pytest.mark.parametrize(
    ("make", "fit"),
    [(flat, True), (lambda: sphere(4), True), (torus, True), (torus, False)],
    ids=["flat", "sphere", "torus", "torus without a fit"],
)
def test_a_tenfold_size_is_followed_at_both_ends(make, fit):
    surface = make()

    def size(points):
        return FACTOR ** place(points, surface)

    result = anisomesh.remesh(surface, n_vertices=800, metric=tensors_of(size(surface.points)), fit=fit)
    edges = result.surface.points[result.surface.edges]
    middle = edges.mean(axis=1)
    length = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1) / size(middle)
    length /= np.median(length)
    for end in (place(middle, surface) < 0.25, place(middle, surface) > 0.75):
        assert length[end].mean() == pytest.approx(1.0, abs=0.1)


def test_the_density_is_the_fourth_power_of_the_size_where_the_embedding_is_the_surface():
    surface = flat(60)
    size = 1.0 + place(surface.points, surface)
    density = density_of_sizes(surface, tensors_of(size), surface.points) * size**4
    assert np.ptp(density) < 0.05 * density.mean()
    np.testing.assert_allclose(area_factors(surface, tensors_of(size)) ** 2 * size**4, density, rtol=1e-12)


def test_the_density_is_constant_where_the_embedding_is_exact():
    surface = torus()
    stretch = np.array([1.0, 2.0, 3.0])
    tensors = np.broadcast_to(np.diag(stretch**2), (surface.n_points, 3, 3))
    np.testing.assert_allclose(density_of_sizes(surface, tensors, surface.points * stretch), 1.0, rtol=1e-9)
