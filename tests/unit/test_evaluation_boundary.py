"""Distance between boundary curves: circles and squares with known answers, surfaces without a boundary."""

import numpy as np
import pytest

from anisomesh.evaluation.boundary import boundary_distance
from anisomesh.shapes.analytic import open_patch, sphere


def flat(n, half_width=1.0):
    return open_patch(lambda x, y: 0.0 * x, n=n, half_width=half_width)


def test_the_same_curve_divided_otherwise():
    found = boundary_distance(flat(8), flat(3))
    assert found.max_ab == pytest.approx(0.0, abs=1e-12)
    assert found.max_ba == pytest.approx(0.0, abs=1e-12)


def test_a_smaller_square():
    """Sides at distance d, of which the outer corners are d sqrt 2 away: the mean over a side of 2 is worked out."""
    d = 0.1
    found = boundary_distance(flat(8), flat(5, 1.0 - d))
    x = np.linspace(0.0, d, 100_001)
    beside = np.trapezoid(np.hypot(d, x), x)  # the part of an outer side past the end of the inner one
    assert found.mean_ab == pytest.approx((1.0 - d) * d + beside, rel=1e-3)
    assert found.max_ab == pytest.approx(np.sqrt(2.0) * d)
    assert found.mean_ba == pytest.approx(d)
    assert found.max_ba == pytest.approx(d)


def test_no_distance_without_a_boundary():
    assert boundary_distance(sphere(1), flat(2)) is None
    assert boundary_distance(flat(2), sphere(1)) is None
    assert boundary_distance(sphere(1), sphere(1)) is None
