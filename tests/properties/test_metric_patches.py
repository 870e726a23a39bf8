"""Curvature per smooth patch: creases separate, flat faces have no stretch, developables have their axis."""

from collections import defaultdict

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sliver_shapes import needle_tube, thick_comb

import anisomesh
from anisomesh.features.detect import sharp_edges
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import connected_components
from anisomesh.metric.field import checked_field
from anisomesh.metric.narrow_patches import _extent, limit_to_patches
from anisomesh.metric.patches import cut_along, smooth_patches
from anisomesh.metric.sources import Approximation, Curvature
from anisomesh.metric.tensors import compute_metric
from anisomesh.metric.transfer import PlacedMetric, transfer_to_corners
from anisomesh.shapes.analytic import box, cylinder, sphere, torus
from anisomesh.shapes.cad_part import cad_part
from anisomesh.working.surface import working_surface


def at_unit_size(surface):
    return surface.with_points(unit_frame(surface.points).to_unit(surface.points))


def even(surface, n=1500):
    creases = sharp_edges(surface, 20.0)
    return working_surface(surface, n, creases=creases, tagged=np.zeros_like(creases)).surface


def fans_by_brute_force(surface, cut):
    """Return the sets of corners (face, corner) that a walk around their point connects without crossing a cut."""
    at_point = defaultdict(list)
    for face, corners in enumerate(surface.faces.tolist()):
        for corner, point in enumerate(corners):
            at_point[point].append((face, corner))
    fans = set()
    for point, corners in at_point.items():
        left = set(corners)
        while left:
            fan, todo = set(), [min(left)]
            while todo:
                face, corner = todo.pop()
                if (face, corner) in fan:
                    continue
                fan.add((face, corner))
                for other, other_corner in corners:
                    shared = set(surface.face_edges[face].tolist()) & set(surface.face_edges[other].tolist())
                    shared = [edge for edge in shared if point in surface.edges[edge] and not cut[edge]]
                    if shared:
                        todo.append((other, other_corner))
            left -= fan
            fans.add(frozenset(fan))
    return fans


@given(st.integers(0, 1000), st.sampled_from([0.05, 0.3, 0.9]))
def test_fans_of_a_cut_surface_are_those_that_a_walk_finds(seed, share):
    surface = torus(1.0, 0.4, 6, 4)
    cut = np.random.default_rng(seed).random(len(surface.edges)) < share
    patches = cut_along(surface, cut)
    np.testing.assert_array_equal(patches.source[patches.surface.faces], surface.faces)
    np.testing.assert_array_equal(patches.surface.points, surface.points[patches.source])
    found = defaultdict(set)
    for face, corners in enumerate(patches.surface.faces.tolist()):
        for corner, point in enumerate(corners):
            found[point].add((face, corner))
    assert {frozenset(fan) for fan in found.values()} == fans_by_brute_force(surface, cut)


def test_a_box_has_six_patches_and_a_smooth_surface_is_the_same_object():
    patches = smooth_patches(box(n=8), 40.0, 5)
    assert connected_components(patches.surface.faces, patches.surface.n_points)[0] == 6
    ball = sphere(3)
    assert smooth_patches(ball, 40.0, 5).surface is ball
    assert smooth_patches(box(n=8), 180.0, 5).surface.n_points == box(n=8).n_points
    field = Curvature()(ball)
    assert field.corner_tensors is None
    np.testing.assert_array_equal(field.tensors, compute_metric(ball))


@pytest.mark.parametrize("noise", [0.15, 0.3, 0.5])
def test_a_rough_scan_is_not_cut_to_pieces(noise):
    """Up to three quarters of its edges are sharp, but without forming creases."""
    ball = sphere(4)
    rough = ball.with_points(
        ball.points + noise * ball.edge_lengths.mean() * np.random.default_rng(0).normal(size=ball.points.shape)
    )
    assert sharp_edges(rough, 40.0).mean() > 0.05
    patches = smooth_patches(rough, 40.0, 5)
    assert patches.surface.n_points < 1.02 * rough.n_points


def test_tensors_of_points_are_means_over_their_corners_by_area():
    surface = at_unit_size(cylinder())
    field = checked_field(Curvature()(surface), surface)
    expected, total = np.zeros((surface.n_points, 3, 3)), np.zeros(surface.n_points)
    for face, points in enumerate(surface.faces):
        for corner, point in enumerate(points):
            expected[point] += surface.face_areas[face] * field.corner_tensors[face, corner]
            total[point] += surface.face_areas[face]
    np.testing.assert_allclose(field.tensors, expected / total[:, None, None], rtol=1e-9, atol=1e-9)


FLAT_PARTS = {
    "box": lambda: box((1.0, 2.0, 0.3), n=6),
    "cylinder": cylinder,
    "thin cylinder": lambda: cylinder(radius=0.05),
    "plate of slivers": lambda: thick_comb(60, bulge=0.2),
}


@pytest.mark.parametrize("name", FLAT_PARTS)
@pytest.mark.parametrize("source", [Curvature(), Approximation()], ids=["curvature", "approximation"])
def test_flat_faces_have_no_stretch(name, source):
    """Faces between creases that are planar: exactly a multiple of the identity, up to their rims."""
    surface = even(at_unit_size(FLAT_PARTS[name]()))
    field = source(surface)
    normals = surface.face_normals
    on_plane = np.abs(normals).max(axis=1) > 1.0 - 1e-9
    if "cylinder" in name or "plate" in name:
        on_plane = np.abs(normals[:, 2]) > 1.0 - 1e-9
    tensors = field.corner_tensors[on_plane]
    assert len(tensors) > 50
    np.testing.assert_allclose(tensors, tensors[:, :, :1, :1] * np.eye(3), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("radius", [0.4, 0.1])
def test_the_axis_of_a_capped_cylinder_is_right_up_to_its_rims(radius):
    """Within a degree, with the stretch of the closed form: cap and side do not mix."""
    surface = at_unit_size(cylinder(radius=radius, height=1.0, n_around=96, n_along=48))
    field = Curvature()(surface)
    on_side = np.abs(surface.face_normals[:, 2]) < 1e-9
    values, vectors = np.linalg.eigh(field.corner_tensors[on_side])
    axis = np.abs(vectors[..., 2] @ np.array([0.0, 0.0, 1.0]))
    assert np.degrees(np.arcsin(axis.max())) < 1.0
    diagonal = np.hypot(1.0, 2.0 * np.sqrt(2.0) * radius)
    np.testing.assert_allclose(values[..., 2], diagonal / radius, rtol=0.06)
    np.testing.assert_allclose(values[..., :2], 1.0, rtol=1e-6)


@pytest.mark.parametrize("sections", [48, 200])
def test_the_axis_of_a_needle_tube_is_right(sections):
    surface = even(at_unit_size(needle_tube(sections)), 3000)
    values, vectors = np.linalg.eigh(Curvature()(surface).tensors)
    axis = np.degrees(np.arcsin(np.abs(vectors[:, 2, 2])))
    assert np.quantile(axis, 0.99) < 1.0
    assert np.median(np.sqrt(values[:, 2])) == pytest.approx(np.sqrt(np.hypot(3.0, 2.0 * np.sqrt(2.0))), rel=0.1)


def test_corners_of_a_mesh_take_the_metric_of_their_side_of_a_crease():
    reference = at_unit_size(cylinder())
    field = Curvature()(reference)
    coarse = at_unit_size(cylinder(n_around=18, n_along=8))
    roots = transfer_to_corners(ClosestPoints(reference), field, coarse)
    flat = np.abs(coarse.face_normals[:, 2]) > 0.9
    np.testing.assert_allclose(roots[flat], np.broadcast_to(np.eye(3), roots[flat].shape), atol=1e-6)
    assert np.linalg.eigvalsh(roots[~flat])[..., 2].min() > 1.5


def test_corner_tensors_are_checked():
    surface = at_unit_size(box(n=2))
    field = anisomesh.Uniform()(surface)
    for wrong, message in (
        (np.tile(np.eye(3), (surface.n_faces, 1, 1)), "corner_tensors of the metric field has shape"),
        (np.tile(-np.eye(3), (surface.n_faces, 3, 1, 1)), r"corner_tensors\[0\] = .* not positive definite"),
    ):
        with pytest.raises(anisomesh.MetricError, match=message):
            checked_field(anisomesh.MetricField(tensors=field.tensors, corner_tensors=wrong), surface)


def test_the_embedding_takes_the_metric_of_the_corners():
    """Stretch that only the corner tensors have is in the embedding; the same tensors at points give the same."""
    surface = at_unit_size(torus(1.0, 0.4, 24, 12))
    field, plain = Curvature()(surface), anisomesh.Uniform()(surface)
    expected = anisomesh.Direct()(surface, field)
    corners = anisomesh.MetricField(tensors=field.tensors, corner_tensors=field.tensors[surface.faces])
    np.testing.assert_array_equal(anisomesh.Direct()(surface, corners).points, expected.points)
    only = anisomesh.MetricField(tensors=plain.tensors, corner_tensors=field.tensors[surface.faces])
    assert anisomesh.Direct()(surface, only).stretch.target_mean == expected.stretch.target_mean


def test_patches_turn_with_the_surface():
    surface = at_unit_size(cylinder(n_around=24, n_along=10))
    q, r = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))
    q *= np.sign(np.diag(r)) * np.sign(np.linalg.det(q * np.sign(np.diag(r))))
    turned = Curvature()(Surface(surface.points @ q.T, surface.faces)).corner_tensors
    np.testing.assert_allclose(turned, q @ Curvature()(surface).corner_tensors @ q.T, atol=1e-4)


def capped(height):
    return at_unit_size(cylinder(radius=0.5, height=height, n_around=48, n_along=max(2, round(48 * height))))


@pytest.mark.parametrize("height", [0.05, 0.3])
def test_the_extent_of_a_wall_is_its_height_along_the_axis_and_infinite_around(height):
    surface = capped(height)
    field = Curvature()(surface)
    side = np.abs(surface.face_normals[:, 2]) < 1e-9
    axis = np.broadcast_to(np.array([0.0, 0.0, 1.0]), (surface.n_faces, 3))
    along = _extent(surface, field.patch, axis)[side]
    np.testing.assert_allclose(along, np.ptp(surface.points[:, 2]), rtol=1e-9)
    around = _extent(surface, field.patch, np.cross(surface.face_normals, axis))[side]
    assert around.min() > 1e6


def test_stretch_is_limited_where_the_patch_ends_within_a_spacing_and_nowhere_else():
    surface = capped(0.05)
    field = Curvature()(surface)
    side = np.abs(surface.face_normals[:, 2]) < 1e-9
    before = np.linalg.eigvalsh(field.corner_tensors)
    largest = None
    for n in (100, 400, 1_600):
        limited = limit_to_patches(field, surface, n)
        after = np.linalg.eigvalsh(limited.corner_tensors)
        np.testing.assert_allclose(after[..., :2], before[..., :2], rtol=1e-9)
        np.testing.assert_array_equal(limited.corner_tensors[~side], field.corner_tensors[~side])
        assert (after[..., 2] <= before[..., 2] * (1.0 + 1e-9)).all()
        assert largest is None or (after[side, :, 2] >= largest * (1.0 - 1e-9)).all()
        largest = after[side, :, 2]
    assert limit_to_patches(field, surface, 10**6) is field
    spacing = np.sqrt(2.0 * surface.area / (np.sqrt(3.0) * 400))  # the stretch of the wall adds little area
    stretch = np.sqrt(before[side, :, 2]) * np.ptp(surface.points[:, 2]) / spacing
    after = np.linalg.eigvalsh(limit_to_patches(field, surface, 400).corner_tensors[side])
    np.testing.assert_allclose(np.sqrt(after[..., 2]), np.maximum(stretch, 1.0), rtol=0.1)


def test_a_metric_without_patches_is_not_limited():
    surface = at_unit_size(torus(1.0, 0.4, 24, 12))
    field = Curvature()(surface)
    assert limit_to_patches(field, surface, 10) is field


def test_roots_on_faces_of_the_surface_itself_are_the_ones_at_the_closest_points():
    part = cad_part(6)
    field, rng = Curvature()(part), np.random.default_rng(0)
    assert field.corner_tensors is not None
    metric = PlacedMetric(ClosestPoints(part), field)
    faces = rng.integers(0, part.n_faces, 500)
    weights = rng.dirichlet(np.ones(3), 500)
    places = np.einsum("nc,ncx->nx", weights, part.points[part.faces[faces]])
    wanted = metric.roots(places)
    np.testing.assert_allclose(metric.roots_on(part, faces, weights), wanted, atol=1e-9 * np.abs(wanted).max())
    other = Surface(part.points, part.faces[::-1])
    np.testing.assert_allclose(metric.roots_on(other, part.n_faces - 1 - faces, weights), wanted, atol=1e-12)
