"""Vertex placement at creases and corners, and relocation of sites to missed corners."""

import numpy as np
import pytest
from creases import wedge

from anisomesh.cvt.relocation import exchange_sites
from anisomesh.delaunay.delta_complex import simplicial_mesh
from anisomesh.delaunay.dual import dual_mesh
from anisomesh.delaunay.placement import cells_with_crease, crease_positions, on_main_planes, snap_to_missed
from anisomesh.features.detect import corners, sharp_edges
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import box
from anisomesh.voronoi.cells import cells_of
from anisomesh.voronoi.restricted import RestrictedVoronoi


def _box_dual(n_sites, seed=0):
    surface = box(n=12)
    voronoi = RestrictedVoronoi(surface.points, surface.faces, threads=1)
    ordered = Surface(surface.points, voronoi.faces)
    rng = np.random.default_rng(seed)
    sites = surface.points[rng.choice(surface.n_points, n_sites, replace=False)] * 0.98 + 0.01
    diagram = voronoi.diagram(sites)
    return ordered, voronoi, diagram, cells_of(diagram, ordered.face_neighbours, voronoi.facets.area)


def test_a_sliver_beyond_a_crease_does_not_lift_the_vertex_off_its_plane():
    """Regression: between two planes at 120 degrees a vertex was off the one that nearly all of its cell lies in."""
    roof = wedge(np.radians(120.0))
    left, right = (np.array([side * np.sin(np.pi / 3.0), 0.0, -0.5]) for side in (-1.0, 1.0))
    voronoi = RestrictedVoronoi(roof.points, roof.faces, threads=1)
    surface = Surface(roof.points, voronoi.faces)
    diagram = voronoi.diagram(np.stack([0.4 * left, 0.4002 * right]))
    cells = cells_of(diagram, surface.face_neighbours, voronoi.facets.area)
    chosen = cells_with_crease(diagram, cells, surface, sharp_edges(surface, 40.0))
    assert cells.site[chosen].tolist() == [0]  # the other has nothing of the crest
    lifted = crease_positions(voronoi, diagram, cells, 1.0, chosen)
    placed = on_main_planes(diagram, cells, surface, chosen, lifted)
    normal = np.cross(left, [0.0, 1.0, 0.0])
    assert abs(lifted[0] @ normal) > 1e-9
    assert abs(placed[0] @ normal) < 1e-15
    assert np.linalg.norm(placed - lifted) < 1e-4


def test_vertices_of_creased_cells_go_to_where_their_planes_meet():
    surface, voronoi, diagram, cells = _box_dual(120)
    chosen = cells_with_crease(diagram, cells, surface, sharp_edges(surface, 45.0))
    places = crease_positions(voronoi, diagram, cells, 1.0, chosen)
    normals = np.abs(voronoi.facets.normal[diagram.facet]).round().astype(bool)
    axes = np.zeros((len(cells.site), 3), dtype=bool)
    np.logical_or.at(axes, cells.of_polygon, normals)
    assert chosen.tolist() == np.flatnonzero(axes.sum(axis=1) > 1).tolist()
    assert len(chosen) < len(cells.site)
    shares = diagram.fractions * voronoi.facets.area[diagram.facet]
    for component, place in zip(chosen, places, strict=True):
        mine = cells.of_polygon == component
        for axis in np.flatnonzero(axes[component]):
            share = shares[mine & normals[:, axis]].sum() / shares[mine].sum()
            side = np.round(diagram.points[diagram.faces[diagram.facet[mine & normals[:, axis]]]][..., axis].mean())
            # one plane pulls with s^2 - 1 times its share of the cell, the centroid with 1
            assert abs(place[axis] - side) < 1.0 / (1.0 + (100.0**2 - 1.0) * share) + 1e-9


@pytest.mark.parametrize("angle", [91.0, 180.0])
def test_no_edge_of_a_box_is_sharper_than_a_right_angle(angle):
    surface, _, diagram, cells = _box_dual(30)
    sharp = sharp_edges(surface, angle)
    assert not sharp.any()
    assert len(cells_with_crease(diagram, cells, surface, sharp)) == 0


def test_corners_of_a_box_are_its_corners():
    surface = box(n=5)
    found = surface.points[corners(surface, sharp_edges(surface, 45.0))]
    assert len(found) == 8
    np.testing.assert_array_equal(np.abs(found - 0.5), 0.5)


def test_missed_corners_are_met_after_snapping():
    surface, _, diagram, cells = _box_dual(200, seed=3)
    points, faces, done = simplicial_mesh(dual_mesh(diagram, cells, surface))
    assert done
    sharp = sharp_edges(surface, 45.0)
    ends = surface.points[corners(surface, sharp)]
    before = np.sqrt(ClosestPoints(Surface(points, faces)).squared_distances(ends))
    snapped = snap_to_missed(diagram, cells, surface, points, faces, sharp, np.ones(len(cells.site), dtype=bool))
    after = np.sqrt(ClosestPoints(Surface(snapped, faces)).squared_distances(ends))
    assert before.max() > 0.01
    assert (after < 1e-9).sum() > (before < 1e-9).sum()
    unmoved = np.setdiff1d(np.arange(len(points)), cells_with_crease(diagram, cells, surface, sharp))
    np.testing.assert_array_equal(snapped[unmoved], points[unmoved])
    total = [ClosestPoints(Surface(p, faces)).squared_distances(surface.points).sum() for p in (points, snapped)]
    assert total[1] < total[0]


def test_exchange_puts_a_site_on_a_missed_corner():
    surface = box(n=12)
    voronoi = RestrictedVoronoi(surface.points, surface.faces, threads=1)
    ordered = Surface(surface.points, voronoi.faces)
    corner = np.ones(3)
    sites = surface.points[np.linalg.norm(surface.points - corner, axis=1) > 0.25][::2]
    changed = exchange_sites(voronoi, sites, ordered, 1.0, 7.0)
    assert changed.shape == sites.shape
    assert np.linalg.norm(sites - corner, axis=1).min() > 0.25
    assert np.linalg.norm(changed - corner, axis=1).min() == 0.0
    kept = (changed[:, None] == sites[None]).all(axis=2).any(axis=1)
    assert kept.mean() >= 0.95
