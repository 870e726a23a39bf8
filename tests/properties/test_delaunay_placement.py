"""Vertex placement at creases and corners, and relocation of sites to missed corners."""

import numpy as np
import pytest
from creases import wedge

import anisomesh
from anisomesh.cvt.constraints import ConstrainedSites
from anisomesh.cvt.energy import NormalMetric
from anisomesh.cvt.relocation import relocate_to_missed_points
from anisomesh.delaunay.delta_complex import simplicial_mesh
from anisomesh.delaunay.dual import dual_mesh, dual_squared_errors
from anisomesh.delaunay.placement import (
    cells_with_crease,
    plane_intersections,
    project_to_main_planes,
    snap_to_missed_corners,
)
from anisomesh.features.detect import apexes, corners, sharp_edges
from anisomesh.features.network import trace_features
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import box, sphere, torus
from anisomesh.voronoi.cells import cell_complex
from anisomesh.voronoi.restricted import RestrictedVoronoi


def cells_of_sites(surface, sites):
    return cell_complex(RestrictedVoronoi(EmbeddedSurface.in_space(surface), threads=1).diagram(sites))


def box_cells(n_sites, seed=0):
    surface = box(n=12)
    rng = np.random.default_rng(seed)
    sites = surface.points[rng.choice(surface.n_points, n_sites, replace=False)] * 0.98 + 0.01
    return cells_of_sites(surface, sites)


def test_a_sliver_beyond_a_crease_does_not_lift_the_vertex_off_its_plane():
    """Regression: between two planes at 120 degrees a vertex was off the plane with nearly all of its cell."""
    roof = wedge(np.radians(120.0))
    left, right = (np.array([side * np.sin(np.pi / 3.0), 0.0, -0.5]) for side in (-1.0, 1.0))
    cells = cells_of_sites(roof, np.stack([0.4 * left, 0.4002 * right]))
    chosen = cells_with_crease(cells, sharp_edges(cells.embedded.surface, 40.0))
    assert cells.site[chosen].tolist() == [0]  # the other has nothing of the crest
    lifted = plane_intersections(cells, chosen)
    placed = project_to_main_planes(cells, chosen, lifted)
    normal = np.cross(left, [0.0, 1.0, 0.0])
    assert abs(lifted[0] @ normal) > 1e-9
    assert abs(placed[0] @ normal) < 1e-15
    assert np.linalg.norm(placed - lifted) < 1e-4


def test_vertices_of_cells_with_a_crease_go_to_where_their_planes_meet():
    cells = box_cells(120)
    diagram, embedded = cells.diagram, cells.embedded
    chosen = cells_with_crease(cells, sharp_edges(embedded.surface, 45.0))
    places = plane_intersections(cells, chosen)
    normals = np.abs(embedded.facets.normal[diagram.facet]).round().astype(bool)
    axes = np.zeros((cells.n_components, 3), dtype=bool)
    np.logical_or.at(axes, cells.of_polygon, normals)
    assert chosen.tolist() == np.flatnonzero(axes.sum(axis=1) > 1).tolist()
    assert len(chosen) < cells.n_components
    shares = diagram.fractions * embedded.face_areas[diagram.facet]
    for component, place in zip(chosen, places, strict=True):
        mine = cells.of_polygon == component
        for axis in np.flatnonzero(axes[component]):
            share = shares[mine & normals[:, axis]].sum() / shares[mine].sum()
            side = np.round(diagram.points[diagram.faces[diagram.facet[mine & normals[:, axis]]]][..., axis].mean())
            # one plane pulls with s^2 - 1 times its share of the cell, the centroid with 1
            assert abs(place[axis] - side) < 1.0 / (1.0 + (100.0**2 - 1.0) * share) + 1e-9


@pytest.mark.parametrize("angle", [91.0, 180.0])
def test_no_edge_of_a_box_is_sharper_than_a_right_angle(angle):
    cells = box_cells(30)
    sharp = sharp_edges(cells.embedded.surface, angle)
    assert not sharp.any()
    assert len(cells_with_crease(cells, sharp)) == 0


def test_corners_of_a_box_are_its_corners():
    surface = box(n=5)
    found = surface.points[corners(surface, sharp_edges(surface, 45.0))]
    assert len(found) == 8
    np.testing.assert_array_equal(np.abs(found - 0.5), 0.5)


def test_snapping_moves_vertices_onto_missed_corners():
    cells = box_cells(200, seed=3)
    surface = cells.embedded.surface
    points, faces, done = simplicial_mesh(dual_mesh(cells))
    assert done
    sharp = sharp_edges(surface, 45.0)
    ends = surface.points[corners(surface, sharp)]
    before = np.sqrt(ClosestPoints(Surface(points, faces)).squared_distances(ends))
    features = trace_features(cells.embedded, 200, sharp=sharp)
    snapped = snap_to_missed_corners(cells, points, faces, features, np.ones(cells.n_components, dtype=bool))
    after = np.sqrt(ClosestPoints(Surface(snapped, faces)).squared_distances(ends))
    assert before.max() > 0.01
    assert (after < 1e-9).sum() > (before < 1e-9).sum()
    unmoved = np.setdiff1d(np.arange(len(points)), cells_with_crease(cells, sharp))
    np.testing.assert_array_equal(snapped[unmoved], points[unmoved])
    total = [ClosestPoints(Surface(p, faces)).squared_distances(surface.points).sum() for p in (points, snapped)]
    assert total[1] < total[0]


def test_relocation_puts_a_site_on_a_missed_corner():
    surface = box(n=12)
    voronoi = RestrictedVoronoi(EmbeddedSurface.in_space(surface), threads=1)
    corner = np.ones(3)
    sites = surface.points[np.linalg.norm(surface.points - corner, axis=1) > 0.25][::2]
    errors = dual_squared_errors(voronoi.diagram(sites))
    changed = relocate_to_missed_points(voronoi, ConstrainedSites.free(sites), NormalMetric(7.0), errors).positions
    assert changed.shape == sites.shape
    assert np.linalg.norm(sites - corner, axis=1).min() > 0.25
    assert np.linalg.norm(changed - corner, axis=1).min() == 0.0
    kept = (changed[:, None] == sites[None]).all(axis=2).any(axis=1)
    assert kept.mean() >= 0.95


def cone(sections, height):
    angle = 2.0 * np.pi * np.arange(sections) / sections
    rim = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    k, after = np.arange(sections), np.roll(np.arange(sections), -1)
    centre, apex = np.full(sections, sections), np.full(sections, sections + 1)
    faces = np.concatenate([np.stack([after, k, centre], axis=1), np.stack([k, after, apex], axis=1)])
    return Surface(np.concatenate([rim, [[0.0, 0.0, 0.0], [0.0, 0.0, height]]]), faces.astype(np.int32))


@pytest.mark.parametrize("sections", [16, 20, 64, 512])
@pytest.mark.parametrize("height", [0.4, 2.0, 8.0])
def test_the_apex_of_a_cone_is_found(sections, height):
    surface = cone(sections, height)
    defect = 360.0 * (1.0 - 1.0 / np.sqrt(1.0 + height**2))
    found = np.flatnonzero(apexes(surface, sharp_edges(surface, 40.0)))
    assert found.tolist() == ([sections + 1] if defect > 20.5 else [])


@pytest.mark.parametrize(("sections", "height"), [(16, 0.4), (20, 2.0), (64, 8.0), (512, 0.4), (512, 8.0)])
def test_the_apex_of_a_cone_is_a_vertex(sections, height):
    """Regression: the apex was cut off by .2 to .9 % of the diagonal."""
    surface = cone(sections, height)
    result = anisomesh.remesh(surface, n_vertices=100, embedding="direct", max_iterations=30)
    distance = np.linalg.norm(result.surface.points - surface.points[-1], axis=1).min()
    assert distance < 1e-12


@pytest.mark.parametrize("surface", [sphere(), torus(1.0, 0.4, 40, 20), box(), sphere(subdivisions=0)])
def test_smooth_rough_and_angular_surfaces_have_no_apex(surface):
    rough = surface.with_points(surface.points + 0.01 * np.random.default_rng(0).normal(size=surface.points.shape))
    for case in (surface, rough):
        assert not apexes(case, sharp_edges(case, 40.0)).any()
