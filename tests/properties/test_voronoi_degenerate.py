"""Input with ties everywhere: grids with sites at mesh points and edge midpoints, duplicates, symmetric shapes."""

import naive_rvd as naive
import numpy as np
import pytest
from embedded import embedded_surface
from hypothesis import given
from hypothesis import strategies as st

from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.mesh.surface import Surface
from anisomesh.shapes import analytic as shapes
from anisomesh.voronoi.cells import cell_complex
from anisomesh.voronoi.restricted import RestrictedVoronoi
from conftest import examples


def special_points(surface):
    """Return points, edge midpoints and face centres of a surface; on grids their coordinates are exact."""
    ends = surface.points[surface.edges]
    return np.concatenate([surface.points, 0.5 * (ends[:, 0] + ends[:, 1]), surface.points[surface.faces].mean(axis=1)])


def diagram_and_cells(surface, sites):
    diagram = RestrictedVoronoi(EmbeddedSurface.in_space(surface)).diagram(sites)
    return diagram, cell_complex(diagram)


def assert_partition(diagram):
    share = np.bincount(diagram.facet, diagram.fractions, minlength=len(diagram.faces))
    np.testing.assert_allclose(share, 1.0, rtol=0, atol=1e-11)
    assert diagram.fractions.min() >= -1e-12


def assert_nearest_centres(diagram):
    size = np.diff(diagram.offset)[:, None]
    centre = np.add.reduceat(diagram.positions, diagram.offset[:-1], axis=0) / size
    square = ((centre[:, None] - diagram.sites[None]) ** 2).sum(axis=2)
    assert (square[np.arange(len(centre)), diagram.site] - square.min(axis=1)).max() < 1e-13


SHAPES = [
    shapes.box(n=2),
    shapes.box((1.0, 1.0, 1.0), n=1),
    shapes.open_patch(lambda x, y: 0 * x, n=4),
    shapes.sphere(1),
    shapes.torus(n_major=8, n_minor=4),
]


@examples(60)
@given(st.sampled_from(SHAPES), st.integers(1, 150), st.integers(0, 2**32))
def test_special_sites_with_duplicates_give_a_consistent_diagram(surface, n, seed):
    rng = np.random.default_rng(seed)
    special = special_points(surface)
    diagram, cells = diagram_and_cells(surface, special[rng.integers(len(special), size=n)])
    assert_partition(diagram)
    assert_nearest_centres(diagram)
    assert cells.area.sum() == pytest.approx(surface.area, rel=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_sites_within_rounding_of_special_points_never_break_the_diagram(seed):
    # Regression: the security radius ignored rounding, so that facets disagreed or could not be clipped.
    rng = np.random.default_rng(seed)
    surface = shapes.box(n=2)
    special = special_points(surface)
    sites = special[rng.integers(len(special), size=300)] + 10.0 ** rng.uniform(-17, -6) * rng.normal(size=(300, 3))
    _, cells = diagram_and_cells(surface, sites)
    assert cells.area.min() > -1e-12


def test_the_highest_of_equal_sites_owns_their_common_cell():
    surface = shapes.box(n=2)
    special = special_points(surface)[:20]
    sites = np.concatenate([special, special, special[:7]])
    diagram, _ = diagram_and_cells(surface, sites)
    owners = set(diagram.site.tolist())
    assert owners == set(range(40, 47)) | set(range(27, 40))
    energy = RestrictedVoronoi(EmbeddedSurface.in_space(surface)).integrate(sites, 3.0)
    assert set(np.flatnonzero(energy.mass).tolist()) == owners
    assert np.isfinite(energy.gradient).all()


def test_all_sites_at_one_place():
    surface = shapes.sphere(1)
    diagram, cells = diagram_and_cells(surface, np.tile(surface.points[:1], (60, 1)))
    assert set(diagram.site.tolist()) == {59}
    assert cells.euler.tolist() == [2]


def test_a_bisector_along_mesh_edges_leaves_each_facet_to_one_side():
    surface = shapes.box(n=4)
    sites = np.array([[0.25, 0.5, 0.5], [0.75, 0.5, 0.5]])
    diagram, _ = diagram_and_cells(surface, sites)
    side = surface.points[diagram.faces[diagram.facet]].mean(axis=1)[:, 0] > 0.5
    big = diagram.fractions > 1e-12
    np.testing.assert_array_equal(diagram.site[big], side[big].astype(int))


def test_naive_predicates_and_diagram_break_ties_alike():
    # One facet whose corners are equally far from two sites: the higher index, with the smaller infinitesimal, owns it.
    surface = Surface(np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), np.array([[0, 1, 2]]))
    sites = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    diagram, _ = diagram_and_cells(surface, sites)
    low, high = naive.perturbed(naive.table(surface.points, [0, 1, 2], sites), [0, 1])
    assert all(a > b for a, b in zip(low, high, strict=True))
    assert diagram.site.tolist() == [1]


@pytest.mark.parametrize("seed", range(8))
def test_sites_equally_far_from_a_tiny_surface(seed):
    """Regression: the search tree rounds distances differently from the diagram, and a facet never got an owner."""
    surface = shapes.sphere(1)
    rng = np.random.default_rng(seed)
    sites = rng.normal(size=(60, 8))
    sites /= np.linalg.norm(sites, axis=1)[:, None]
    sites = np.concatenate([sites, sites])
    points = np.zeros((surface.n_points, 8))
    points[:, :3] = 1e-15 * surface.points
    diagram = RestrictedVoronoi(embedded_surface(points, surface.faces)).diagram(sites)
    assert np.isin(np.arange(surface.n_faces), diagram.facet).all()
    assert diagram.site.min() >= 60
