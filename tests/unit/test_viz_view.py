"""The camera shows everything, and the close-up finds the stretched triangles that can be seen."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anisomesh.mesh.surface import Surface
from anisomesh.viz.view import closeup, whole_view
from conftest import torus_arrays

ASPECT = 1.6


def grid(xs, ys, height=0.0):
    """Return a flat rectangular grid of triangles, seen from +z."""
    x, y = np.meshgrid(xs, ys, indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), np.full(x.size, height)], axis=1)
    index = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:])
    faces = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return points, faces


@given(st.integers(0, 10_000), st.tuples(*[st.floats(0.01, 100.0)] * 3))
def test_every_point_is_in_view_and_the_picture_is_filled(seed, extent):
    points = np.random.default_rng(seed).uniform(-1, 1, size=(40, 3)) * extent + 7.0
    view = whole_view(points, ASPECT)
    assert view.axes @ view.axes.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(view.axes) == pytest.approx(1.0)
    shown = np.abs((points - view.centre) @ view.axes.T)[:, :2] / view.half_height / [ASPECT, 1.0]
    assert 0.85 < shown.max() < 0.95


@pytest.mark.parametrize("axis", range(3))
def test_a_plate_is_seen_from_its_flat_side(axis):
    points = np.random.default_rng(axis).uniform(-1, 1, size=(100, 3))
    points[:, axis] *= 0.01
    view = whole_view(points, ASPECT)
    assert abs(view.axes[2, axis]) > 0.8


def test_the_closeup_lies_where_the_triangles_are_stretched():
    xs = np.concatenate([np.linspace(0, 6, 61), np.linspace(6, 9, 240)[1:], np.linspace(9, 12, 31)[1:]])
    surface = Surface(*grid(xs, np.linspace(0, 8, 81)))
    view = whole_view(surface.points, ASPECT)
    near = closeup(surface, view, ASPECT)
    assert 6.0 < near.centre[0] < 9.0
    assert near.half_height < 0.25 * view.half_height
    assert near.axes == pytest.approx(view.axes)


def test_the_closeup_avoids_what_is_hidden():
    stretched = grid(np.linspace(0, 4, 9), np.linspace(0, 4, 81), height=0.0)
    cover = grid(np.linspace(-1, 5, 61), np.linspace(-1, 5, 61), height=0.3)
    points = np.concatenate([stretched[0], cover[0]])
    surface = Surface(points, np.concatenate([stretched[1], cover[1] + len(stretched[0])]))
    near = closeup(surface, whole_view(points, ASPECT), ASPECT)
    assert near.centre[2] == pytest.approx(0.3)


def test_a_surface_seen_only_from_behind_still_has_a_closeup():
    points, faces = grid(np.linspace(0, 1, 5), np.linspace(0, 1, 5))
    surface = Surface(points, faces[:, ::-1])
    near = closeup(surface, whole_view(points, ASPECT), ASPECT)
    assert np.isfinite(near.centre).all()
    assert near.half_height > 0


@given(st.floats(1e-3, 1e3), st.tuples(*[st.floats(-100, 100)] * 3))
def test_views_move_and_grow_with_the_model(scale, shift):
    surface = Surface(*torus_arrays(24, 12))
    moved = Surface(scale * surface.points + scale * np.array(shift), surface.faces)
    view, moved_view = whole_view(surface.points, ASPECT), whole_view(moved.points, ASPECT)
    assert moved_view.axes == pytest.approx(view.axes)
    assert moved_view.half_height == pytest.approx(scale * view.half_height, rel=1e-6)
    assert moved_view.centre == pytest.approx(scale * (view.centre + shift), rel=1e-6, abs=1e-6 * scale)
