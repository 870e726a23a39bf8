"""Cells and the dual triangulation: topology, orientation, components."""

import itertools

import naive_rvd as naive
import numpy as np
import pytest
from delaunay_cases import assert_closed_manifold, dual_case
from hypothesis import given
from hypothesis import strategies as st

from anisomesh.delaunay.delta_complex import simplicial_mesh
from anisomesh.mesh import topology
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.mesh.surface import Surface
from anisomesh.shapes import analytic as shapes
from anisomesh.voronoi.cells import cell_complex
from anisomesh.voronoi.restricted import RestrictedVoronoi
from conftest import examples

CLOSED = {
    "sphere": (lambda: shapes.sphere(3), 2, 150),
    "torus": (lambda: shapes.torus(n_major=40, n_minor=16), 0, 300),
    "box": (lambda: shapes.box(n=8), 2, 300),
    "part": (lambda: shapes.cad_part(8), 0, 1500),
}


@pytest.mark.parametrize("shape", CLOSED)
@pytest.mark.parametrize("dimension", [3, 8])
def test_dual_of_enough_sites_is_homeomorphic_to_the_surface(shape, dimension):
    make, euler, n = CLOSED[shape]
    surface = make()
    rng = np.random.default_rng(1)
    points = naive.embed(surface.points, dimension, rng, strength=0.05)
    sites = naive.random_sites(points, surface.faces, n, rng)
    cells, dual = dual_case(surface, sites, points, iterations=10)
    assert topology.euler_characteristic(surface.faces) == euler
    assert cells.n_components == n
    assert np.all(cells.only_component)
    assert np.all(cells.euler == 1)
    assert_closed_manifold(dual.faces, euler)
    np.testing.assert_array_equal(dual.points, cells.diagram.sites)
    assert len(np.unique(dual.faces)) == n


@pytest.mark.parametrize("shape", ["sphere", "torus"])
def test_dual_triangles_are_oriented_like_their_facets(shape):
    make, _, n = CLOSED[shape]
    surface = make()
    sites = naive.random_sites(surface.points, surface.faces, n, np.random.default_rng(3))
    cells, dual = dual_case(surface, sites, iterations=10)
    diagram = cells.diagram
    normal = naive.normals(surface.points, diagram.faces)
    a, b, c = dual.points[dual.faces].transpose(1, 0, 2)
    facet = diagram.facet[diagram.polygon_of[dual.vertex]]
    assert np.all((np.cross(b - a, c - a) * normal[facet]).sum(axis=1) > 0)
    # the diagram vertex is equally far from the three sites of its triangle
    distance = np.linalg.norm(dual.points[dual.faces] - diagram.positions[dual.vertex][:, None], axis=2)
    np.testing.assert_allclose(distance, distance[:, [1, 2, 0]], atol=1e-12)


@examples(40)
@given(st.sampled_from(["sphere", "torus", "box"]), st.sampled_from([3, 6]), st.integers(1, 40), st.integers(0, 2**32))
def test_components_and_their_euler_characteristics_match_glued_polygons(shape, dimension, n, seed):
    surface = {
        "sphere": lambda: shapes.sphere(1),
        "torus": lambda: shapes.torus(n_major=9, n_minor=5),
        "box": lambda: shapes.box((1.0, 0.7, 0.05), n=2),
    }[shape]()
    rng = np.random.default_rng(seed)
    points = naive.embed(surface.points, dimension, rng)
    cells, _ = dual_case(surface, naive.random_sites(points, surface.faces, n, rng), points)
    wanted = naive.component_count_and_euler(cells.diagram)
    found = {}
    for site, euler in zip(cells.site.tolist(), cells.euler.tolist(), strict=True):
        found.setdefault(site, []).append(euler)
    assert {site: sorted(values) for site, values in found.items()} == wanted
    np.testing.assert_array_equal(cells.only_component, [len(found[site]) == 1 for site in cells.site.tolist()])
    assert np.all(np.diff(cells.site) >= 0)


def test_area_and_centroid_of_components_match_their_polygons():
    surface = shapes.box((1.0, 0.8, 0.1), n=3)
    sites = naive.random_sites(surface.points, surface.faces, 9, np.random.default_rng(0))
    cells, _ = dual_case(surface, sites)
    diagram = cells.diagram
    area = naive.areas(surface.points, diagram.faces)
    total, moment = np.zeros(cells.n_components), np.zeros((cells.n_components, 3))
    for p, component in enumerate(cells.of_polygon):
        polygon = diagram.barycentric[diagram.offset[p] : diagram.offset[p + 1]]
        for triangle in naive.triangles(polygon):
            share = np.linalg.det(triangle) * area[diagram.facet[p]]
            total[component] += share
            moment[component] += share * (triangle @ surface.points[diagram.faces[diagram.facet[p]]]).mean(axis=0)
    np.testing.assert_allclose(cells.area, total, rtol=1e-10)
    np.testing.assert_allclose(cells.centroid, moment / total[:, None], atol=1e-12)


def thin_plate_sites():
    """Sites in the middle plane of a thin plate, well inside its outline: cells have two components or are bands."""
    x, y = np.meshgrid(np.linspace(0.1, 0.9, 6), np.linspace(0.1, 0.9, 6))
    rng = np.random.default_rng(0)
    sites = np.stack([x.ravel(), y.ravel(), np.full(36, 0.005)], axis=1)
    sites[:, :2] += 0.02 * rng.normal(size=(36, 2))
    return shapes.box((1.0, 1.0, 0.01), n=10), sites


def test_both_sides_of_a_thin_sheet_get_separate_vertices():
    surface, sites = thin_plate_sites()
    cells, dual = dual_case(surface, sites)
    count = np.bincount(cells.site, minlength=36)
    inside = np.all((sites[:, :2] > 0.2) & (sites[:, :2] < 0.8), axis=1)
    assert inside.sum() >= 9
    assert np.all(count[inside] == 2)
    split = inside[cells.site]
    assert not cells.only_component[split].any()
    np.testing.assert_allclose(dual.points[split], cells.centroid[split])
    level = dual.points[split, 2].reshape(-1, 2)
    np.testing.assert_allclose(np.sort(level, axis=1), [[0.0, 0.01]] * len(level), atol=1e-12)
    # no triangle joins the two sides of the sheet inside the plate
    inner_faces = dual.faces[split[dual.faces].all(axis=1)]
    assert len(inner_faces) > 10
    np.testing.assert_allclose(np.ptp(dual.points[inner_faces, 2], axis=1), 0.0, atol=1e-12)


@pytest.mark.parametrize("n", [2, 3, 4])
@pytest.mark.parametrize("seed", range(4))
def test_dual_of_a_grid_cube_with_sites_at_its_grid_points_is_a_sphere(n, seed):
    surface = shapes.box(n=n)
    sites = np.random.default_rng(seed).permutation(surface.points)
    cells, dual = dual_case(surface, sites)
    assert np.all(cells.euler == 1)
    assert np.all(cells.only_component)
    assert_closed_manifold(dual.faces, 2)


@pytest.mark.parametrize("n", [40, 70, 98])
def test_dual_of_some_grid_points_of_a_cube_is_closed_whenever_cells_are_disks(n):
    surface = shapes.box(n=4)
    checked = 0
    for seed in range(12):
        sites = np.random.default_rng(seed).permutation(surface.points)[:n]
        cells, dual = dual_case(surface, sites)
        if not (np.all(cells.euler == 1) and np.all(cells.only_component)):
            continue
        checked += 1
        # two points may have two edges, but every side has a partner of opposite direction
        sides = topology.half_edges(dual.faces)
        assert sorted(map(tuple, sides.tolist())) == sorted(map(tuple, sides[:, ::-1].tolist()))
        assert cells.n_components - len(sides) // 2 + len(dual.faces) == 2
    assert checked >= 3


@pytest.mark.parametrize("order", list(itertools.permutations(range(4)))[::5])
def test_four_sites_on_a_circle_in_a_facet_make_two_dual_triangles(order):
    points = np.array([[-4.0, -4.0, 0.0], [8.0, -4.0, 0.0], [-4.0, 8.0, 0.0]])
    square = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])[list(order)]
    cells, dual = dual_case(Surface(points, np.array([[0, 1, 2]])), square)
    assert len(dual.faces) == 2
    a, b, c = dual.points[dual.faces].transpose(1, 0, 2)
    np.testing.assert_allclose(0.5 * np.cross(b - a, c - a)[:, 2], 0.5)
    np.testing.assert_allclose(cells.diagram.positions[dual.vertex], [[0.5, 0.5, 0.0]] * 2, atol=1e-14)


@pytest.mark.parametrize("shape", ["sphere", "torus", "box"])
@pytest.mark.parametrize("n", [30, 60])
def test_triangles_glued_along_dual_edges_are_homeomorphic_to_the_surface_if_cells_are_disks(shape, n):
    make, euler, _ = CLOSED[shape]
    surface = make()
    checked = 0
    for seed in range(6):
        sites = naive.random_sites(surface.points, surface.faces, n, np.random.default_rng(seed))
        cells, dual = dual_case(surface, sites, iterations=2)
        if not np.all(cells.euler == 1):
            continue
        checked += 1
        # every dual edge has two triangles of opposite direction
        assert np.all(np.bincount(dual.face_edges.ravel()) == 2)
        assert len(dual.edge_points) == dual.face_edges.max() + 1
        assert cells.n_components - len(dual.edge_points) + len(dual.faces) == euler
        sides = topology.half_edges(dual.faces).reshape(-1, 2)[np.argsort(dual.face_edges.ravel(), kind="stable")]
        np.testing.assert_array_equal(sides[0::2], sides[1::2, ::-1])
        points, faces, done = simplicial_mesh(dual)
        assert done
        np.testing.assert_array_equal(points[: len(dual.points)], dual.points)
        assert_closed_manifold(faces, euler)
    assert checked >= 2


def test_a_cell_that_is_the_whole_torus_is_not_a_disk():
    surface = shapes.torus(n_major=12, n_minor=8)
    few = naive.random_sites(surface.points, surface.faces, 3, np.random.default_rng(0))
    cells, _ = dual_case(surface, few)
    assert np.any(cells.euler != 1)
    whole = cell_complex(RestrictedVoronoi(EmbeddedSurface.in_space(surface)).diagram(surface.points[:1]))
    assert whole.euler.tolist() == [0]
    assert whole.area == pytest.approx(surface.area)
    assert cells.area.sum() == pytest.approx(surface.area)
    assert len(cells.diagram.site) > 3
