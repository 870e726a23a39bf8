"""Closest points and the normals there."""

import numpy as np
import pytest
from creases import wedge

from anisomesh.mesh.closest_points import ClosestPoints, squared_distances_to
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import box


def test_pseudo_normal_on_an_edge_is_the_sum_of_both_sides():
    roof = wedge(np.radians(50))
    facet = np.flatnonzero(np.isin(roof.faces, np.arange(9, 18)).sum(axis=1) == 2)
    weights = np.where(np.isin(roof.faces[facet], np.arange(9, 18)), 0.5, 0.0)
    normals = ClosestPoints(roof).normals_at(facet, weights)
    inner = np.ptp(roof.points[roof.faces[facet]][:, :, 1], axis=1) > 0
    np.testing.assert_allclose(
        normals[inner] / np.linalg.norm(normals[inner], axis=1)[:, None],
        np.tile([0.0, 0, 1], (int(inner.sum()), 1)),
        atol=1e-9,
    )


@pytest.mark.parametrize("n", [1, 3])
def test_pseudo_normal_at_a_corner_of_a_box_does_not_depend_on_its_triangles(n):
    block = box(n=n)
    corners = np.flatnonzero((np.abs(block.points - 0.5) == 0.5).all(axis=1))
    assert len(corners) == 8
    facet, column = np.array([np.argwhere(block.faces == corner)[0] for corner in corners]).T
    normals = ClosestPoints(block).normals_at(facet, np.eye(3)[column])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    np.testing.assert_allclose(normals, (2 * block.points[corners] - 1) / np.sqrt(3), atol=1e-12)


def test_closest_points_on_flat_facets_are_found_along_the_longest_side():
    points = np.array([[0.0, 0, 0], [4, 0, 0], [1, 0, 0], [0, 5, 0]])
    surface = Surface(points, np.array([[0, 1, 2], [3, 3, 3]]))
    queries = np.array([[3.0, 0.5, 0], [0.5, 0, 1], [-2, 0, 0], [0, 5.5, 0]])
    facet, weights = ClosestPoints(surface).locate(queries)
    assert facet.tolist() == [0, 0, 0, 1]
    found = np.einsum("nc,ncx->nx", weights, points[surface.faces[facet]])
    np.testing.assert_allclose(found, [[3, 0, 0], [0.5, 0, 0], [0, 0, 0], [0, 5, 0]], atol=1e-12)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)


def test_a_triangle_on_two_sheets_that_lie_on_each_other_faces_one_of_them():
    """Regression: the facet found as closest was either, so half of the triangles of a good remesh were inverted."""
    lower = box(n=2)
    up = np.array([0.0, 0.0, 1.0])
    upper = lower.points + up
    touching = Surface(
        np.concatenate([lower.points, upper]), np.concatenate([lower.faces, lower.faces + lower.n_points])
    )
    closest = ClosestPoints(touching)
    between = np.array([[[0.1, 0.2, 1.0], [0.7, 0.3, 1.0], [0.4, 0.8, 1.0]]])
    assert not closest.inverted(between).any()
    assert not closest.inverted(between[:, ::-1]).any()
    assert closest.clearly_facing(between).all()
    outside = between + up
    assert not closest.inverted(outside).any()
    assert closest.inverted(outside[:, ::-1]).all()


@pytest.mark.parametrize("thickness", [1e-2, 1e-4, 1e-6])
def test_a_large_triangle_on_the_face_of_a_thin_plate_faces_it_clearly(thickness):
    """Regression: a hundredth of its size below it was the other face, so no vertex of a plate could be removed."""
    closest = ClosestPoints(box((1.0, 1.0, thickness), n=1))
    triangle = np.array([[0.05, 0.1, 0.0], [0.95, 0.15, 0.0], [0.4, 0.9, 0.0]])
    up = np.array([0.0, 0.0, thickness])
    assert closest.clearly_facing(np.stack([triangle + up, triangle[::-1]])).all()
    assert not closest.clearly_facing(np.stack([triangle[::-1] + up, triangle])).any()
    halfway = np.stack([triangle, triangle[::-1]]) + 0.5 * up
    assert not closest.clearly_facing(halfway).any()


@pytest.mark.parametrize("seed", range(8))
def test_no_triangle_is_inverted_against_a_fold_or_at_a_right_angle(seed):
    """Regression: the sum of opposite normals is rounding, and so is the product of normals at a right angle."""
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    fold = np.array([[0.0, 0, 0], [1, 0, 0], [0.3, 1, 0], [0.6, 1, 0]]) @ turn
    closest = ClosestPoints(Surface(fold, np.array([[0, 1, 2], [1, 0, 3]])))
    beyond = np.array([[[0.4, -0.5, -0.1], [0.6, -0.5, -0.1], [0.5, -0.5, 0.3]]]) @ turn
    flat = ClosestPoints(Surface(fold, np.array([[0, 1, 2]])))
    upright = np.array([[[0.4, 0.2, 0.1], [0.5, 0.3, 0.1], [0.5, 0.3, 0.3]]]) @ turn
    for case, triangle in ((closest, beyond), (flat, upright)):
        assert not case.inverted(triangle).any()
        assert not case.inverted(triangle[:, ::-1]).any()
        assert not case.clearly_facing(triangle).any()


def test_distance_to_triangles_is_that_of_dense_samples():
    rng = np.random.default_rng(0)
    corners, points = rng.normal(size=(40, 3, 3)), rng.normal(size=(40, 3))
    corners[:3, 2] = corners[:3, 1]  # flat ones
    u, v = (table.ravel() for table in np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 201)))
    weights = np.stack([1 - u, u * (1 - v), u * v], axis=1)
    samples = np.einsum("sc,ncx->nsx", weights, corners)
    expected = np.linalg.norm(samples - points[:, None], axis=2).min(axis=1)
    found = np.sqrt(squared_distances_to(corners, points))
    assert np.all(found <= expected + 1e-12)
    np.testing.assert_allclose(found, expected, atol=0.02)
