"""Creases and corners kept by a remesh, on shapes where the answer can be counted."""

import numpy as np
import pytest

from anisomesh.errors import OptionError
from anisomesh.evaluation.preservation import feature_preservation
from anisomesh.features.detect import corners, points_along, sharp_edges
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import box, cad_features, cad_part, open_patch, sphere


def test_a_mesh_keeps_all_its_own_features():
    cuboid = box((2.0, 1.0, 0.5), n=3)
    kept = feature_preservation(cuboid, cuboid)
    assert kept.crease_length == pytest.approx(4 * 3.5)
    assert (kept.crease_covered, kept.corners, kept.corners_kept) == (1.0, 8, 8)


def test_without_creases_everything_is_covered():
    kept = feature_preservation(sphere(3), box(n=1))
    assert (kept.crease_length, kept.crease_covered, kept.corners, kept.corners_kept) == (0.0, 1.0, 0, 0)


def test_a_round_remesh_keeps_nothing():
    ball = sphere(4)
    kept = feature_preservation(box(n=2), ball.with_points(0.5 + 0.5 * ball.points))
    assert (kept.crease_covered, kept.corners, kept.corners_kept) == (0.0, 8, 0)


@pytest.mark.parametrize("tolerance", [0.02, 0.002])
def test_creases_that_become_a_boundary_are_lost(tolerance):
    cuboid = box((1.0, 1.0, 2.0), n=2)
    lid = (cuboid.points[cuboid.faces][:, :, 2] == 2.0).all(axis=1)
    opened = Surface(cuboid.points, cuboid.faces[~lid])
    kept = feature_preservation(cuboid, opened, tolerance=tolerance)
    # of 8 edges of length 1 and 4 of length 2 four of length 1 are gone, but for their ends
    assert kept.crease_covered == pytest.approx((12.0 + 8 * tolerance) / 16.0, abs=0.1 * tolerance)
    assert kept.corners_kept == 8


def test_a_crease_farther_than_the_tolerance_is_lost():
    roof = open_patch(lambda x, y: np.abs(x - 0.5), n=4)
    for shift, covered in ((0.003, 1.0), (0.005, 0.0)):
        moved = roof.with_points(roof.points + np.array([0.0, 0.0, shift]))
        assert feature_preservation(roof, moved, tolerance=0.004).crease_covered == covered


def test_corners_and_creases_of_the_part_are_those_it_was_made_with():
    part, features = cad_part(10), cad_features(10)
    sharp = sharp_edges(part, 30.0)
    made = features.creases[~features.weak]
    known = {tuple(edge) for edge in np.sort(made, axis=1).tolist()}
    assert {tuple(edge) for edge in part.edges[sharp].tolist()} == known
    assert set(features.corners.tolist()) >= set(np.flatnonzero(corners(part, sharp)).tolist())


def test_points_along_edges_hold_the_ends_and_the_spacing():
    cuboid = box((1.0, 0.3, 0.1), n=1)
    chosen = sharp_edges(cuboid, 30.0)
    points = points_along(cuboid, chosen, 0.04)
    for a, b in cuboid.points[cuboid.edges[chosen]]:
        along = (b - a) / np.linalg.norm(b - a)
        t = (points - a) @ along
        on = np.linalg.norm(points - a - t[:, None] * along, axis=1) < 1e-12
        t = np.sort(t[on & (t > -1e-12) & (t < np.linalg.norm(b - a) + 1e-12)])
        assert t[0] == pytest.approx(0.0, abs=1e-12)
        assert t[-1] == pytest.approx(np.linalg.norm(b - a))
        assert np.diff(t).max() <= 0.04 + 1e-12
    assert points_along(cuboid, np.zeros(len(cuboid.edges), dtype=bool), 0.1).shape == (0, 3)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, np.nan])
def test_tolerance_must_be_positive(tolerance):
    with pytest.raises(OptionError, match="tolerance"):
        feature_preservation(box(n=1), box(n=1), tolerance=tolerance)
