"""Open surfaces: boundary loops, the intervals into which cells cut them, and remeshes that keep the boundary."""

from functools import cache

import igl
import naive_rvd as naive
import numpy as np
import pytest

from anisomesh.cvt.constraints import ConstrainedSites, spread_on_features
from anisomesh.cvt.energy import NormalMetric
from anisomesh.cvt.lbfgs import DescentOptions, minimise
from anisomesh.cvt.lloyd import lloyd
from anisomesh.features.boundary import trace_boundary
from anisomesh.features.detect import sharp_edges
from anisomesh.features.network import trace_features
from anisomesh.mesh import topology
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.mesh.surface import Surface
from anisomesh.pipeline import remesh
from anisomesh.shapes.analytic import open_patch, sphere
from anisomesh.voronoi.intervals import boundary_intervals, crease_intervals
from anisomesh.voronoi.restricted import RestrictedVoronoi


def band(around=60, across=8, height=1.0):
    """Return an open cylinder of radius 1: two boundary loops."""
    u, v = np.meshgrid(np.arange(around), np.arange(across + 1), indexing="ij")
    angle = 2 * np.pi * u.ravel() / around
    points = np.stack([np.cos(angle), np.sin(angle), height * v.ravel() / across], axis=1)
    i, j = (x.ravel() for x in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    a, b = i * (across + 1) + j, (i + 1) % around * (across + 1) + j
    return Surface(points, np.concatenate([np.stack([a, b, b + 1], axis=1), np.stack([a, b + 1, a + 1], axis=1)]))


def without_faces(surface, gone):
    used, faces = np.unique(surface.faces[~gone], return_inverse=True)
    return Surface(surface.points[used], faces.reshape(-1, 3))


def square(n=16, width=1.0):
    patch = open_patch(lambda x, y: 0.0 * x, n=n)
    points = patch.points - patch.points.min(axis=0)
    return Surface(points / np.ptp(points[:, 0]) * [1.0, width, 1.0], patch.faces)


def pierced():
    """Return a square with a hole of one triangle far from the outer boundary, and a hole of six triangles."""
    surface = square(20)
    centre = surface.points[surface.faces].mean(axis=1)
    gone = np.zeros(surface.n_faces, dtype=bool)
    gone[np.argmin(np.linalg.norm(centre - [0.3, 0.3, 0.0], axis=1))] = True
    middle = np.argmin(np.linalg.norm(surface.points - [0.7, 0.7, 0.0], axis=1))
    gone |= (surface.faces == middle).any(axis=1)
    return without_faces(surface, gone)


def halved_sphere():
    ball = sphere(4)
    return without_faces(ball, (ball.points[ball.faces][:, :, 2] < -0.1).any(axis=1))


def wedge():
    """Return a triangle with a tip of 11 degrees, in many small triangles."""
    patch = square(24)
    x, y = patch.points[:, 0], patch.points[:, 1]
    points = np.stack([x + 0.01, 0.2 * (x + 0.01) * (y - 0.5), 0.0 * x], axis=1)
    return Surface(points, patch.faces)


OPEN = {
    "wedge": (wedge, 60),
    "square": (square, 150),
    "few": (square, 12),
    "pierced": (pierced, 80),
    "strip": (lambda: square(40, 0.02), 60),
    "band": (band, 120),
    "low band": (lambda: band(height=0.05), 60),
    "half": (halved_sphere, 150),
    "two": (lambda: Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]), 40),
}


def loops_of(surface):
    return trace_boundary(surface.points, surface)


def distance_to_boundary(points, surface):
    boundary = surface.edges[surface.edge_face_count == 1].astype(np.int64)
    tree = igl.AABB()
    tree.init(surface.points, boundary)
    return np.sqrt(tree.squared_distance(surface.points, boundary, np.ascontiguousarray(points))[0])


@pytest.mark.parametrize("name", OPEN)
def test_polylines_are_the_boundary_loops(name):
    surface = OPEN[name][0]()
    loops, wanted = loops_of(surface), topology.boundary_loops(surface.faces)
    assert loops.n_polylines == len(wanted)
    found = {frozenset(loops.tail[a:b].tolist()) for a, b in zip(loops.first[:-1], loops.first[1:], strict=True)}
    assert found == {frozenset(loop.tolist()) for loop in wanted}
    assert loops.start[-1] == pytest.approx(surface.edge_lengths[surface.edge_face_count == 1].sum())


def test_arc_lengths_wrap_around_a_loop():
    loops = loops_of(square(4))
    zero = np.zeros(3, dtype=np.int64)
    corner = loops.at(np.array([0.0, 4.0, -8.0]), zero)
    np.testing.assert_allclose(corner, np.tile(corner[0], (3, 1)), atol=1e-12)
    places = np.linspace(0.0, 4.0, 37)
    points = loops.at(places, np.zeros(37, dtype=np.int64))
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).sum() == pytest.approx(4.0, abs=1e-9)
    assert np.allclose(distance_to_boundary(points, square(4)), 0.0, atol=1e-12)


def test_corners_are_where_the_boundary_turns_and_not_at_small_notches():
    surface = square(16)
    loops = loops_of(surface)
    segments, turn = loops.corners(0.2, np.zeros(0, dtype=np.int64))
    at = surface.points[loops.tail[segments]]
    assert {tuple(np.round(point[:2]).astype(int)) for point in at} == {(0, 0), (0, 1), (1, 0), (1, 1)}
    np.testing.assert_allclose(np.abs(at - np.round(at)), 0.0, atol=1e-12)
    np.testing.assert_allclose(turn, 90.0)
    notched = np.array(surface.points)
    lower = np.flatnonzero((notched[:, 1] == 0.0) & (notched[:, 0] > 0.05) & (notched[:, 0] < 0.95))
    notched[lower[::2], 1] = 0.04
    rough = loops_of(Surface(notched, surface.faces))
    segments = rough.corners(0.2, np.zeros(0, dtype=np.int64))[0]
    assert np.abs(notched[rough.tail[segments], 0] - 0.5).min() > 0.3  # none at notches, except near true corners
    assert len(rough.corners(0.03, np.zeros(0, dtype=np.int64))[0]) > 12
    smooth = loops_of(band())
    assert len(smooth.corners(0.3, np.zeros(0, dtype=np.int64))[0]) == 0
    assert smooth.tail[smooth.corners(0.3, smooth.tail[[7]])[0]].tolist() == [smooth.tail[7]]


@pytest.mark.parametrize("n_sites", [1, 2, 7, 60])
@pytest.mark.parametrize("name", OPEN)
def test_intervals_divide_the_boundary_among_the_nearest_sites(name, n_sites):
    surface = OPEN[name][0]()
    embedded = EmbeddedSurface.in_space(surface)
    sites = naive.random_sites(surface.points, surface.faces, n_sites, np.random.default_rng(n_sites))
    sharp = sharp_edges(embedded.surface, 45.0)
    features = trace_features(embedded, n_sites, sharp=sharp)
    loops = features.boundary
    intervals = boundary_intervals(features, RestrictedVoronoi(embedded).diagram(sites))
    total = np.bincount(intervals.polyline, intervals.length, minlength=loops.n_polylines)
    low, high = loops.limits.T
    np.testing.assert_allclose(total, high - low, rtol=1e-9)
    for share in (0.02, 0.3, 0.5, 0.98):
        points = loops.at(intervals.start + share * intervals.length, intervals.polyline)
        distance = np.linalg.norm(points[:, None] - sites[None], axis=2)
        own = distance[np.arange(len(points)), intervals.site]
        np.testing.assert_array_less(own, distance.min(axis=1) + 1e-9)
    cornered = np.flatnonzero(intervals.corner >= 0)
    corner = surface.points[loops.tail[features.boundary_corners]]
    np.testing.assert_array_equal(intervals.place[cornered], corner[intervals.corner[cornered]])
    owner = np.linalg.norm(corner[:, None] - sites[None], axis=2).argmin(axis=1)
    assert set(intervals.site[cornered]) == set(owner)
    assert {tuple(point) for point in intervals.crowded_corners} <= {tuple(point) for point in corner}
    assert len(cornered) + len(intervals.crowded_corners) >= len(corner)
    middle = loops.at(intervals.start + 0.5 * intervals.length, intervals.polyline)
    np.testing.assert_allclose(intervals.place[intervals.corner < 0], middle[intervals.corner < 0], atol=1e-12)


def test_fixed_sites_stay_and_the_others_descend():
    surface = halved_sphere()
    voronoi = RestrictedVoronoi(EmbeddedSurface.in_space(surface))
    sites = naive.random_sites(surface.points, surface.faces, 40, np.random.default_rng(0))
    fixed = np.arange(40) % 3 == 0
    for sharpness in (1.0, 7.0):
        energy = NormalMetric(sharpness)
        moved = minimise(voronoi, sites, energy, options=DescentOptions(max_iterations=5), fixed=fixed)
        np.testing.assert_array_equal(moved.sites[fixed], sites[fixed])
        assert np.all(np.linalg.norm(moved.sites - sites, axis=1)[~fixed] > 0.0)
        assert moved.energy < voronoi.integrate(sites, sharpness).value
    np.testing.assert_array_equal(lloyd(voronoi, sites, 2, fixed=fixed)[fixed], sites[fixed])


def test_spread_sites_are_on_the_boundary_one_for_each_long_interval():
    surface = square(24)
    embedded = EmbeddedSurface.in_space(surface)
    voronoi = RestrictedVoronoi(embedded)
    sites = naive.random_sites(surface.points, surface.faces, 100, np.random.default_rng(0))
    none = np.zeros(len(embedded.surface.edges), dtype=bool)
    features = trace_features(embedded, 100, sharp=none)
    spread = spread_on_features(features, voronoi, ConstrainedSites.free(lloyd(voronoi, sites, 5)))
    positions, on_boundary = spread.positions, spread.on_boundary
    assert not spread.on_crease.any()
    assert np.all(distance_to_boundary(positions[on_boundary], surface) < 1e-12)
    assert np.all(distance_to_boundary(positions[~on_boundary], surface) > 0.02)
    corners = np.array([[x, y, 0.0] for x in (0.0, 1.0) for y in (0.0, 1.0)])
    assert np.linalg.norm(positions[:, None] - corners[None], axis=2).min(axis=0).max() < 1e-12
    # four sides of length 1 at the spacing of a hexagonal lattice of 100 sites
    assert on_boundary.sum() == pytest.approx(4.0 / features.spacing, rel=0.2)


@cache
def remeshed(name, sharpness):
    """Return an open surface and its remesh, computed once."""
    make, n = OPEN[name]
    surface = make()
    return surface, remesh(surface, n_vertices=n, sharpness=sharpness, max_iterations=20).surface


@pytest.mark.slow
@pytest.mark.parametrize(("name", "sharpness"), [*((name, 7.0) for name in OPEN), ("wedge", 1.0), ("pierced", 1.0)])
def test_a_remesh_keeps_the_boundary(name, sharpness):
    surface, new = remeshed(name, sharpness)
    assert topology.count_nonmanifold_edges(new.faces) == 0
    assert topology.count_nonmanifold_points(new.faces) == 0
    assert topology.is_oriented(new.faces)
    assert topology.euler_characteristic(new.faces) == topology.euler_characteristic(surface.faces)
    assert len(topology.boundary_loops(new.faces)) == len(topology.boundary_loops(surface.faces))
    assert distance_to_boundary(new.points[new.on_boundary], surface).max() < 1e-9 * surface.diagonal
    ends = surface.points[surface.edges[surface.edge_face_count == 1]]
    middles = np.concatenate([ends[:, 0], ends.mean(axis=1)])
    assert distance_to_boundary(middles, new).max() < 0.5 * new.edge_lengths.mean()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["square", "strip", "two"])
def test_a_flat_square_keeps_its_corners_and_its_area(name):
    surface, new = remeshed(name, sharpness=7.0)
    assert new.area == pytest.approx(surface.area, rel=1e-9)
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    corners = np.array([[x, y, 0.0] for x in (low[0], high[0]) for y in (low[1], high[1])])
    assert np.linalg.norm(new.points[:, None] - corners[None], axis=2).min(axis=0).max() < 1e-9


@pytest.mark.parametrize("n", [12, 60])
def test_intervals_are_on_the_facets_of_features(n):
    """The diagram on these alone has the same intervals as the one on the whole surface."""
    sheet = open_patch(lambda x, y: 0.5 * np.abs(x), n=12)
    voronoi = RestrictedVoronoi(EmbeddedSurface.in_space(sheet))
    surface = voronoi.embedded.surface
    features = trace_features(voronoi.embedded, n, sharp=sharp_edges(surface, 30.0))
    sites = naive.random_sites(surface.points, surface.faces, n, np.random.default_rng(0))
    whole, part = voronoi.diagram(sites), voronoi.diagram(sites, features.facets)
    assert len(part.site) < 0.6 * len(whole.site)
    for intervals in (boundary_intervals, crease_intervals):
        wanted, found = intervals(features, whole), intervals(features, part)
        assert len(wanted.site) > 0
        np.testing.assert_array_equal(found.site, wanted.site)
        np.testing.assert_allclose(found.start, wanted.start, atol=1e-12)
        np.testing.assert_allclose(found.end, wanted.end, atol=1e-12)
        np.testing.assert_allclose(found.place, wanted.place, atol=1e-12)
