"""Fewer sites from many: a subset, evenly spread, where the many are dense or where the energy is."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from anisomesh.cvt.coarsening import spread_subset
from anisomesh.cvt.energy import NormalMetric
from anisomesh.cvt.lloyd import lloyd
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.shapes.analytic import open_patch, sphere
from anisomesh.voronoi.restricted import RestrictedVoronoi

PLANE = RestrictedVoronoi(EmbeddedSurface.in_space(open_patch(lambda x, y: 0.0 * x, n=24)))
BALL = RestrictedVoronoi(EmbeddedSurface.in_space(sphere(4)))


def random_sites(voronoi, count, seed=0):
    rng, embedded = np.random.default_rng(seed), voronoi.embedded
    faces = rng.choice(embedded.surface.n_faces, count, p=embedded.face_areas / embedded.area)
    return embedded.at(faces, rng.dirichlet(np.ones(3), count))


def nearest(sites):
    return cKDTree(sites).query(sites, 2)[0][:, 1]


@pytest.mark.parametrize("n", [1, 2, 150, 299, 300, 400])
def test_the_right_number_of_different_sites_is_left(n):
    sites = random_sites(PLANE, 300)
    left = spread_subset(PLANE, sites, n)
    assert len(np.unique(left, axis=0)) == len(left) == min(n, 300)
    assert cKDTree(sites).query(left)[0].max() == 0.0


@pytest.mark.parametrize("voronoi", [PLANE, BALL], ids=["plane", "ball"])
@pytest.mark.parametrize("n", [500, 200, 50])
def test_optimised_sites_are_left_far_apart_and_without_gaps(voronoi, n):
    sites = lloyd(voronoi, random_sites(voronoi, 1000), 10)
    left, even = spread_subset(voronoi, sites, n), voronoi.embedded.site_spacing(n)
    at_random = sites[np.random.default_rng(1).permutation(len(sites))[:n]]
    assert nearest(left).min() > 0.5 * even
    assert nearest(left).mean() > 1.1 * nearest(at_random).mean()
    gaps = [cKDTree(some).query(voronoi.embedded.points)[0].max() for some in (left, at_random)]
    assert gaps[0] < 1.3 * even < gaps[1] * 1.3


def test_sites_stay_dense_where_they_are_dense():
    sites = random_sites(PLANE, 4000)
    middle = sites[:, 0].mean()
    dense = sites[:, 0] > middle
    kept = dense | (np.arange(len(sites)) % 4 == 0)
    left = spread_subset(PLANE, sites[kept], 300)
    ratio = np.count_nonzero(left[:, 0] > middle) / np.count_nonzero(left[:, 0] < middle)
    assert 2.5 < ratio < 5.5


def test_sites_gather_where_cells_have_more_energy():
    surface = open_patch(lambda x, y: 0.3 * np.abs(x) ** 3 * (x > 0.0), n=40)
    voronoi = RestrictedVoronoi(EmbeddedSurface.in_space(surface))
    sites = random_sites(voronoi, 2000)
    bent = sites[:, 0] > 0.0
    share = np.count_nonzero(bent) / len(sites)
    left = spread_subset(voronoi, sites, 200, NormalMetric(30.0))
    assert np.mean(left[:, 0] > 0.0) > 1.15 * share
