"""Subdivision changes the triangles but not the surface."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anisomesh.errors import OptionError
from anisomesh.mesh import topology
from anisomesh.mesh.surface import Surface
from anisomesh.shapes import analytic as shapes
from anisomesh.working.subdivision import edges_within, split_long_edges
from conftest import examples

CLOSED = {
    "part": shapes.cad_part(4),
    "ring": shapes.twisted_ring(n_major=20, n_section=(2, 1)),
    "ellipsoid": shapes.ellipsoid(subdivisions=1),
    "box": shapes.box((1, 2, 0.1), n=1),
}


def volume(surface):
    a, b, c = (surface.points[surface.faces[:, k]] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


@pytest.mark.parametrize("share", [0.4, 0.07])
@pytest.mark.parametrize("name", CLOSED)
def test_closed_surface_stays_what_it_is(name, share):
    parent = CLOSED[name]
    limit = share * parent.diagonal
    refined = split_long_edges(parent, limit, max_faces=100_000)
    surface = refined.surface
    assert refined.complete
    assert surface.edge_lengths.max() <= limit
    assert surface.area == pytest.approx(parent.area, rel=1e-12)
    assert volume(surface) == pytest.approx(volume(parent), rel=1e-12)
    assert topology.euler_characteristic(surface.faces) == topology.euler_characteristic(parent.faces)
    assert topology.is_oriented(surface.faces)
    assert (surface.edge_face_count == 2).all()
    assert topology.count_nonmanifold_points(surface.faces) == 0
    np.testing.assert_array_equal(surface.points[: parent.n_points], parent.points)


@examples(60)
@given(st.integers(0, 2**32 - 1), st.floats(0.02, 1.5), st.integers(12, 600))
def test_any_soup_is_covered_by_its_children(seed, share, max_faces):
    """The children of a face lie in its plane and inside it, face the same way and have its area together."""
    rng = np.random.default_rng(seed)
    parent = Surface(rng.normal(size=(9, 3)), np.stack([rng.permutation(9)[:3] for _ in range(12)]))
    limit = share * parent.diagonal
    refined = split_long_edges(parent, limit, max_faces=max_faces)
    surface = refined.surface
    assert surface.n_faces <= max_faces
    assert refined.complete == bool((surface.edge_lengths <= limit).all())
    area = np.bincount(refined.parent_face, surface.face_areas, minlength=parent.n_faces)
    np.testing.assert_allclose(area, parent.face_areas, rtol=1e-10)
    normals = parent.face_normals[refined.parent_face]
    np.testing.assert_allclose((normals * surface.face_normals).sum(axis=1), 1, rtol=1e-9)
    assert refined.barycentric.min() >= 0
    np.testing.assert_allclose(refined.barycentric.sum(axis=1), 1, rtol=1e-14)
    np.testing.assert_allclose(refined.interpolate(parent.points), surface.points, rtol=0, atol=1e-13)
    np.testing.assert_array_equal(refined.interpolate(parent.points)[: parent.n_points], parent.points)


def test_boundary_stays_where_it_is():
    parent = shapes.open_patch(lambda x, y: x * x - y, n=3)
    refined = split_long_edges(parent, 0.1, max_faces=10_000).surface
    (before,), (after,) = topology.boundary_loops(parent.faces), topology.boundary_loops(refined.faces)
    assert set(before) <= set(after)

    def length(surface, loop):
        return np.linalg.norm(surface.points[loop] - surface.points[np.roll(loop, 1)], axis=1).sum()

    assert length(refined, after) == pytest.approx(length(parent, before), rel=1e-12)


def test_scalars_and_tensors_are_interpolated():
    parent = CLOSED["ellipsoid"]
    refined = split_long_edges(parent, 0.2, max_faces=100_000)
    linear = parent.points @ np.array([1.0, -2.0, 0.5])
    np.testing.assert_allclose(
        refined.interpolate(linear), refined.surface.points @ np.array([1.0, -2.0, 0.5]), atol=1e-13
    )
    tensors = linear[:, None, None] * np.arange(9.0).reshape(3, 3)
    np.testing.assert_allclose(refined.interpolate(tensors)[:, 1, 2], 5 * refined.interpolate(linear), atol=1e-12)


def test_short_edges_are_kept_and_the_longest_are_split_first():
    parent = CLOSED["box"]
    assert split_long_edges(parent, 10.0, max_faces=12).surface.n_faces == parent.n_faces
    limited = split_long_edges(parent, 0.05, max_faces=14)
    assert not limited.complete
    assert limited.surface.n_faces == 14
    assert (limited.surface.edge_lengths > np.sqrt(5) - 1e-9).sum() == (
        parent.edge_lengths > np.sqrt(5) - 1e-9
    ).sum() - 1


@pytest.mark.parametrize("arguments", [(0.0, 100), (-1.0, 100), (float("nan"), 100), (1.0, 11)])
def test_impossible_wishes_are_refused(arguments):
    with pytest.raises(OptionError, match="max_"):
        split_long_edges(CLOSED["box"], arguments[0], max_faces=arguments[1])


@pytest.mark.parametrize("length", [10.0, 0.4, 0.11])
def test_pieces_of_a_split_edge_are_those_that_lie_in_it(length):
    part = shapes.box((2.0, 1.0, 0.3), n=2)
    rng = np.random.default_rng(0)
    tagged = rng.random(len(part.edges)) < 0.2
    refined = split_long_edges(part, length, max_faces=100_000)
    pieces = edges_within(refined, part, tagged)
    fine = refined.surface
    a, b = (part.points[part.edges[tagged][:, k]] for k in (0, 1))
    way = b - a
    for place in (0, 1):
        ends = fine.points[fine.edges[pieces][:, place]]
        share = np.clip(np.einsum("nex,ex->ne", ends[:, None] - a, way) / (way**2).sum(axis=1), 0.0, 1.0)
        off = np.linalg.norm(a + share[:, :, None] * way - ends[:, None], axis=2)
        assert off.min(axis=1).max() < 1e-12
    assert fine.edge_lengths[pieces].sum() == pytest.approx(part.edge_lengths[tagged].sum())
