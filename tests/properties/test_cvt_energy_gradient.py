"""Energy and gradient of the normal-metric CVT against brute force, central differences and complex steps."""

import naive_rvd as naive
import numpy as np
import pytest
from embedded import embedded_surface

from anisomesh.shapes import analytic as shapes
from anisomesh.voronoi.restricted import RestrictedVoronoi
from conftest import pairwise

SHAPES = {
    "sphere": lambda: shapes.sphere(1),
    "torus": lambda: shapes.torus(n_major=9, n_minor=5),
    "box": lambda: shapes.box((1.0, 0.6, 0.3), n=2),
    "part": lambda: shapes.cad_part(3),
}
SHARPNESS = [1.0, 3.0, 7.0]


def make(shape, dimension, n, seed=0):
    rng = np.random.default_rng(seed)
    surface = SHAPES[shape]()
    points = naive.embed(surface.points, dimension, rng, strength=0.3)
    sites = naive.random_sites(points, surface.faces, n, rng, lift=0.01)
    return RestrictedVoronoi(embedded_surface(points, surface.faces)), sites, rng


@pytest.mark.parametrize(("shape", "dimension", "sharpness"), pairwise(["sphere", "box"], [3, 6, 8], SHARPNESS))
def test_energy_and_masses_match_the_definition(shape, dimension, sharpness):
    voronoi, sites, _ = make(shape, dimension, 12)
    embedded = voronoi.embedded
    energy, mass, moment = naive.energy(embedded.points, embedded.faces, sites, sharpness)
    found = voronoi.integrate(sites, sharpness)
    assert found.value == pytest.approx(energy, rel=1e-11)
    assert found.per_cell.sum() == pytest.approx(energy, rel=1e-11)
    np.testing.assert_allclose(found.mass, mass, rtol=1e-10, atol=1e-13)
    assert found.mass.sum() == pytest.approx(naive.areas(embedded.points, embedded.faces).sum(), rel=1e-12)
    if sharpness == 1.0:
        to_centroid = 2 * (mass[:, None] * sites - moment)
        np.testing.assert_allclose(found.gradient, to_centroid, atol=1e-11)


@pytest.mark.parametrize(("shape", "dimension", "sharpness"), pairwise(SHAPES, [3, 8], SHARPNESS))
def test_gradient_is_the_complex_step_derivative_through_the_symbolic_vertices(shape, dimension, sharpness):
    voronoi, sites, _ = make(shape, dimension, 15)
    found = voronoi.integrate(sites, sharpness)
    diagram = voronoi.diagram(sites)
    assert naive.symbolic_energy(diagram, sites, sharpness) == pytest.approx(found.value, rel=1e-10)
    gradient = naive.complex_step_gradient(diagram, sites, sharpness)
    scale = np.abs(gradient).max()
    np.testing.assert_allclose(found.gradient, gradient, rtol=0, atol=1e-8 * scale)


@pytest.mark.parametrize(("shape", "dimension", "sharpness"), pairwise(SHAPES, [3, 8], SHARPNESS))
def test_gradient_is_the_limit_of_central_differences(shape, dimension, sharpness):
    voronoi, sites, rng = make(shape, dimension, 120, seed=4)
    gradient = voronoi.integrate(sites, sharpness).gradient
    step = 1e-6
    directions = list(rng.normal(size=(4, *sites.shape)))
    for place in zip(rng.integers(len(sites), size=6), rng.integers(dimension, size=6), strict=True):
        directions.append(np.zeros_like(sites))
        directions[-1][place] = 1.0
    scale = np.abs(gradient).max()
    for direction in directions:
        above, below = (voronoi.integrate(sites + sign * step * direction, sharpness).value for sign in (1, -1))
        wanted = float((gradient * direction).sum())
        assert (above - below) / (2 * step) == pytest.approx(wanted, abs=1e-5 * scale * np.linalg.norm(direction))


def test_motion_of_the_cell_boundaries_matters_on_a_crease():
    # without it the gradient would be 2 m (x - g) plus the normal part
    voronoi, sites, _ = make("box", 3, 15)
    sharpness = 7.0
    found = voronoi.integrate(sites, sharpness)
    diagram, embedded = voronoi.diagram(sites), voronoi.embedded
    mass = diagram.fractions * embedded.face_areas[diagram.facet]
    normal = embedded.facets.normal[diagram.facet]
    corner = embedded.points[embedded.faces[diagram.facet, 0]]
    height = np.einsum("pk,pk->p", normal, corner - sites[diagram.site])
    fixed = voronoi.integrate(sites, 1.0).gradient
    np.add.at(fixed, diagram.site, -2 * (sharpness**2 - 1) * (mass * height)[:, None] * normal)
    assert np.linalg.norm(fixed - found.gradient) > 0.01 * np.linalg.norm(found.gradient)


@pytest.mark.parametrize("sharpness", [1.0, 4.0])
def test_energy_keeps_its_value_under_motions_and_grows_with_the_fourth_power_of_the_scale(sharpness):
    voronoi, sites, rng = make("torus", 3, 40)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    shift = rng.normal(size=3)

    def move(x):
        return 2.5 * x @ rotation.T + shift

    embedded = embedded_surface(move(voronoi.embedded.points), voronoi.embedded.faces)
    moved = RestrictedVoronoi(embedded).integrate(move(sites), sharpness)
    still = voronoi.integrate(sites, sharpness)
    assert moved.value == pytest.approx(2.5**4 * still.value, rel=1e-9)
    np.testing.assert_allclose(moved.gradient, 2.5**3 * still.gradient @ rotation.T, atol=1e-9)


def test_facets_have_accurate_areas_sides_and_normals_even_on_slivers():
    rng = np.random.default_rng(0)
    for height in (1.0, 1e-3, 1e-6):
        corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.37, height, 0.0]])
        rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        rotation *= np.sign(np.linalg.det(rotation))
        facets = embedded_surface(corners @ rotation.T, np.array([[0, 1, 2]])).facets
        assert facets.area[0] == pytest.approx(0.5 * height, rel=1e-8)
        np.testing.assert_allclose(facets.normal[0], rotation[:, 2], atol=1e-8 / height)
        np.testing.assert_allclose(facets.side2[0], [0.63**2 + height**2, 0.37**2 + height**2, 1.0], rtol=1e-12)
