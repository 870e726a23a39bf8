"""Edge flips: the mesh stays a manifold, triangles get better in the metric, creases stay."""

import numpy as np
import pytest
from delaunay_cases import assert_closed_manifold
from hypothesis import given
from hypothesis import strategies as st

from anisomesh.features.detect import sharp_edges
from anisomesh.mesh import topology
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.meshops.flip import do_flips, flip_for_shape, possible_flips
from anisomesh.metric.quality import anisotropic_quality
from anisomesh.shapes.analytic import box, cad_part, open_patch, sphere, torus
from conftest import examples

SHAPES = {"sphere": sphere(2), "torus": torus(1.0, 0.3, 24, 10), "part": cad_part(5)}


def all_edges(surface):
    return np.arange(len(surface.edges))


def jittered_plane(seed, n=8):
    """Return a flat patch with moved points: its triangles are far from the best for them."""
    surface = open_patch(lambda x, y: 0.0 * x, n=n)
    rng = np.random.default_rng(seed)
    points = surface.points + 0.3 / n * np.array([1.0, 1.0, 0.0]) * rng.uniform(-1, 1, surface.points.shape)
    return surface.with_points(points)


def identity(n):
    return np.tile(np.eye(3), (n, 1, 1))


@examples(25)
@given(st.sampled_from(sorted(SHAPES)), st.integers(0, 2**32))
def test_any_flips_in_any_order_leave_a_manifold(name, seed):
    surface = SHAPES[name]
    rng = np.random.default_rng(seed)
    faces = surface.faces
    for _ in range(4):
        flips = possible_flips(Surface(surface.points, faces), all_edges(Surface(surface.points, faces)))
        faces = do_flips(Surface(surface.points, faces), flips, rng.permutation(len(flips.pair)))
        assert_closed_manifold(faces, topology.euler_characteristic(surface.faces))
        edges, _ = topology.edges_of(faces)
        assert len(np.unique(edges, axis=0)) == len(edges)
    assert (faces != surface.faces).any()


def test_a_flip_and_its_reverse_give_the_same_triangles():
    surface = SHAPES["torus"]
    edge = np.array([7])
    there = possible_flips(surface, edge)
    flipped = Surface(surface.points, do_flips(surface, there, np.array([0])))
    new = np.flatnonzero((flipped.edges == np.sort(there.new[0])).all(axis=1))
    back = possible_flips(flipped, new)
    np.testing.assert_array_equal(np.sort(back.new[0]), np.sort(there.old[0]))
    again = do_flips(flipped, back, np.array([0]))

    def canonical(faces):
        return {tuple(np.roll(face, -np.argmin(face)).tolist()) for face in faces}

    assert canonical(again) == canonical(surface.faces)


def test_a_tetrahedron_and_a_boundary_have_no_flips():
    tetrahedron = Surface(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    assert len(possible_flips(tetrahedron, all_edges(tetrahedron)).pair) == 0
    triangle = Surface(np.eye(3), np.array([[0, 1, 2]]))
    assert len(possible_flips(triangle, all_edges(triangle)).pair) == 0


@pytest.mark.parametrize("seed", range(4))
def test_no_single_flip_is_better_than_the_result_on_a_plane(seed):
    surface = jittered_plane(seed)
    roots = identity(surface.n_points)
    faces = flip_for_shape(surface.points, surface.faces, roots, ClosestPoints(surface))
    before = anisotropic_quality(surface.points, surface.faces, roots)
    after = anisotropic_quality(surface.points, faces, roots)
    assert after.sum() > before.sum() + 0.1
    result = Surface(surface.points, faces)
    assert result.area == pytest.approx(surface.area, rel=1e-12)  # no fold, no gap
    assert topology.euler_characteristic(faces) == 1
    flips = possible_flips(result, all_edges(result))
    for pair, triangles in zip(flips.pair, flips.triangles, strict=True):
        normals = np.cross(*(surface.points[triangles[:, k]] - surface.points[triangles[:, 0]] for k in (1, 2)))
        if normals[:, 2].min() > 0.0:
            gain = anisotropic_quality(surface.points, triangles, roots).sum() - after[pair].sum()
            assert gain <= 1e-3


def test_flips_in_a_metric_match_flips_in_the_mapped_plane():
    surface = jittered_plane(5)
    root = np.diag([1.0, 3.0, 1.0])
    mapped = surface.with_points(surface.points @ root)
    stretched = flip_for_shape(
        surface.points, surface.faces, np.tile(root, (surface.n_points, 1, 1)), ClosestPoints(surface)
    )
    plain = flip_for_shape(mapped.points, mapped.faces, identity(surface.n_points), ClosestPoints(mapped))
    np.testing.assert_array_equal(stretched, plain)
    assert (stretched != surface.faces).any()


@pytest.mark.parametrize("shape", [box((1.0, 0.7, 0.2), n=4), cad_part(6)])
def test_creases_are_never_flipped(shape):
    along = np.array([1.0, 2.0, -3.0])
    stretch = np.tile(np.eye(3) + np.outer(along, along), (shape.n_points, 1, 1))
    faces = flip_for_shape(shape.points, shape.faces, stretch, ClosestPoints(shape))
    assert (faces != shape.faces).any()
    kept = {tuple(edge) for edge in topology.edges_of(faces)[0].tolist()}
    assert all(tuple(edge) in kept for edge in shape.edges[sharp_edges(shape, 31.0)].tolist())


def test_the_mesh_does_not_leave_the_surface():
    reference = ClosestPoints(torus(1.0, 0.4, 192, 96))
    coarse = torus(1.0, 0.4, 64, 32)
    spoiled = do_flips(coarse, possible_flips(coarse, all_edges(coarse)), np.arange(0, 3000, 9))
    coarse = Surface(coarse.points, spoiled)
    result = Surface(coarse.points, flip_for_shape(coarse.points, spoiled, identity(coarse.n_points), reference))

    def middles(surface):
        return reference.squared_distances(surface.points[surface.edges].mean(axis=1))

    assert (result.faces != coarse.faces).any()
    assert middles(result).mean() <= 1.05 * middles(coarse).mean()
    assert not reference.inverted(result.points[result.faces]).any()


@pytest.mark.parametrize("kept", [[], [[0, 2]], [[0, 1], [1, 2], [2, 0]]])
@pytest.mark.parametrize("height", [0.0, 1e-16, -1e-16])
def test_a_triangle_without_area_on_a_straight_boundary_is_flipped_away(height, kept):
    """Also on a crease: where its longest side was an edge to be kept it stayed."""
    points = np.array([[0.0, 0.0, 0.0], [0.5, height, 0.0], [1.0, 0.0, 0.0], [0.5, 0.8, 0.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    plane = open_patch(lambda x, y: 0.0 * x, n=4)
    kept = np.array(kept, dtype=np.int64).reshape(-1, 2)
    changed = flip_for_shape(points, faces, identity(4), ClosestPoints(plane), kept=kept)
    surface = Surface(points, changed)
    assert surface.face_areas.min() == pytest.approx(0.2)
    np.testing.assert_allclose(surface.face_normals, np.tile([0.0, 0.0, 1.0], (2, 1)), atol=1e-12)


def test_a_fan_of_triangles_without_area_is_flipped_away():
    along = np.linspace(0.0, 1.0, 6)
    points = np.concatenate([np.stack([along, 0.7 * along, 0.0 * along], axis=1), [[0.9, -0.5, 0.0]]])
    fan = [[0, k + 1, k] for k in range(1, 5)]  # collinear but for rounding
    faces = np.array([*fan, [0, 6, 5]], dtype=np.int32)
    plane = open_patch(lambda x, y: 0.0 * x, n=4)
    changed = flip_for_shape(points, faces, identity(7), ClosestPoints(plane))
    surface = Surface(points, changed)
    assert surface.face_areas.min() > 0.01
    np.testing.assert_allclose(surface.face_normals, np.tile(surface.face_normals[0], (5, 1)), atol=1e-12)
