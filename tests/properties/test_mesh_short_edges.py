"""Collapses of short edges keep topology, creases, corners and boundaries, and stay within the tolerance."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sliver_shapes import comb, needle_tube, thick_comb

from anisomesh._kernels.vectors import square_to_triangle
from anisomesh.features.detect import sharp_edges
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import check_validity
from anisomesh.shapes import analytic as shapes
from anisomesh.working.marked_surface import MarkedSurface
from anisomesh.working.short_edges import collapse_short_edges
from anisomesh.working.surface import working_surface
from conftest import examples


def open_patch(n, height=0.1):
    points = shapes.box(n=n).points
    x, y = (table.ravel() for table in np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij"))
    points = np.stack([x, y, height * np.sin(3.0 * x) * np.cos(2.0 * y)], axis=1)
    k = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.stack([k, k + n, k + n + 1], axis=1), np.stack([k, k + n + 1, k + 1], axis=1)])
    return Surface(points, faces.astype(np.int32))


SHAPES = {
    "sphere": shapes.sphere(4),
    "torus": shapes.torus(1.0, 0.4, 60, 30),
    "open patch": open_patch(30),
    "box": shapes.box(n=12),
    "tube": needle_tube(200),
    "plate": comb(60),
    "thick plate": thick_comb(40, bulge=0.1),
}


def coarsen(surface, max_length, tolerance, labels=None, n_kept=0):
    if labels is None:
        labels = sharp_edges(surface, 30.0).astype(np.int32)
    start = MarkedSurface.unmoved(surface, labels)
    return collapse_short_edges(start, max_length=max_length, tolerance=tolerance, n_kept=n_kept)


def samples(surface, rng, n=3_000):
    face = rng.choice(surface.n_faces, n, p=surface.face_areas / surface.area)
    return np.einsum("nc,ncx->nx", rng.dirichlet([1.0, 1.0, 1.0], n), surface.points[surface.faces[face]])


@pytest.mark.parametrize("name", SHAPES)
@given(
    seed=st.integers(0, 2**32 - 1),
    noise=st.sampled_from([0.0, 0.0, 0.05, 0.3]),
    length=st.floats(0.02, 0.6),
    tolerance=st.sampled_from([1e-9, 1e-3, 1e-2]),
)
@examples(12)
def test_the_coarser_surface_is_valid_and_within_the_tolerance(name, seed, noise, length, tolerance):
    surface, rng = SHAPES[name], np.random.default_rng(seed)
    moved = surface.points + noise * surface.edge_lengths.min() * rng.normal(size=surface.points.shape)
    surface = Surface(moved[np.argsort(order := rng.permutation(surface.n_points))], order[surface.faces])
    coarse = coarsen(surface, length, tolerance)
    np.testing.assert_array_equal(coarse.surface.points, surface.points[coarse.kept])
    validity = check_validity(coarse.surface, surface)
    assert validity.euler == validity.euler_input
    assert validity.boundary_loops == validity.boundary_loops_input
    assert validity.components == validity.components_input
    assert validity.oriented
    assert validity.nonmanifold_edges == validity.nonmanifold_vertices == validity.duplicate_faces == 0
    assert validity.flat == 0
    assert validity.inverted == 0 or validity.self_intersections_input > 0
    assert coarse.marked.deviation.max() <= tolerance
    for one, other in ((surface, coarse.surface), (coarse.surface, surface)):
        assert np.sqrt(ClosestPoints(one).squared_distances(samples(other, rng)).max()) <= 1.5 * tolerance + 1e-12


@pytest.mark.parametrize("n", [6, 20])
def test_a_box_keeps_its_corners_and_edges_and_little_else(n):
    box = shapes.box((1.0, 2.0, 3.0), n=n)
    labels = sharp_edges(box, 30.0).astype(np.int32)
    coarse = coarsen(box, 10.0, 1e-9, labels)
    assert coarse.surface.n_points < 40
    assert coarse.surface.area == pytest.approx(box.area, rel=1e-12)
    corners = {(x, y, z) for x in (0.0, 1.0) for y in (0.0, 2.0) for z in (0.0, 3.0)}
    assert corners <= {tuple(point) for point in coarse.surface.points.tolist()}
    length = coarse.surface.edge_lengths[coarse.marked.labels == 1].sum()
    assert length == pytest.approx(24.0, rel=1e-12)
    np.testing.assert_array_equal(coarse.marked.labels == 1, sharp_edges(coarse.surface, 30.0))


def test_marked_edges_on_a_flat_plate_stay_where_they_are():
    plate = open_patch(21, height=0.0)
    labels = np.zeros(len(plate.edges), dtype=np.int32)
    ends = plate.points[plate.edges]
    line = np.isclose(ends[:, :, 0], 0.5).all(axis=1)
    labels[line] = 1
    labels[line & (ends[:, :, 1].max(axis=1) > 0.61)] = 2  # the label changes at (.5, .6)
    coarse = coarsen(plate, 10.0, 1e-9, labels)
    assert coarse.surface.n_points < 40
    for label, length in ((1, 0.6), (2, 0.4)):
        kept = coarse.surface.points[coarse.surface.edges[coarse.marked.labels == label]]
        np.testing.assert_allclose(kept[:, :, 0], 0.5)
        assert np.linalg.norm(kept[:, 0] - kept[:, 1], axis=1).sum() == pytest.approx(length, rel=1e-12)
    np.testing.assert_allclose(
        np.ptp(coarse.surface.points[coarse.surface.edges[coarse.surface.edge_face_count == 1]], axis=(0, 1)), [1, 1, 0]
    )


def test_long_edges_and_the_first_points_stay():
    sphere = shapes.sphere(3)
    assert coarsen(sphere, 0.3 * sphere.edge_lengths.min(), 1.0).surface is sphere
    assert coarsen(sphere, 10.0, 0.0).surface is sphere
    n = sphere.n_points // 2
    coarse = coarsen(sphere, 1.0, 0.1, n_kept=n)
    np.testing.assert_array_equal(coarse.kept[:n], np.arange(n))
    assert len(coarse.kept) < sphere.n_points


def test_only_slivers_lose_longer_edges():
    tube, sphere = needle_tube(400), shapes.sphere(3)
    for surface, fewer in ((tube, True), (sphere, False)):
        coarse = coarsen(surface, 0.8 * surface.edge_lengths.min(), 0.1)
        assert (coarse.surface.n_points < surface.n_points) == fewer


def test_squared_distances_to_a_triangle_are_the_smallest_ones_of_dense_samples():
    rng = np.random.default_rng(0)
    u, v = (table.ravel() for table in np.meshgrid(np.linspace(0, 1, 301), np.linspace(0, 1, 301)))
    weights = np.stack([1 - u, u * (1 - v), u * v], axis=1)
    for _ in range(60):
        corners, point = rng.normal(size=(3, 3)), rng.normal(size=3)
        dense = np.linalg.norm(weights @ corners - point, axis=1).min()
        found = np.sqrt(square_to_triangle(tuple(point), *(tuple(corner) for corner in corners)))
        assert dense - 0.02 < found <= dense + 1e-12


@pytest.mark.parametrize(("sections", "n", "most"), [(128, 100, 12_000), (720, 100, 12_000), (720, 500, 25_000)])
def test_a_tube_of_needles_has_a_working_surface_of_few_faces(sections, n, most):
    """Regression: 30,000 to 60,000 faces, most of them within the strips, made each step of the optimisation slow."""
    tube = needle_tube(sections)
    tube = tube.with_points(tube.points / tube.diagonal)
    none = np.zeros(len(tube.edges), dtype=bool)
    working = working_surface(tube, n, creases=none, tagged=none)
    assert working.surface.n_faces < most
    spacing = np.sqrt(2.0 * tube.area / (np.sqrt(3.0) * n))
    for one, other in ((tube, working.surface), (working.surface, tube)):
        assert np.sqrt(ClosestPoints(one).squared_distances(other.points).max()) < 0.1 * spacing**2
    np.testing.assert_allclose(working.interpolate(tube.points), working.surface.points, atol=1e-12)
