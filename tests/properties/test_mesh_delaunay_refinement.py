"""Refinement of slivers keeps the surface, the marked edges and good triangles, and makes Delaunay edges."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sliver_shapes import comb, needle_tube

from anisomesh.errors import OptionError
from anisomesh.mesh import topology
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.geometry import corner_angles, thickness
from anisomesh.mesh.surface import Surface
from anisomesh.shapes import analytic as shapes
from anisomesh.working.delaunay_refinement import refine_slivers
from anisomesh.working.marked_surface import MarkedSurface
from anisomesh.working.surface import working_surface
from conftest import examples

ASPECT = 4.0


def refine(surface, labels=None, *, min_length=0.05, tolerance=1e-9, max_faces=50_000):
    labels = np.zeros(len(surface.edges), dtype=np.int32) if labels is None else labels
    start = MarkedSurface.unmoved(surface, labels)
    return refine_slivers(start, max_aspect=ASPECT, min_length=min_length, tolerance=tolerance, max_faces=max_faces)


def slivers(surface, min_length):
    """Return which faces are slivers longer than a length."""
    longest = surface.edge_lengths[surface.face_edges].max(axis=1)
    return (thickness(surface.points[surface.faces]) < 0.5 / ASPECT) & (longest > min_length)


def opposite_angles(surface):
    """Return the sum of the angles opposite each interior edge, in radians."""
    angles = corner_angles(surface.points[surface.faces])
    total = np.bincount(surface.face_edges.ravel(), angles.ravel(), minlength=len(surface.edges))
    return total[surface.edge_face_count == 2]


@given(teeth=st.integers(3, 60), seed=st.integers(0, 2**32 - 1))
@examples(30)
def test_a_flat_plate_of_slivers_becomes_even_and_stays_the_plate(teeth, seed):
    plate = comb(teeth, seed)
    refined = refine(plate).surface
    assert not slivers(refined, 0.05).any()
    assert refined.area == pytest.approx(plate.area, rel=1e-12)
    np.testing.assert_array_equal(refined.points[:, 2], 0.0)
    np.testing.assert_array_equal(refined.points[: plate.n_points], plate.points)
    assert (refined.face_normals[:, 2] > 0.999).all()
    assert topology.euler_characteristic(refined.faces) == 1
    assert topology.count_nonmanifold_edges(refined.faces) == topology.count_nonmanifold_points(refined.faces) == 0
    assert opposite_angles(refined).max() < np.pi + 1e-6


@pytest.mark.parametrize("tolerance", [1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("sections", [7, 64, 256])
def test_a_tube_of_needles_stays_within_the_tolerance(sections, tolerance):
    tube = needle_tube(sections)
    refined = refine(tube, tolerance=tolerance, min_length=0.2, max_faces=100_000).surface
    assert not slivers(refined, 0.2).any()
    weights = np.random.default_rng(0).dirichlet(np.ones(3), size=refined.n_faces)
    inside = np.einsum("fc,fcx->fx", weights, refined.points[refined.faces])
    for one, two in ((tube, inside), (refined, tube.points[tube.faces].mean(axis=1))):
        assert np.sqrt(ClosestPoints(one).squared_distances(two)).max() <= tolerance
    assert not ClosestPoints(tube).inverted(refined.points[refined.faces]).any()
    assert len(topology.boundary_loops(refined.faces)) == 2


def test_more_tolerance_allows_larger_triangles():
    tube = needle_tube(256)
    sizes = [refine(tube, tolerance=t, min_length=0.1, max_faces=200_000).surface.n_faces for t in (1e-6, 1e-2)]
    assert sizes[1] < 0.7 * sizes[0]


def test_marked_edges_stay_in_pieces_with_their_labels():
    part = shapes.cad_part(3)
    flat = Surface(part.points * [1.0, 1.0, 0.05], part.faces)  # the triangles of the sides become slivers
    rng = np.random.default_rng(0)
    labels = rng.integers(0, 3, len(flat.edges)).astype(np.int32)
    refined = refine(flat, labels, tolerance=0.01 * flat.diagonal, min_length=0.02)
    assert refined.surface.n_faces > flat.n_faces
    for label in (1, 2):
        kept = refined.marked.labels == label
        length = flat.edge_lengths[labels == label].sum()
        assert refined.surface.edge_lengths[kept].sum() == pytest.approx(length, rel=1e-12)
        ends = flat.points[flat.edges[labels == label]]
        way = ends[:, 1] - ends[:, 0]
        middle = refined.surface.points[refined.surface.edges[kept]].mean(axis=1)
        share = np.einsum("nex,ex->ne", middle[:, None] - ends[None, :, 0], way) / (way**2).sum(axis=1)
        foot = ends[:, 0] + np.clip(share, 0.0, 1.0)[:, :, None] * way
        assert np.linalg.norm(foot - middle[:, None], axis=2).min(axis=1).max() < 1e-12


@pytest.mark.parametrize("surface", [shapes.sphere(2), shapes.torus(24, 12), comb(5)], ids=["sphere", "torus", "comb"])
def test_values_are_interpolated_along_the_edges_that_were_split(surface):
    refined = refine(surface)
    linear = surface.points @ np.array([[1.0, 2.0], [0.5, -1.0], [3.0, 0.25]])
    expected = refined.surface.points @ np.array([[1.0, 2.0], [0.5, -1.0], [3.0, 0.25]])
    np.testing.assert_allclose(refined.interpolate(linear), expected, atol=1e-12)


def test_a_surface_without_slivers_is_returned_as_it_is():
    surface = shapes.sphere(3)
    refined = refine(surface)
    assert refined.surface is surface
    np.testing.assert_array_equal(refined.interpolate(surface.points), surface.points)


def test_triangles_far_from_slivers_stay_bit_for_bit():
    plate = comb(20)
    sphere = shapes.sphere(2)
    both = Surface(
        np.concatenate([sphere.points, plate.points + 5.0]),
        np.concatenate([sphere.faces, plate.faces + sphere.n_points]).astype(np.int32),
    )
    refined = refine(both).surface
    np.testing.assert_array_equal(refined.faces[: sphere.n_faces], sphere.faces)
    assert refined.n_faces > both.n_faces


def test_the_bound_on_the_faces_holds_and_long_sides_are_split_first():
    plate = comb(40)
    with pytest.raises(OptionError, match="max_faces is 10"):
        refine(plate, max_faces=10)
    for limit in (plate.n_faces, plate.n_faces + 1, 300):
        refined = refine(plate, max_faces=limit).surface
        assert refined.n_faces <= limit
        assert refined.area == pytest.approx(plate.area, rel=1e-12)
    everything = refine(plate).surface
    assert refined.edge_lengths.max() < plate.edge_lengths.max()
    assert everything.n_faces > 300


def test_a_working_surface_of_slivers_has_short_edges_and_the_tagged_ones():
    plate = comb(30)
    plate = plate.with_points(plate.points / plate.diagonal)
    rim = plate.edge_face_count == 1
    tagged = rim & (plate.points[plate.edges][:, :, 1] == 0.0).all(axis=1)
    working = working_surface(plate, 500, creases=np.zeros_like(rim), tagged=tagged)
    length = working.surface.edge_lengths[working.tagged].sum()
    assert length == pytest.approx(plate.edge_lengths[tagged].sum(), rel=1e-12)
    even_edge = np.sqrt(2.0 * plate.area / (np.sqrt(3.0) * 5_000))  # the metric is resolved by 5,000 vertices
    assert working.surface.edge_lengths.max() <= 2.0 * even_edge
    assert slivers(plate, 1.4 * even_edge).mean() > 0.9
    assert slivers(working.surface, 1.4 * even_edge).mean() < 0.01
    np.testing.assert_allclose(working.interpolate(plate.points), working.surface.points, atol=1e-12)
