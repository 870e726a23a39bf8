"""Meshes from sites: coarse samplings give valid meshes with about the number of vertices asked for."""

import naive_rvd as naive
import numpy as np
import pytest
from delaunay_cases import assert_closed_manifold, mesh_of
from embedded import embedded_surface

from anisomesh.cvt.lloyd import lloyd
from anisomesh.delaunay import meshing
from anisomesh.mesh import topology
from anisomesh.mesh.distance import surface_distance
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import check_validity
from anisomesh.shapes import analytic as shapes
from anisomesh.voronoi.cells import cell_complex
from anisomesh.voronoi.restricted import RestrictedVoronoi
from conftest import pairwise

CASES = {
    "torus": (lambda: shapes.torus(n_major=32, n_minor=14), 8),
    "ring": (lambda: shapes.twisted_ring(n_major=60, n_section=(6, 3)), 12),
    "part": (lambda: shapes.cad_part(5), 25),
    "sheet": (lambda: shapes.box((1.0, 1.0, 0.02), n=8), 20),
    "sphere": (lambda: shapes.sphere(2), 4),
}


def case(shape, n=None):
    """Return a diagram and sites on its surface."""
    make, coarse = CASES[shape]
    surface = make()
    voronoi = RestrictedVoronoi(EmbeddedSurface.in_space(surface))
    sites = naive.random_sites(surface.points, surface.faces, n or coarse, np.random.default_rng(0))
    return voronoi, lloyd(voronoi, sites, 5)


@pytest.mark.parametrize(("shape", "factor", "crease_angle"), pairwise(CASES, (1, 6), (30.0, 180.0)))
def test_the_mesh_is_closed_with_the_topology_of_the_surface(shape, factor, crease_angle):
    voronoi, sites = case(shape, factor * CASES[shape][1])
    surface = voronoi.embedded.surface
    result = mesh_of(voronoi, sites, crease_angle=crease_angle)
    assert_closed_manifold(result.faces, topology.euler_characteristic(surface.faces))
    assert len(np.unique(result.faces)) == len(result.points)
    assert np.isfinite(result.points).all()
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    assert np.all(result.points > low - 0.1 * surface.diagonal)
    assert np.all(result.points < high + 0.1 * surface.diagonal)


@pytest.mark.parametrize("shape", ["torus", "ring", "sheet"])
def test_the_coarse_samplings_have_non_disk_cells_or_cells_of_several_components(shape):
    voronoi, sites = case(shape)
    cells = cell_complex(voronoi.diagram(sites))
    assert np.any(cells.euler != 1) or not np.all(cells.only_component)


@pytest.mark.parametrize("shape", ["sphere", "torus"])
def test_enough_sites_are_the_vertices_of_the_mesh(shape):
    voronoi, sites = case(shape, 200)
    result = mesh_of(voronoi, sites)
    assert (result.inserted, result.removed, result.from_input) == (0, 0, False)
    np.testing.assert_array_equal(result.points, sites)


def test_the_mesh_of_a_scaled_embedding_is_in_space():
    voronoi, sites = case("sphere", 100)
    scaled = embedded_surface(2.0 * voronoi.embedded.points, voronoi.embedded.faces, scale=2.0)
    result = mesh_of(RestrictedVoronoi(scaled), 2.0 * sites)
    np.testing.assert_allclose(np.linalg.norm(result.points, axis=1), 1.0, atol=0.1)


@pytest.mark.slow
def test_small_components_keep_their_shape_with_few_sites():
    """Regression: a component with one or two sites had no triangle in the dual and was lost without a warning."""
    ball = shapes.sphere(1)
    points = np.concatenate([0.2 * ball.points + [k, 0.0, 0.0] for k in range(8)])
    faces = np.concatenate([ball.faces + k * ball.n_points for k in range(8)])
    surface = Surface(points, faces)
    voronoi = RestrictedVoronoi(EmbeddedSurface.in_space(surface))
    for n in (1, 5, 12):
        sites = naive.random_sites(surface.points, surface.faces, n, np.random.default_rng(n))
        result = mesh_of(voronoi, sites)
        assert_closed_manifold(result.faces, 16)
        assert topology.connected_components(result.faces, len(result.points))[0] == 8
        assert len(np.unique(np.sort(result.faces, axis=1), axis=0)) == len(result.faces)


def test_more_creases_than_vertices_leave_points_beside_the_creases():
    """Regression: where creases fix most of the points asked for, collapses removed all others at any cost."""

    def pyramids_and_waves(x, y):
        ridge = np.minimum(np.abs(8.0 * (x + 1.0) % 2.0 - 1.0), np.abs(8.0 * (y + 1.0) % 2.0 - 1.0))
        return np.where(x < 0.0, 0.15 * ridge, 0.3 * np.sin(np.pi * x) * np.cos(0.5 * np.pi * y))

    sheet = shapes.open_patch(pyramids_and_waves, n=64)
    voronoi = RestrictedVoronoi(EmbeddedSurface.in_space(sheet))
    sites = lloyd(voronoi, naive.random_sites(sheet.points, sheet.faces, 200, np.random.default_rng(1)), 10)
    result = mesh_of(voronoi, sites, crease_angle=30.0, required=True)
    mesh = Surface(result.points, result.faces)
    assert (mesh.n_points, result.from_input) == (200, False)
    assert mesh.edge_lengths.max() < 1.0  # the waves are 1 wide
    assert surface_distance(mesh, sheet).rms < 0.02


@pytest.mark.parametrize("width", [0.005, 0.001])
def test_creases_close_together_do_not_attract_rows_of_sites(width):
    """Regression: of two creases near each other one had a site; each new site was put right beside the last one."""
    sheet = shapes.open_patch(lambda x, y: 0.0 * x, n=16)
    points = sheet.points.copy()
    points[np.isclose(points[:, 0], 0.0), 0] = -0.5 * width
    points[np.isclose(points[:, 0], 0.125), 0] = 0.5 * width
    points[:, 2] = -np.maximum(np.abs(points[:, 0]) - 0.5 * width, 0.0)  # a roof with a narrow top
    voronoi = RestrictedVoronoi(embedded_surface(points, sheet.faces))
    sites = lloyd(voronoi, naive.random_sites(points, sheet.faces, 200, np.random.default_rng(1)), 10)
    result = mesh_of(voronoi, sites, crease_angle=30.0, required=True)
    assert result.inserted < 30
    assert Surface(result.points, result.faces).edge_lengths.min() > 0.03  # the sites are about 0.17 apart


@pytest.mark.slow
def test_sites_are_added_where_triangles_intersect(monkeypatch):
    """Folds near each other that triangles of this size cut through."""
    sheet = shapes.open_patch(lambda x, y: 0.0 * x, n=64)
    u, v = 2.0 * (sheet.points[:, 0] + 1.0), sheet.points[:, 1]
    z = np.cos(np.pi * u)
    folds = sheet.with_points(np.stack([0.1 * u + 0.3 * np.sin(2.0 * v) + 0.3 * np.sin(2.0 * z), v, z], axis=1))
    voronoi = RestrictedVoronoi(EmbeddedSurface.in_space(folds))
    sites = lloyd(voronoi, naive.random_sites(folds.points, folds.faces, 60, np.random.default_rng(0)), 3)

    def faults():
        result = mesh_of(voronoi, sites)
        validity = check_validity(Surface(result.points, result.faces), folds)
        assert len(result.points) == 60
        assert (validity.euler, validity.nonmanifold_edges) == (1, 0)
        return validity.inverted + validity.self_intersections

    assert faults() == 0
    monkeypatch.setattr(meshing, "MAX_REPEATS", 0)
    assert faults() > 0
