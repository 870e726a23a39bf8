"""Creases: as curves between corners, the arcs that cells cut them into, edges of the dual along them."""

import naive_rvd as naive
import numpy as np
import pytest
from anisomesh.cvt.creases import Creases, resolved

from anisomesh.cvt.features import Features
from anisomesh.cvt.optimise import lloyd
from anisomesh.delaunay.creases import join_along_creases
from anisomesh.features.creases import crease_curves
from anisomesh.features.detect import corners, sharp_edges
from anisomesh.mesh import topology
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.meshops.collapse import decimate
from anisomesh.meshops.flip import flip_for_shape
from anisomesh.shapes.analytic import box, cad_part, cylinder, open_patch, sphere
from anisomesh.voronoi.restricted import RestrictedVoronoi

# shape, number of curves, of closed ones, of corners
SHAPES = {
    "box": (box((2.0, 1.0, 0.5), n=4), 12, 0, 8),
    "cylinder": (cylinder(0.5, 1.0, 24, 6), 2, 2, 0),
    "part": (cad_part(8), 16, 4, 8),  # but for its weak crease of 20 degrees
}


def creases_of(surface, angle=40.0):
    sharp = sharp_edges(surface, angle)
    return sharp, crease_curves(surface.points, surface, sharp, corners(surface, sharp))


def crease_case(name, n_sites, seed=0):
    surface = SHAPES[name][0]
    voronoi = RestrictedVoronoi(surface.points, surface.faces)
    ordered = Surface(surface.points, voronoi.faces)
    sharp = sharp_edges(ordered, 40.0)
    sites = naive.random_sites(surface.points, surface.faces, n_sites, np.random.default_rng(seed))
    return voronoi, ordered, sites, sharp


@pytest.mark.parametrize("name", SHAPES)
def test_every_sharp_edge_is_on_one_curve_and_curves_end_at_corners(name):
    surface, n_curves, n_closed, n_corners = SHAPES[name]
    sharp, curves = creases_of(surface)
    at_corner = corners(surface, sharp)
    assert at_corner.sum() == n_corners
    assert curves.closed.sum() == n_closed
    assert curves.n_curves == n_curves
    np.testing.assert_array_equal(np.sort(curves.edge), np.flatnonzero(sharp))
    ends = np.sort(np.stack([curves.point, curves.head], axis=1), axis=1)
    np.testing.assert_array_equal(ends, surface.edges[curves.edge])
    follows = np.diff(curves.curve) == 0
    np.testing.assert_array_equal(curves.head[:-1][follows], curves.point[1:][follows])
    assert not at_corner[curves.point[1:][follows]].any()
    for k in range(curves.n_curves):
        first, last = curves.first[k], curves.first[k + 1] - 1
        if curves.closed[k]:
            assert curves.head[last] == curves.point[first]
            assert curves.ends[k].tolist() == [-1, -1]
        else:
            assert at_corner[curves.ends[k]].all()
    assert curves.start[-1] == pytest.approx(surface.edge_lengths[sharp].sum())
    face, corner = np.nonzero(curves.rank >= 0)
    assert len(face) == len(curves.edge)
    np.testing.assert_array_equal(surface.face_edges[face, corner], curves.edge[curves.rank[face, corner]])


def test_places_on_an_open_curve_end_at_its_ends():
    curves = creases_of(box(n=3))[1]
    k = np.zeros(3, dtype=np.int64)
    low, high = curves.limits[0]
    at = curves.at(np.array([low - 1.0, high + 1.0, 0.5 * (low + high)]), k)
    np.testing.assert_allclose(at[:2], curves.positions[curves.ends[0]])
    np.testing.assert_allclose(at[2], curves.positions[curves.ends[0]].mean(axis=0))


@pytest.mark.parametrize("n_sites", [1, 9, 80])
@pytest.mark.parametrize("name", SHAPES)
def test_arcs_divide_the_creases_among_the_nearest_sites(name, n_sites):
    voronoi, ordered, sites, sharp = crease_case(name, n_sites)
    creases = Creases(voronoi, ordered, n_sites, sharp, sharp)
    arcs = creases.arcs(voronoi.diagram(sites))
    total = np.bincount(arcs.curve, arcs.length, minlength=creases.curves.n_curves)
    low, high = creases.curves.limits.T
    np.testing.assert_allclose(total, high - low, rtol=1e-9)
    for share in (0.02, 0.5, 0.98):
        points = creases.curves.at(arcs.start + share * arcs.length, arcs.curve)
        distance = np.linalg.norm(points[:, None] - sites[None], axis=2)
        np.testing.assert_array_less(distance[np.arange(len(points)), arcs.site], distance.min(axis=1) + 1e-9)
    arc, corner = arcs.owners()
    np.testing.assert_array_equal(corner, np.flatnonzero(corners(ordered, sharp)))
    owner = np.linalg.norm(ordered.points[corner][:, None] - sites[None], axis=2).argmin(axis=1)
    np.testing.assert_array_equal(arcs.site[arc], owner)


def test_drawn_sites_are_on_creases_and_at_corners():
    voronoi, ordered, sites, sharp = crease_case("box", 150)
    nowhere = np.zeros(150, dtype=bool)
    features = Features(voronoi, ordered, 150, sharp, sharp)
    drawn, on_boundary, on_crease = features.spread(voronoi, lloyd(voronoi, sites, 5), nowhere, nowhere)
    assert not on_boundary.any()
    low, high = ordered.points.min(axis=0), ordered.points.max(axis=0)
    on_sides = (np.minimum(np.abs(drawn - low), np.abs(drawn - high)) < 1e-12).sum(axis=1)
    np.testing.assert_array_equal(on_sides >= 2, on_crease)
    assert (on_sides == 3).sum() == 8
    assert on_crease.sum() == pytest.approx(14.0 / features.creases.spacing, rel=0.2)


def test_the_roughness_of_a_scan_is_no_crease_and_a_part_is():
    ball = sphere(4)
    rng = np.random.default_rng(0)
    rough = ball.with_points(ball.points * (1.0 + rng.normal(0.0, 0.02, (ball.n_points, 1))))
    sharp = sharp_edges(rough, 40.0)
    assert sharp.sum() > 200
    never = np.zeros(len(sharp), dtype=bool)
    spacing = np.sqrt(2.0 * rough.area / (np.sqrt(3.0) * 500))
    kept = resolved(rough.points, rough, sharp, never, spacing, 500.0)
    assert len(kept.edge) < 0.5 * sharp.sum()
    assert set(resolved(rough.points, rough, sharp, sharp, spacing, 500.0).edge) == set(np.flatnonzero(sharp))
    part = cad_part(8)
    sharp, curves = creases_of(part)
    spacing = np.sqrt(2.0 * part.area / (np.sqrt(3.0) * 300))
    never = np.zeros(len(sharp), dtype=bool)
    assert len(resolved(part.points, part, sharp, never, spacing, 360.0).edge) == sharp.sum()
    assert resolved(part.points, part, sharp, never, spacing, 10.0).n_curves < curves.n_curves


def grid(n=6):
    return open_patch(lambda x, y: 0.0 * x, n=n, half_width=n / 2)


def at(surface, x, y):
    return int(np.argmin(np.linalg.norm(surface.points - [x, y, 0.0], axis=1)))


@pytest.mark.parametrize("turns", range(4))
def test_flips_give_an_edge_across_cells_that_interrupt_a_crease(turns):
    surface = grid()
    angle = 0.5 * np.pi * turns + 0.1
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    path = [at(surface, -1, -1), at(surface, 0, 0), at(surface, 1, 0)]
    points = surface.points.copy()
    points[path[1], 1] += 0.3  # the point between is off the line from end to end
    points = points @ turn.T
    reference = ClosestPoints(surface.with_points(points))
    faces = join_along_creases(points, surface.faces, [path], reference)
    after = Surface(points, faces)
    assert topology.edge_keys(np.array([[path[0], path[2]]]))[0] in topology.edge_keys(after.edges)
    assert len(faces) == surface.n_faces
    assert topology.is_oriented(faces)
    assert (after.face_normals[:, 2] > 0.99).all()
    assert after.area == pytest.approx(surface.with_points(points).area)


def test_triangles_stay_where_a_crease_cannot_be_joined():
    surface = grid()
    path = [at(surface, -1, 0), at(surface, 0, 0), at(surface, 1, 0)]  # in line: one of the triangles would be flat
    faces = join_along_creases(surface.points, surface.faces, [path], ClosestPoints(surface))
    as_sets = [{frozenset(face) for face in table.tolist()} for table in (surface.faces, faces)]
    assert as_sets[0] == as_sets[1]


def test_collapses_and_flips_leave_named_edges_where_they_are():
    surface = grid(8)
    line = [at(surface, x, x) for x in range(-4, 5)]  # a diagonal, flat all around
    links = np.stack([line[:-1], line[1:]], axis=1)
    keys = topology.edge_keys(links)
    assert np.isin(keys, topology.edge_keys(surface.edges)).all()
    reference = ClosestPoints(surface)
    points, faces, left = decimate(surface.points, surface.faces, 30, reference, creases=links)
    assert len(points) <= 32
    after = Surface(points, faces)
    assert np.isin(topology.edge_keys(left), topology.edge_keys(after.edges)).all()
    ends = points[left]
    assert np.abs(ends[:, :, 0] - ends[:, :, 1]).max() < 1e-12
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum() == pytest.approx(8 * np.sqrt(2.0))
    stretch = np.tile(np.diag([1.0, 8.0, 1.0]), (len(points), 1, 1))
    flipped = Surface(points, flip_for_shape(points, faces, stretch, reference, kept=left))
    assert np.isin(topology.edge_keys(left), topology.edge_keys(flipped.edges)).all()
    free = Surface(points, flip_for_shape(points, faces, stretch, reference))
    assert not np.isin(topology.edge_keys(left), topology.edge_keys(free.edges)).all()
