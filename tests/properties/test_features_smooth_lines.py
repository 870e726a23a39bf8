"""Jagged lines on smooth surfaces are straightened along the surface."""

import numpy as np

from anisomesh.features.detect import corners
from anisomesh.features.smooth_lines import with_smooth_lines
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.topology import edges_of
from anisomesh.shapes.analytic import sphere

BALL = sphere(4)


def border(surface, labels):
    first, second = surface.edge_faces.T
    return labels[first] != labels[second]


def test_a_zigzag_becomes_smooth_and_stays_on_the_surface():
    labels = BALL.points[BALL.faces].mean(axis=1)[:, 2] > 0.5
    lines = border(BALL, labels)
    none = np.zeros(BALL.n_points, dtype=bool)
    result, (marked,) = with_smooth_lines(BALL, lines, (), none)
    assert corners(BALL, lines).sum() > 20
    assert corners(result, marked).sum() == 0
    assert marked.sum() == lines.sum()
    np.testing.assert_array_equal(np.sort(result.edges[marked], axis=0), np.sort(BALL.edges[lines], axis=0))
    assert ClosestPoints(BALL).squared_distances(result.points).max() < 1e-20
    assert abs(result.edge_lengths[marked].sum() - 2.0 * np.pi * np.sqrt(0.75)) < 0.02 * 2.0 * np.pi
    moved = (result.points != BALL.points).any(axis=1)
    assert set(np.flatnonzero(moved)) <= set(BALL.edges[lines].ravel())
    assert (result.face_normals * result.points[result.faces].mean(axis=1)).sum(axis=1).min() > 0.9


def test_the_enclosed_area_stays():
    labels = BALL.points[BALL.faces].mean(axis=1) @ [0.6, 0.0, 0.8] > 0.3
    lines = border(BALL, labels)
    result, (marked,) = with_smooth_lines(BALL, lines, (), np.zeros(BALL.n_points, dtype=bool))
    places = result.points[np.unique(result.edges[marked])]
    height = (places / np.linalg.norm(places, axis=1, keepdims=True)) @ [0.6, 0.0, 0.8]
    share = BALL.face_areas[labels].sum() / BALL.area
    assert abs(0.5 * (1.0 - height.mean()) - share) < 0.003


def test_fixed_points_other_marks_and_the_topology_stay():
    labels = BALL.points[BALL.faces].mean(axis=1)[:, 0] > 0.2
    lines = border(BALL, labels)
    fixed = np.zeros(BALL.n_points, dtype=bool)
    fixed[np.unique(BALL.edges[lines])[::3]] = True
    others = np.arange(len(BALL.edges)) % 2 == 0
    result, (_, kept) = with_smooth_lines(BALL, lines, (others,), fixed)
    np.testing.assert_array_equal(result.points[fixed], BALL.points[fixed])
    np.testing.assert_array_equal(np.unique(result.edges[kept], axis=0), np.unique(BALL.edges[others], axis=0))
    assert result.n_faces == BALL.n_faces
    assert (np.bincount(edges_of(result.faces)[1].ravel()) == 2).all()


def test_without_lines_the_surface_stays():
    nothing = np.zeros(len(BALL.edges), dtype=bool)
    result, (marked,) = with_smooth_lines(BALL, nothing, (), np.zeros(BALL.n_points, dtype=bool))
    assert result is BALL
    assert not marked.any()
