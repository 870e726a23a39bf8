"""Open surfaces: boundary curves, the arcs that cells cut them into, and a remesh whose boundary is the same curve."""

import igl
import naive_rvd as naive
import numpy as np
import pytest

from anisomesh.cvt.boundary import Boundary
from anisomesh.cvt.features import Features
from anisomesh.cvt.optimise import lloyd, minimise
from anisomesh.features.boundary import boundary_curves
from anisomesh.features.detect import sharp_edges
from anisomesh.mesh import topology
from anisomesh.mesh.surface import Surface
from anisomesh.pipeline import remesh
from anisomesh.shapes.analytic import open_patch, sphere
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
    """Return a square with a hole of one triangle far from the rim, and one of six."""
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


def curves_of(surface):
    return boundary_curves(surface.points, surface)


def distance_to_boundary(points, surface):
    rim = surface.edges[surface.edge_face_count == 1].astype(np.int64)
    tree = igl.AABB()
    tree.init(surface.points, rim)
    return np.sqrt(tree.squared_distance(surface.points, rim, np.ascontiguousarray(points))[0])


@pytest.mark.parametrize("name", OPEN)
def test_curves_are_the_loops_of_the_boundary(name):
    surface = OPEN[name][0]()
    curves = curves_of(surface)
    loops = topology.boundary_loops(surface.faces)
    assert curves.n_curves == len(loops)
    mine = {frozenset(curves.point[a:b].tolist()) for a, b in zip(curves.first[:-1], curves.first[1:], strict=True)}
    assert mine == {frozenset(loop.tolist()) for loop in loops}
    assert curves.start[-1] == pytest.approx(surface.edge_lengths[surface.edge_face_count == 1].sum())


def test_places_on_a_curve_go_around_it():
    curves = curves_of(square(4))
    zero = np.zeros(3, dtype=np.int64)
    corner = curves.at(np.array([0.0, 4.0, -8.0]), zero)
    np.testing.assert_allclose(corner, np.tile(corner[0], (3, 1)), atol=1e-12)
    places = np.linspace(0.0, 4.0, 37)
    points = curves.at(places, np.zeros(37, dtype=np.int64))
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).sum() == pytest.approx(4.0, abs=1e-9)
    assert np.allclose(distance_to_boundary(points, square(4)), 0.0, atol=1e-12)


def test_corners_are_where_the_curve_turns_and_not_at_small_teeth():
    surface = square(16)
    curves = curves_of(surface)
    sides, turn = curves.corners(0.2, np.zeros(0, dtype=np.int64))
    at = surface.points[curves.point[sides]]
    assert {tuple(np.round(point[:2]).astype(int)) for point in at} == {(0, 0), (0, 1), (1, 0), (1, 1)}
    np.testing.assert_allclose(np.abs(at - np.round(at)), 0.0, atol=1e-12)
    np.testing.assert_allclose(turn, 90.0)
    tooth = np.array(surface.points)
    lower = np.flatnonzero((tooth[:, 1] == 0.0) & (tooth[:, 0] > 0.05) & (tooth[:, 0] < 0.95))
    tooth[lower[::2], 1] = 0.04
    rough = curves_of(Surface(tooth, surface.faces))
    sides = rough.corners(0.2, np.zeros(0, dtype=np.int64))[0]
    assert np.abs(tooth[rough.point[sides], 0] - 0.5).min() > 0.3  # none at the teeth but next to true corners
    assert len(rough.corners(0.03, np.zeros(0, dtype=np.int64))[0]) > 12
    smooth = curves_of(band())
    assert len(smooth.corners(0.3, np.zeros(0, dtype=np.int64))[0]) == 0
    assert smooth.point[smooth.corners(0.3, smooth.point[[7]])[0]].tolist() == [smooth.point[7]]


@pytest.mark.parametrize("n_sites", [1, 2, 7, 60])
@pytest.mark.parametrize("name", OPEN)
def test_arcs_divide_the_boundary_among_the_nearest_sites(name, n_sites):
    surface = OPEN[name][0]()
    voronoi = RestrictedVoronoi(surface.points, surface.faces)
    sites = naive.random_sites(surface.points, surface.faces, n_sites, np.random.default_rng(n_sites))
    ordered = Surface(surface.points, voronoi.faces)
    boundary = Boundary(voronoi, ordered, n_sites, sharp_edges(ordered, 45.0))
    arcs = boundary.arcs(voronoi.diagram(sites))
    total = np.bincount(arcs.curve, arcs.length, minlength=boundary.curves.n_curves)
    low, high = boundary.curves.limits.T
    np.testing.assert_allclose(total, high - low, rtol=1e-9)
    for share in (0.02, 0.3, 0.5, 0.98):
        points = boundary.curves.at(arcs.start + share * arcs.length, arcs.curve)
        distance = np.linalg.norm(points[:, None] - sites[None], axis=2)
        own = distance[np.arange(len(points)), arcs.site]
        np.testing.assert_array_less(own, distance.min(axis=1) + 1e-9)
    cornered = np.flatnonzero(arcs.corner >= 0)
    corner = surface.points[boundary.curves.point[boundary.corners]]
    np.testing.assert_array_equal(arcs.place[cornered], corner[arcs.corner[cornered]])
    owner = np.linalg.norm(corner[:, None] - sites[None], axis=2).argmin(axis=1)
    assert set(arcs.site[cornered]) == set(owner)
    assert {tuple(point) for point in arcs.second} <= {tuple(point) for point in corner}
    assert len(cornered) + len(arcs.second) >= len(corner)
    middle = boundary.curves.at(arcs.start + 0.5 * arcs.length, arcs.curve)
    np.testing.assert_allclose(arcs.place[arcs.corner < 0], middle[arcs.corner < 0], atol=1e-12)


def test_fixed_sites_stay_and_the_others_descend():
    surface = halved_sphere()
    voronoi = RestrictedVoronoi(surface.points, surface.faces)
    sites = naive.random_sites(surface.points, surface.faces, 40, np.random.default_rng(0))
    fixed = np.arange(40) % 3 == 0
    for sharpness in (1.0, 7.0):
        moved = minimise(voronoi, sites, sharpness=sharpness, max_iterations=5, fixed=fixed)
        np.testing.assert_array_equal(moved.sites[fixed], sites[fixed])
        assert np.all(np.linalg.norm(moved.sites - sites, axis=1)[~fixed] > 0.0)
        assert moved.energy < voronoi.evaluate(sites, sharpness).energy
    np.testing.assert_array_equal(lloyd(voronoi, sites, 2, fixed=fixed)[fixed], sites[fixed])


def test_drawn_sites_are_on_the_boundary_one_for_each_long_arc():
    surface = square(24)
    voronoi = RestrictedVoronoi(surface.points, surface.faces)
    sites = naive.random_sites(surface.points, surface.faces, 100, np.random.default_rng(0))
    ordered = Surface(surface.points, voronoi.faces)
    none = np.zeros(len(ordered.edges), dtype=bool)
    features = Features(voronoi, ordered, 100, none, none)
    nowhere = np.zeros(100, dtype=bool)
    drawn, there, on_crease = features.spread(voronoi, lloyd(voronoi, sites, 5), nowhere, nowhere)
    assert not on_crease.any()
    assert np.all(distance_to_boundary(drawn[there], surface) < 1e-12)
    assert np.all(distance_to_boundary(drawn[~there], surface) > 0.02)
    corners = np.array([[x, y, 0.0] for x in (0.0, 1.0) for y in (0.0, 1.0)])
    assert np.linalg.norm(drawn[:, None] - corners[None], axis=2).min(axis=0).max() < 1e-12
    # four sides of 1 at the distance of a hexagonal lattice of 100 sites
    assert there.sum() == pytest.approx(4.0 / features.boundary.spacing, rel=0.2)


@pytest.mark.parametrize("sharpness", [1.0, 7.0])
@pytest.mark.parametrize("name", OPEN)
def test_a_remesh_keeps_the_boundary(name, sharpness):
    make, n = OPEN[name]
    surface = make()
    result = remesh(surface, n_vertices=n, sharpness=sharpness, max_iterations=20)
    new = result.surface
    assert topology.count_nonmanifold_edges(new.faces) == 0
    assert topology.count_nonmanifold_points(new.faces) == 0
    assert topology.is_oriented(new.faces)
    assert topology.euler_characteristic(new.faces) == topology.euler_characteristic(surface.faces)
    assert len(topology.boundary_loops(new.faces)) == len(topology.boundary_loops(surface.faces))
    assert distance_to_boundary(new.points[new.on_boundary], surface).max() < 1e-9 * surface.diagonal
    ends = surface.points[surface.edges[surface.edge_face_count == 1]]
    middles = np.concatenate([ends[:, 0], ends.mean(axis=1)])
    assert distance_to_boundary(middles, new).max() < 0.5 * new.edge_lengths.mean()


@pytest.mark.parametrize("name", ["square", "strip", "two"])
def test_a_flat_square_keeps_its_corners_and_its_area(name):
    make, n = OPEN[name]
    surface = make()
    new = remesh(surface, n_vertices=n, max_iterations=20).surface
    assert new.area == pytest.approx(surface.area, rel=1e-9)
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    corners = np.array([[x, y, 0.0] for x in (low[0], high[0]) for y in (low[1], high[1])])
    assert np.linalg.norm(new.points[:, None] - corners[None], axis=2).min(axis=0).max() < 1e-9
