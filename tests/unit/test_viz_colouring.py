"""Colour values match their names and units."""

import numpy as np
import pytest

from anisomesh.mesh.geometry import unit_frame
from anisomesh.metric.quality import anisotropic_quality
from anisomesh.metric.tensors import compute_metric, metric_root
from anisomesh.shapes.analytic import ellipsoid, sphere
from anisomesh.viz.colouring import Colouring, distance_colouring, quality_colouring, stretch_colouring


def moved(surface):
    return surface.with_points(250.0 * surface.points + [10.0, -500.0, 3.0])


def test_distance_is_in_per_cent_of_the_diagonal():
    ball = sphere(4)
    shell = ball.with_points(1.02 * ball.points)
    values = distance_colouring(shell, ball).values
    assert values == pytest.approx(np.full(ball.n_faces, 100 * 0.02 / (2 * np.sqrt(3))), rel=0.05)
    assert distance_colouring(ball, ball).values.max() < 1e-6


def test_distance_sees_a_face_whose_corners_are_all_on_the_surface():
    corners, values = sphere(1), distance_colouring(sphere(1), sphere(4)).values
    at_centres = 1.0 - np.linalg.norm(corners.points[corners.faces].mean(axis=1), axis=1)
    assert values == pytest.approx(100 * at_centres / 4 / (2 * np.sqrt(3)), rel=0.1)


def test_quality_is_that_in_the_metric_of_the_reference():
    surface = ellipsoid((1.0, 0.8, 0.6), subdivisions=3)
    unit = surface.with_points(unit_frame(surface.points).to_unit(surface.points))
    expected = anisotropic_quality(unit.points, unit.faces, metric_root(compute_metric(unit)))
    assert quality_colouring(surface, surface).values == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("colouring", [quality_colouring, distance_colouring])
def test_place_and_size_do_not_matter(colouring):
    reference, surface = ellipsoid(subdivisions=3), ellipsoid(subdivisions=2)
    found, again = colouring(surface, reference), colouring(moved(surface), moved(reference))
    assert again.values == pytest.approx(found.values, rel=1e-6, abs=1e-9)


def test_the_ends_of_the_bar_are_the_colours_of_the_least_and_the_largest_value():
    colouring = Colouring(values=np.array([1.0, 2.0, 5.0, 9.0]), name="x", high=5.0)
    first, _, third, last = colouring.rgb().astype(int)
    ends = (255 * np.asarray(colouring.colour_map()([0.0, 1.0]))[:, :3]).astype(int)
    assert np.abs(first - ends[0]).max() <= 1
    assert np.abs(third - ends[1]).max() <= 1
    assert (third == last).all()
    assert colouring.limits == (1.0, 5.0)
    assert colouring.beyond == (False, True)


@pytest.mark.parametrize("values", [[1.0, 1.0], [0.0, 0.0], [np.inf, np.inf], [np.nan, 2.0], [np.inf, 3.0]])
def test_every_value_has_a_colour(values):
    colouring = Colouring(values=np.array(values), name="x")
    assert colouring.rgb().shape == (2, 3)
    low, high = colouring.limits
    assert np.isfinite([low, high]).all()
    assert low < high


def test_names_carry_the_mean():
    ball = sphere(2)
    colouring = stretch_colouring(ball)
    assert f"{colouring.values.mean():.2f}" in colouring.name
    assert colouring.limits[0] == 1.0
