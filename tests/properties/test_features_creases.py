"""Creases: polylines between corners, the intervals into which cells cut them, edges of the dual along them."""

import naive_rvd as naive
import numpy as np
import pytest

from anisomesh.cvt.constraints import ConstrainedSites, spread_on_features
from anisomesh.cvt.lloyd import lloyd
from anisomesh.features.creases import select_creases, trace_creases
from anisomesh.features.detect import corners, sharp_edges
from anisomesh.features.network import trace_features
from anisomesh.mesh import topology
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.mesh.surface import Surface
from anisomesh.meshops.decimation import decimate
from anisomesh.meshops.edge_recovery import recover_edges
from anisomesh.meshops.flip import flip_for_shape
from anisomesh.shapes.analytic import box, cad_part, cylinder, open_patch, sphere
from anisomesh.voronoi.intervals import crease_intervals
from anisomesh.voronoi.restricted import RestrictedVoronoi

# shape, numbers of polylines, closed polylines and corners
SHAPES = {
    "box": (box((2.0, 1.0, 0.5), n=4), 12, 0, 8),
    "cylinder": (cylinder(0.5, 1.0, 24, 6), 2, 2, 0),
    "part": (cad_part(8), 16, 4, 8),  # without its weak crease of 20 degrees
}


def creases_of(surface, angle=40.0):
    sharp = sharp_edges(surface, angle)
    return sharp, trace_creases(surface.points, surface, sharp)


def crease_case(name, n_sites, seed=0):
    """Return a diagram, random sites and the features of a shape, all creases required."""
    surface = SHAPES[name][0]
    embedded = EmbeddedSurface.in_space(surface)
    sharp = sharp_edges(embedded.surface, 40.0)
    sites = naive.random_sites(surface.points, surface.faces, n_sites, np.random.default_rng(seed))
    features = trace_features(embedded, n_sites, sharp=sharp, required=sharp)
    return RestrictedVoronoi(embedded), sites, features


@pytest.mark.parametrize("name", SHAPES)
def test_every_sharp_edge_is_on_one_polyline_and_polylines_end_at_corners(name):
    surface, n_polylines, n_closed, n_corners = SHAPES[name]
    sharp, creases = creases_of(surface)
    at_corner = corners(surface, sharp)
    assert at_corner.sum() == n_corners
    assert creases.closed.sum() == n_closed
    assert creases.n_polylines == n_polylines
    np.testing.assert_array_equal(np.sort(creases.edge), np.flatnonzero(sharp))
    ends = np.sort(np.stack([creases.tail, creases.head], axis=1), axis=1)
    np.testing.assert_array_equal(ends, surface.edges[creases.edge])
    follows = np.diff(creases.polyline) == 0
    np.testing.assert_array_equal(creases.head[:-1][follows], creases.tail[1:][follows])
    assert not at_corner[creases.tail[1:][follows]].any()
    for k in range(creases.n_polylines):
        first, last = creases.first[k], creases.first[k + 1] - 1
        if creases.closed[k]:
            assert creases.head[last] == creases.tail[first]
            assert creases.ends[k].tolist() == [-1, -1]
        else:
            assert at_corner[creases.ends[k]].all()
    assert creases.start[-1] == pytest.approx(surface.edge_lengths[sharp].sum())
    face, corner = np.nonzero(creases.segment_of_side >= 0)
    assert len(face) == len(creases.edge)
    np.testing.assert_array_equal(surface.face_edges[face, corner], creases.edge[creases.segment_of_side[face, corner]])


def test_places_beyond_an_open_polyline_are_its_ends():
    creases = creases_of(box(n=3))[1]
    k = np.zeros(3, dtype=np.int64)
    low, high = creases.limits[0]
    at = creases.at(np.array([low - 1.0, high + 1.0, 0.5 * (low + high)]), k)
    np.testing.assert_allclose(at[:2], creases.positions[creases.ends[0]])
    np.testing.assert_allclose(at[2], creases.positions[creases.ends[0]].mean(axis=0))


@pytest.mark.parametrize("n_sites", [1, 9, 80])
@pytest.mark.parametrize("name", SHAPES)
def test_intervals_divide_the_creases_among_the_nearest_sites(name, n_sites):
    voronoi, sites, features = crease_case(name, n_sites)
    surface, creases = voronoi.embedded.surface, features.creases
    intervals = crease_intervals(features, voronoi.diagram(sites))
    total = np.bincount(intervals.polyline, intervals.length, minlength=creases.n_polylines)
    low, high = creases.limits.T
    np.testing.assert_allclose(total, high - low, rtol=1e-9)
    for share in (0.02, 0.5, 0.98):
        points = creases.at(intervals.start + share * intervals.length, intervals.polyline)
        distance = np.linalg.norm(points[:, None] - sites[None], axis=2)
        np.testing.assert_array_less(distance[np.arange(len(points)), intervals.site], distance.min(axis=1) + 1e-9)
    interval, corner = intervals.corner_owners()
    np.testing.assert_array_equal(corner, np.flatnonzero(corners(surface, features.sharp)))
    owner = np.linalg.norm(surface.points[corner][:, None] - sites[None], axis=2).argmin(axis=1)
    np.testing.assert_array_equal(intervals.site[interval], owner)


def test_spread_sites_are_on_creases_and_at_corners():
    voronoi, sites, features = crease_case("box", 150)
    points = voronoi.embedded.points
    spread = spread_on_features(features, voronoi, ConstrainedSites.free(lloyd(voronoi, sites, 5)))
    assert not spread.on_boundary.any()
    low, high = points.min(axis=0), points.max(axis=0)
    on_sides = (np.minimum(np.abs(spread.positions - low), np.abs(spread.positions - high)) < 1e-12).sum(axis=1)
    np.testing.assert_array_equal(on_sides >= 2, spread.on_crease)
    assert (on_sides == 3).sum() == 8
    assert spread.on_crease.sum() == pytest.approx(14.0 / features.spacing, rel=0.2)


def test_creases_of_a_rough_scan_are_dropped_and_creases_of_a_part_kept():
    ball = sphere(4)
    rng = np.random.default_rng(0)
    rough = ball.with_points(ball.points * (1.0 + rng.normal(0.0, 0.02, (ball.n_points, 1))))
    sharp = sharp_edges(rough, 40.0)
    assert sharp.sum() > 200
    bounds = {"spacing": np.sqrt(2.0 * rough.area / (np.sqrt(3.0) * 500)), "max_length": 500.0}
    kept = select_creases(rough.points, rough, sharp, required=np.zeros_like(sharp), **bounds)
    assert len(kept.edge) < 0.5 * sharp.sum()
    everything = select_creases(rough.points, rough, sharp, required=sharp, **bounds)
    assert set(everything.edge) == set(np.flatnonzero(sharp))
    part = cad_part(8)
    sharp, creases = creases_of(part)
    spacing = np.sqrt(2.0 * part.area / (np.sqrt(3.0) * 300))
    some, fewer = (
        select_creases(part.points, part, sharp, required=np.zeros_like(sharp), spacing=spacing, max_length=length)
        for length in (360.0, 10.0)
    )
    assert len(some.edge) == sharp.sum()
    assert fewer.n_polylines < creases.n_polylines


def grid(n=6):
    return open_patch(lambda x, y: 0.0 * x, n=n, half_width=n / 2)


def at(surface, x, y):
    return int(np.argmin(np.linalg.norm(surface.points - [x, y, 0.0], axis=1)))


@pytest.mark.parametrize("turns", range(4))
def test_flips_recover_an_edge_across_cells_that_interrupt_a_crease(turns):
    surface = grid()
    angle = 0.5 * np.pi * turns + 0.1
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    path = [at(surface, -1, -1), at(surface, 0, 0), at(surface, 1, 0)]
    points = surface.points.copy()
    points[path[1], 1] += 0.3  # the middle point is off the line from end to end
    points = points @ turn.T
    reference = ClosestPoints(surface.with_points(points))
    faces = recover_edges(points, surface.faces, [path], reference)
    after = Surface(points, faces)
    assert topology.edge_keys(np.array([[path[0], path[2]]]))[0] in topology.edge_keys(after.edges)
    assert len(faces) == surface.n_faces
    assert topology.is_oriented(faces)
    assert (after.face_normals[:, 2] > 0.99).all()
    assert after.area == pytest.approx(surface.with_points(points).area)


def test_triangles_stay_where_an_edge_cannot_be_recovered():
    surface = grid()
    path = [at(surface, -1, 0), at(surface, 0, 0), at(surface, 1, 0)]  # in line: one of the triangles would be flat
    faces = recover_edges(surface.points, surface.faces, [path], ClosestPoints(surface))
    as_sets = [{frozenset(face) for face in table.tolist()} for table in (surface.faces, faces)]
    assert as_sets[0] == as_sets[1]


def test_collapses_and_flips_keep_required_edges_in_place():
    surface = grid(8)
    line = [at(surface, x, x) for x in range(-4, 5)]  # a diagonal, flat all around
    links = np.stack([line[:-1], line[1:]], axis=1)
    keys = topology.edge_keys(links)
    assert np.isin(keys, topology.edge_keys(surface.edges)).all()
    reference = ClosestPoints(surface)
    decimated = decimate(surface, 30, crease_edges=links)
    after, left = decimated.surface, decimated.crease_edges
    points, faces = after.points, after.faces
    assert len(points) == 30
    assert np.isin(topology.edge_keys(left), topology.edge_keys(after.edges)).all()
    ends = points[left]
    assert np.abs(ends[:, :, 0] - ends[:, :, 1]).max() < 1e-12
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum() == pytest.approx(8 * np.sqrt(2.0))
    stretch = np.tile(np.diag([1.0, 8.0, 1.0]), (len(points), 1, 1))
    flipped = Surface(points, flip_for_shape(points, faces, stretch, reference, kept=left))
    assert np.isin(topology.edge_keys(left), topology.edge_keys(flipped.edges)).all()
    free = Surface(points, flip_for_shape(points, faces, stretch, reference))
    assert not np.isin(topology.edge_keys(left), topology.edge_keys(free.edges)).all()
