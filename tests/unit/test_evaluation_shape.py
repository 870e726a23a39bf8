"""Angles and edge lengths of known triangles."""

import numpy as np
import pytest

from anisomesh.evaluation.shape import shape_statistics
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import sphere


def test_a_right_triangle():
    surface = Surface(np.array([[0, 0, 0], [3, 0, 0], [0, 4, 0.0]]), np.array([[0, 1, 2]]))
    statistics = shape_statistics(surface, np.array([0.7]))
    assert (statistics.g_mean, statistics.g_min, statistics.g_low) == (0.7, 0.7, 0.7)
    assert statistics.angle_min == pytest.approx(np.degrees(np.arctan2(3, 4)))
    assert statistics.angle_max == pytest.approx(90.0)
    assert (statistics.edge_min, statistics.edge_mean, statistics.edge_max) == pytest.approx((3, 4, 5))
    assert statistics.edge_variation == pytest.approx(np.sqrt(2 / 3) / 4)


def test_an_icosahedron_is_regular():
    surface = sphere(0)
    statistics = shape_statistics(surface, np.ones(surface.n_faces))
    assert statistics.angle_min == pytest.approx(60.0)
    assert statistics.angle_max == pytest.approx(60.0)
    assert statistics.edge_variation == pytest.approx(0.0, abs=1e-12)


def test_a_triangle_without_area_has_stated_angles():
    surface = Surface(np.array([[0, 0, 0], [1, 0, 0], [3, 0, 0.0]]), np.array([[0, 1, 2]]))
    statistics = shape_statistics(surface, np.zeros(1))
    assert (statistics.angle_min, statistics.angle_max) == (0.0, pytest.approx(180.0))
    repeated = Surface(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    assert all(np.isfinite(value) for value in shape_statistics(repeated, np.zeros(1)).as_dict().values())
