"""Energy and gradient of the normal-metric CVT against brute force, central differences and complex steps."""

import naive_rvd as naive
import numpy as np
import pytest

from anisomesh.shapes import analytic as shapes
from anisomesh.voronoi.restricted import RestrictedVoronoi, facet_table

SHAPES = {
    "sphere": lambda: shapes.sphere(1),
    "torus": lambda: shapes.torus(n_major=9, n_minor=5),
    "box": lambda: shapes.box((1.0, 0.6, 0.3), n=2),
    "part": lambda: shapes.cad_part(3),
}
PAPER = pytest.mark.parametrize("sharpness", [1.0, 3.0, 7.0])


def make(shape, dimension, n, seed=0):
    rng = np.random.default_rng(seed)
    surface = SHAPES[shape]()
    points = naive.embed(surface.points, dimension, rng, strength=0.3)
    sites = naive.random_sites(points, surface.faces, n, rng, lift=0.01)
    return RestrictedVoronoi(points, surface.faces), sites, rng


@pytest.mark.parametrize("shape", ["sphere", "box"])
@pytest.mark.parametrize("dimension", [3, 6, 8])
@PAPER
def test_energy_and_masses_are_those_of_the_definition(shape, dimension, sharpness):
    voronoi, sites, _ = make(shape, dimension, 12)
    energy, mass, moment = naive.energy(voronoi.points, voronoi.faces, sites, sharpness)
    evaluation = voronoi.evaluate(sites, sharpness)
    assert evaluation.energy == pytest.approx(energy, rel=1e-11)
    assert evaluation.cell_energy.sum() == pytest.approx(energy, rel=1e-11)
    np.testing.assert_allclose(evaluation.mass, mass, rtol=1e-10, atol=1e-13)
    assert evaluation.mass.sum() == pytest.approx(naive.areas(voronoi.points, voronoi.faces).sum(), rel=1e-12)
    if sharpness == 1.0:
        to_centroid = 2 * (mass[:, None] * sites - moment)
        np.testing.assert_allclose(evaluation.gradient, to_centroid, atol=1e-11)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("dimension", [3, 8])
@PAPER
def test_gradient_is_the_complex_step_derivative_through_the_symbolic_vertices(shape, dimension, sharpness):
    voronoi, sites, _ = make(shape, dimension, 15)
    evaluation = voronoi.evaluate(sites, sharpness)
    diagram = voronoi.diagram(sites)
    assert naive.symbolic_energy(diagram, sites, sharpness) == pytest.approx(evaluation.energy, rel=1e-10)
    gradient = naive.complex_step_gradient(diagram, sites, sharpness)
    scale = np.abs(gradient).max()
    np.testing.assert_allclose(evaluation.gradient, gradient, rtol=0, atol=1e-8 * scale)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("dimension", [3, 8])
@PAPER
def test_gradient_is_the_limit_of_central_differences(shape, dimension, sharpness):
    voronoi, sites, rng = make(shape, dimension, 120, seed=4)
    gradient = voronoi.evaluate(sites, sharpness).gradient
    step = 1e-6
    directions = list(rng.normal(size=(4, *sites.shape)))
    for place in zip(rng.integers(len(sites), size=6), rng.integers(dimension, size=6), strict=True):
        directions.append(np.zeros_like(sites))
        directions[-1][place] = 1.0
    scale = np.abs(gradient).max()
    for direction in directions:
        above, below = (voronoi.evaluate(sites + sign * step * direction, sharpness).energy for sign in (1, -1))
        wanted = float((gradient * direction).sum())
        assert (above - below) / (2 * step) == pytest.approx(wanted, abs=1e-5 * scale * np.linalg.norm(direction))


def test_motion_of_the_cell_boundaries_matters_on_a_crease():
    # Without it the gradient would be 2 m (x - g) plus the normal part; the test would pass for any sharpness then.
    voronoi, sites, _ = make("box", 3, 15)
    sharpness = 7.0
    evaluation = voronoi.evaluate(sites, sharpness)
    diagram = voronoi.diagram(sites)
    mass = diagram.fractions * voronoi.facets.area[diagram.facet]
    normal = voronoi.facets.normal[diagram.facet]
    corner = voronoi.points[voronoi.faces[diagram.facet, 0]]
    height = np.einsum("pk,pk->p", normal, corner - sites[diagram.site])
    fixed = voronoi.evaluate(sites, 1.0).gradient
    np.add.at(fixed, diagram.site, -2 * (sharpness**2 - 1) * (mass * height)[:, None] * normal)
    assert np.linalg.norm(fixed - evaluation.gradient) > 0.01 * np.linalg.norm(evaluation.gradient)


@pytest.mark.parametrize("sharpness", [1.0, 4.0])
def test_energy_keeps_its_value_under_motions_and_grows_with_the_fourth_power_of_the_scale(sharpness):
    voronoi, sites, rng = make("torus", 3, 40)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    shift = rng.normal(size=3)

    def move(x):
        return 2.5 * x @ rotation.T + shift

    moved = RestrictedVoronoi(move(voronoi.points), voronoi.faces).evaluate(move(sites), sharpness)
    still = voronoi.evaluate(sites, sharpness)
    assert moved.energy == pytest.approx(2.5**4 * still.energy, rel=1e-9)
    np.testing.assert_allclose(moved.gradient, 2.5**3 * still.gradient @ rotation.T, atol=1e-9)


def test_facet_table_holds_areas_sides_and_normals_of_slivers_too():
    rng = np.random.default_rng(0)
    for height in (1.0, 1e-3, 1e-6):
        corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.37, height, 0.0]])
        rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        rotation *= np.sign(np.linalg.det(rotation))
        table = facet_table(corners @ rotation.T, np.array([[0, 1, 2]], dtype=np.int32))
        assert table.area[0] == pytest.approx(0.5 * height, rel=1e-8)
        np.testing.assert_allclose(table.normal[0], rotation[:, 2], atol=1e-8 / height)
        np.testing.assert_allclose(table.side2[0], [0.63**2 + height**2, 0.37**2 + height**2, 1.0], rtol=1e-12)
