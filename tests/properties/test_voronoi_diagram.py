"""The restricted Voronoi diagram of sites in general position against brute force."""

import naive_rvd as naive
import numpy as np
import pytest
from embedded import embedded_surface
from hypothesis import given
from hypothesis import strategies as st

from anisomesh._kernels import integrate
from anisomesh.errors import OptionError
from anisomesh.mesh import topology
from anisomesh.shapes import analytic as shapes
from anisomesh.voronoi.restricted import RestrictedVoronoi
from conftest import examples, pairwise

SHAPES = {
    "sphere": lambda: shapes.sphere(1),
    "torus": lambda: shapes.torus(n_major=9, n_minor=5),
    "box": lambda: shapes.box((1.0, 0.6, 0.3), n=2),
    "patch": lambda: shapes.open_patch(lambda x, y: 0.3 * x * y, n=4),
}


def make(shape, dimension, n, seed, lift=0.02):
    """Return embedded points, faces and sites."""
    rng = np.random.default_rng(seed)
    surface = SHAPES[shape]()
    points = naive.embed(surface.points, dimension, rng)
    return points, surface.faces, naive.random_sites(points, surface.faces, n, rng, lift)


def assert_same(one, other):
    for name in ("facet", "site", "offset", "label", "barycentric"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


def assert_partition(diagram):
    assert diagram.fractions.min() >= -1e-12
    share = np.bincount(diagram.facet, diagram.fractions, minlength=len(diagram.faces))
    np.testing.assert_allclose(share, 1.0, atol=1e-11)


def assert_nearest(diagram, rng):
    """Assert that the nearest site of random points of a polygon is its site, to rounding of squared distances."""
    size = np.diff(diagram.offset)
    for _ in range(4):
        weight = rng.exponential(size=len(diagram.label))
        weight /= np.repeat(np.add.reduceat(weight, diagram.offset[:-1]), size)
        place = np.add.reduceat(weight[:, None] * diagram.positions, diagram.offset[:-1], axis=0)
        square = np.stack([((place - site) ** 2).sum(axis=1) for site in diagram.sites], axis=1)
        own = square[np.arange(len(place)), diagram.site]
        assert (own - square.min(axis=1)).max() < 1e-13


cases = pytest.mark.parametrize("shape", SHAPES)
dimensions = pytest.mark.parametrize("dimension", [3, 6, 8])


@pytest.mark.parametrize(("shape", "dimension", "n"), pairwise(SHAPES, (3, 6, 8), (1, 2, 3, 4, 30, 700)))
def test_polygons_partition_every_facet_and_are_nearest_to_their_sites(shape, dimension, n):
    points, faces, sites = make(shape, dimension, n, seed=n)
    diagram = RestrictedVoronoi(embedded_surface(points, faces)).diagram(sites)
    assert_partition(diagram)
    assert_nearest(diagram, np.random.default_rng(1))


@examples(15)
@given(
    st.sampled_from(sorted(SHAPES)),
    st.sampled_from([3, 6, 8]),
    st.integers(1, 25),
    st.integers(0, 2**32),
    st.booleans(),
)
def test_polygons_agree_with_clipping_against_all_sites(shape, dimension, n, seed, lifted):
    points, faces, sites = make(shape, dimension, n, seed, lift=0.2 if lifted else 0.0)
    diagram = RestrictedVoronoi(embedded_surface(points, faces)).diagram(sites)
    wanted = {key: naive.fraction(polygon) for key, polygon in naive.polygons(points, diagram.faces, sites).items()}
    found = dict(zip(zip(diagram.facet.tolist(), diagram.site.tolist(), strict=True), diagram.fractions, strict=True))
    assert {key for key, share in wanted.items() if share > 1e-12} == {
        key for key, share in found.items() if share > 1e-12
    }
    for key, share in found.items():
        assert share == pytest.approx(wanted.get(key, 0.0), abs=1e-11)


def sides(diagram):
    """Return {(facet, corner): (sites, breakpoints)} on the side opposite a corner, from its lower to its higher point.

    Breakpoints are shares of the side.
    """
    result = {}
    first = diagram.barycentric
    last = diagram.barycentric[diagram.following]
    for k in np.flatnonzero(diagram.label < 0):
        facet, corner = int(diagram.facet[diagram.polygon_of[k]]), -1 - int(diagram.label[k])
        a, b = (corner + 1) % 3, (corner + 2) % 3
        high = b if diagram.faces[facet, b] > diagram.faces[facet, a] else a
        ends = sorted((float(first[k, high]), float(last[k, high])))
        result.setdefault((facet, corner), []).append((ends, int(diagram.site[diagram.polygon_of[k]])))
    return {
        key: ([site for _, site in sorted(pieces)], np.array([ends for ends, _ in sorted(pieces)]))
        for key, pieces in result.items()
    }


@cases
@dimensions
def test_two_facets_agree_on_their_common_edge(shape, dimension):
    points, faces, sites = make(shape, dimension, 150, seed=5)
    diagram = RestrictedVoronoi(embedded_surface(points, faces)).diagram(sites)
    along = sides(diagram)
    assert len(along) == 3 * len(faces)
    _, face_edges = topology.edges_of(diagram.faces)
    compared = 0
    for edge in range(face_edges.max() + 1):
        pair = [along[int(f), int(c)] for f, c in np.argwhere(face_edges == edge)]
        for owners, breaks in pair:
            assert breaks[0, 0] == 0.0
            assert breaks[-1, 1] == 1.0
            np.testing.assert_allclose(breaks[1:, 0], breaks[:-1, 1], rtol=0, atol=1e-13)
            assert owners == pair[0][0]
            np.testing.assert_allclose(breaks, pair[0][1], rtol=0, atol=1e-13)
        compared += len(pair) == 2
    assert compared > 0.7 * (face_edges.max() + 1)


@dimensions
def test_labels_name_the_bisectors_that_meet_in_a_vertex(dimension):
    points, faces, sites = make("torus", dimension, 200, seed=2)
    diagram = RestrictedVoronoi(embedded_surface(points, faces)).diagram(sites)
    distance = np.linalg.norm(diagram.positions[:, None] - sites[None], axis=2)
    rows = np.arange(len(distance))
    own = distance[rows, diagram.site[diagram.polygon_of]]
    for label in (diagram.label, diagram.label[diagram.previous]):
        bisector = label >= 0
        np.testing.assert_allclose(distance[rows[bisector], label[bisector]], own[bisector], atol=1e-11)
        np.testing.assert_allclose(diagram.barycentric[rows[~bisector], -1 - label[~bisector]], 0.0, atol=1e-15)
    assert (diagram.label >= 0).any()


@pytest.mark.parametrize("dimension", [3, 8])
@pytest.mark.parametrize("n", [2, 60, 3000])
def test_result_does_not_depend_on_the_number_of_threads(dimension, n):
    rng = np.random.default_rng(3)
    surface = shapes.torus()  # several chunks
    points = naive.embed(surface.points, dimension, rng)
    start, sites = (naive.random_sites(points, surface.faces, n, rng) for _ in range(2))
    results = []
    for threads in (1, 2, 3):
        voronoi = RestrictedVoronoi(embedded_surface(points, surface.faces), threads=threads)
        voronoi.integrate(start, 3.0)
        results.append((voronoi.integrate(sites, 3.0), voronoi.diagram(sites)))
    for energy, diagram in results[1:]:
        assert energy.value == results[0][0].value
        for name in ("gradient", "mass", "per_cell"):
            np.testing.assert_array_equal(getattr(energy, name), getattr(results[0][0], name))
        assert_same(diagram, results[0][1])


@examples(10)
@given(st.lists(st.tuples(st.sampled_from([20, 300]), st.floats(-4, 0)), max_size=4), st.integers(0, 2**32))
def test_history_changes_nothing_but_rounding(history, seed):
    points, faces, sites = make("torus", 6, 300, seed)
    rng = np.random.default_rng(seed)
    fresh = RestrictedVoronoi(embedded_surface(points, faces))
    used = RestrictedVoronoi(embedded_surface(points, faces))
    for n, size in history:
        used.integrate(sites[:n] + 10.0**size * rng.normal(size=(n, 6)), 2.0)
    assert_same(used.diagram(sites), fresh.diagram(sites))
    one, other = used.integrate(sites, 2.0), fresh.integrate(sites, 2.0)
    np.testing.assert_allclose(one.gradient, other.gradient, atol=1e-13)
    np.testing.assert_allclose(one.mass, other.mass, atol=1e-13)
    assert one.value == pytest.approx(other.value, rel=1e-12)


def test_many_small_steps_give_the_diagram_of_a_fresh_start():
    points, faces, sites = make("torus", 3, 800, 11)
    rng = np.random.default_rng(4)
    used = RestrictedVoronoi(embedded_surface(points, faces))
    for _ in range(40):
        step = 0.01 * rng.normal(size=sites.shape)
        step[rng.random(len(sites)) < 0.02] *= 20  # a few fast sites
        sites = sites + step
        used.integrate(sites)
    assert_same(used.diagram(sites), RestrictedVoronoi(embedded_surface(points, faces)).diagram(sites))


@pytest.mark.slow
@dimensions
def test_many_more_sites_than_facets(dimension):
    rng = np.random.default_rng(8)
    surface = shapes.sphere(0)
    points = naive.embed(surface.points, dimension, rng)
    sites = naive.random_sites(points, surface.faces, 2000, rng)
    voronoi = RestrictedVoronoi(embedded_surface(points, surface.faces))
    diagram = voronoi.diagram(sites)
    assert_partition(diagram)
    assert_nearest(diagram, rng)
    assert voronoi.integrate(sites).mass.sum() == pytest.approx(naive.areas(points, surface.faces).sum(), rel=1e-12)


@pytest.mark.parametrize("dimension", [3, 8])
@pytest.mark.parametrize("scale", [1e-3, 1e-6, 1e-8, 1e-9])
def test_clustered_sites(dimension, scale):
    # Regression: the security radius ignored the rounding of squared distances.
    rng = np.random.default_rng(6)
    surface = shapes.torus(n_major=9, n_minor=5)
    points = naive.embed(surface.points, dimension, rng)
    centres = naive.random_sites(points, surface.faces, 3, rng)
    sites = centres[rng.integers(3, size=300)] + scale * rng.normal(size=(300, dimension))
    diagram = RestrictedVoronoi(embedded_surface(points, surface.faces)).diagram(sites)
    assert_partition(diagram)
    assert_nearest(diagram, rng)


@pytest.mark.slow
@examples(25)
@given(st.integers(0, 2**32), st.sampled_from([3, 6, 8]), st.integers(100, 400))
def test_sites_at_all_scales_around_one_point(seed, dimension, n):
    # Regression: the security radius ignored the rounding of squared distances.
    rng = np.random.default_rng(seed)
    surface = shapes.torus(n_major=8, n_minor=5)
    points = naive.embed(surface.points, dimension, rng)
    centre = naive.random_sites(points, surface.faces, 1, rng)
    sites = centre + rng.normal(size=(n, dimension)) * 10.0 ** rng.uniform(-11, 0, size=(n, 1))
    diagram = RestrictedVoronoi(embedded_surface(points, surface.faces)).diagram(sites)
    assert_partition(diagram)
    assert_nearest(diagram, rng)


def test_face_order_maps_the_faces_of_the_diagram_to_the_input_faces():
    points, faces, _ = make("torus", 3, 1, 0)
    embedded = embedded_surface(points, faces)
    np.testing.assert_array_equal(np.sort(embedded.face_order), np.arange(len(faces)))
    np.testing.assert_array_equal(faces[embedded.face_order], embedded.faces)


def test_polygon_index_finds_exactly_the_polygons():
    points, faces, sites = make("sphere", 3, 40, 0)
    diagram = RestrictedVoronoi(embedded_surface(points, faces)).diagram(sites)
    facet, site = (table.ravel() for table in np.meshgrid(np.arange(len(faces)), np.arange(40), indexing="ij"))
    found = diagram.polygon_index(facet, site)
    np.testing.assert_array_equal(np.sort(found[found >= 0]), np.arange(len(diagram.site)))
    np.testing.assert_array_equal(diagram.facet[found[found >= 0]], facet[found >= 0])
    np.testing.assert_array_equal(diagram.site[found[found >= 0]], site[found >= 0])


def test_point_at_names_the_surface_point_at_a_vertex():
    points, faces, sites = make("torus", 3, 12, 0)
    diagram = RestrictedVoronoi(embedded_surface(points, faces)).diagram(sites)
    point = diagram.point_at(np.arange(len(diagram.label)))
    np.testing.assert_array_equal(point >= 0, (diagram.barycentric == 1.0).any(axis=1))
    np.testing.assert_array_equal(diagram.positions[point >= 0], points[point[point >= 0]])
    assert set(point[point >= 0]) == set(range(len(points)))


def test_layout_and_writability_of_the_arrays_do_not_matter_and_compile_nothing_new():
    points, faces, sites = make("sphere", 3, 20, 0)
    plain = RestrictedVoronoi(embedded_surface(points, faces)).integrate(sites)
    n_compiled = len(integrate.integrate_chunk.signatures)
    frozen = np.asfortranarray(sites)
    frozen.flags.writeable = False
    fixed = np.array(points, order="F")
    fixed.flags.writeable = False
    voronoi = RestrictedVoronoi(embedded_surface(fixed, faces.astype(np.int64)))
    np.testing.assert_array_equal(voronoi.integrate(frozen).gradient, plain.gradient)
    assert len(integrate.integrate_chunk.signatures) == n_compiled
    assert frozen.flags.f_contiguous
    whole = np.round(sites * 4).astype(np.int64)
    np.testing.assert_array_equal(voronoi.integrate(whole).mass, voronoi.integrate(whole.astype(float)).mass)


def test_wrong_shapes_and_options_are_refused():
    points, faces, sites = make("sphere", 6, 5, 0)
    voronoi = RestrictedVoronoi(embedded_surface(points, faces))
    for wrong in (sites[:, :3], sites[:0], sites[0]):
        with pytest.raises(OptionError, match=r"expected \(S, 6\)"):
            voronoi.integrate(wrong)
    with pytest.raises(OptionError, match="threads = 0"):
        RestrictedVoronoi(embedded_surface(points, faces), threads=0)
