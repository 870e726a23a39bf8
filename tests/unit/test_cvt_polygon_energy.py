"""Energies from a function of a polygon: they agree with the closed form, and with differences where there is none."""

from functools import cache

import numba
import numpy as np
import pytest
from polygon_functions import height, plain

from anisomesh import EmbeddedSurface, OptionError, RestrictedVoronoi, check_energy_gradient, energy_from_kernel
from anisomesh.shapes.analytic import open_patch, torus


def problem(surface, density=None, seed=0):
    rng = np.random.default_rng(seed)
    points = np.concatenate([surface.points, 0.5 * surface.point_normals], axis=1)
    voronoi = RestrictedVoronoi(EmbeddedSurface(surface, points, 1.0, density))
    sites = points[rng.choice(len(points), 40, replace=False)] + 0.05 * rng.normal(size=(40, 6))
    return voronoi, sites


SURFACES = {
    "closed": torus(n_major=20, n_minor=10),
    "open": open_patch(lambda x, y: 0.4 * x * x - 0.3 * y * y, 10),
}


@cache
def energies():
    """Return the plain energy and the height spread, compiled once."""
    return energy_from_kernel(plain), energy_from_kernel(height)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "weighted"), [("closed", True), ("open", False)])
def test_the_closed_form_is_reproduced(name, weighted):
    surface = SURFACES[name]
    density = 0.5 + np.random.default_rng(3).random(surface.n_points) if weighted else None
    voronoi, sites = problem(surface, density)
    parts = [energy.evaluate(voronoi, sites) for energy in energies()]
    exact, sharp = voronoi.integrate(sites), voronoi.integrate(sites, 3.0)
    assert parts[0].value == pytest.approx(exact.value, rel=1e-12)
    np.testing.assert_allclose(parts[0].gradient, exact.gradient, atol=1e-9 * np.abs(exact.gradient).max())
    np.testing.assert_allclose(parts[0].mass, exact.mass, rtol=1e-10)
    np.testing.assert_allclose(parts[0].per_cell, exact.per_cell, atol=1e-12 * exact.per_cell.max())
    assert parts[0].value + 8.0 * parts[1].value == pytest.approx(sharp.value, rel=1e-12)
    sharp_gradient = parts[0].gradient + 8.0 * parts[1].gradient
    np.testing.assert_allclose(sharp_gradient, sharp.gradient, atol=1e-9 * np.abs(sharp.gradient).max())


@pytest.mark.slow
def test_a_gradient_without_closed_form_agrees_with_differences():
    @numba.njit
    def perimeter(vertices, site, normal, vertex_gradient, site_gradient):
        total = 0.0
        for k in range(len(vertices)):
            following = (k + 1) % len(vertices)
            edge = vertices[following] - vertices[k]
            length = np.sqrt((edge * edge).sum())
            if length > 0.0:
                for x in range(len(site)):
                    vertex_gradient[following, x] += edge[x] / length
                    vertex_gradient[k, x] -= edge[x] / length
            total += length
        return total

    assert check_energy_gradient(energy_from_kernel(perimeter)) < 1e-4


def test_the_density_multiplies_the_energy_facet_by_facet():
    surface = SURFACES["open"]
    voronoi, sites = problem(surface)
    heavy, _ = problem(surface, np.full(surface.n_points, 3.0))
    one, three = voronoi.integrate(sites, 7.0), heavy.integrate(sites, 7.0)
    for name in ("value", "gradient", "mass", "per_cell"):
        np.testing.assert_allclose(getattr(three, name), 3.0 * getattr(one, name), rtol=1e-9, atol=1e-12)
    uneven, _ = problem(surface, 1.0 + np.arange(surface.n_points) % 5)
    value, rng = uneven.integrate(sites, 7.0), np.random.default_rng(1)
    for _ in range(4):
        direction = rng.normal(size=sites.shape)
        up, down = (uneven.integrate(sites + sign * 1e-6 * direction, 7.0).value for sign in (1, -1))
        assert (value.gradient * direction).sum() == pytest.approx((up - down) / 2e-6, rel=1e-4)


def test_a_function_that_is_not_compiled_is_refused():
    with pytest.raises(OptionError, match="decorate it with"):
        energy_from_kernel(lambda vertices, site, normal, vertex_gradient, site_gradient: 0.0)
