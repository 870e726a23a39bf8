"""The camera looks from the given direction, upright, at the whole model."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from anisomesh.errors import OptionError
from anisomesh.viz.camera import camera_axes, framed, height_for

numbers = st.floats(-10.0, 10.0)


@given(st.tuples(numbers, numbers, numbers), st.sampled_from([None, 0, 1, 2]), st.integers(0, 100))
def test_the_view_is_from_the_given_direction_with_the_axis_upwards(direction, up, seed):
    towards = np.array(direction)
    assume(np.linalg.norm(towards) > 0.1)
    towards /= np.linalg.norm(towards)
    assume(up is None or abs(towards[up]) < 0.999)
    axes = camera_axes(np.random.default_rng(seed).normal(size=(9, 3)), direction, up)
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-9)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[2] == pytest.approx(towards, abs=1e-9)
    if up is not None:
        assert axes[0, up] == pytest.approx(0.0, abs=1e-9)
        assert axes[1, up] > 0.0


@pytest.mark.parametrize("up", [0, 1, 2])
def test_the_axis_upwards_counts_without_a_direction_too(up):
    points = np.random.default_rng(0).uniform(size=(50, 3)) * [1.0, 2.0, 3.0]
    axes = camera_axes(points, up=up)
    assert axes[1, up] > 0.8
    assert abs(axes[0, up]) < 1e-9


@pytest.mark.parametrize(("direction", "up"), [((0, 0, 0), None), ((0, 0, -2), 2), ((np.nan, 1, 0), None)])
def test_a_direction_that_says_nothing_is_refused(direction, up):
    with pytest.raises(OptionError, match="direction to look from"):
        camera_axes(np.eye(3), direction, up)


@given(st.tuples(*[st.just(0.0) | st.floats(0.01, 50.0)] * 3), st.integers(0, 1000))
def test_a_picture_of_the_proposed_height_is_filled_along_both_sides_or_has_a_limit(extent, seed):
    points = np.random.default_rng(seed).uniform(-1, 1, size=(30, 3)) * extent
    axes = camera_axes(points)
    height = height_for(points, axes, 400, (100, 600))
    assert 100 <= height <= 600
    view = framed(points, axes, 400 / height)
    reach = np.abs(view.project(points)[:, :2]).max(axis=0) / (view.half_height * np.array([400 / height, 1.0]))
    assert (reach <= 0.9).all()
    if 100 < height < 600:
        assert reach == pytest.approx(np.full(2, 1 / 1.12), rel=0.01)
