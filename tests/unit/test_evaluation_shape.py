"""Angles and edge lengths of known triangles."""

import numpy as np
import pytest
from sliver_shapes import thick_comb

from anisomesh.evaluation.shape import quality_in_reference_metric, shape_statistics
from anisomesh.features.detect import sharp_edges
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.metric.quality import anisotropic_quality
from anisomesh.shapes.analytic import sphere
from anisomesh.working.surface import working_surface


def test_a_right_triangle():
    surface = Surface(np.array([[0, 0, 0], [3, 0, 0], [0, 4, 0.0]]), np.array([[0, 1, 2]]))
    statistics = shape_statistics(surface, np.array([0.7]))
    assert (statistics.g_mean, statistics.g_min, statistics.g_low) == (0.7, 0.7, 0.7)
    assert statistics.angle_min == pytest.approx(np.degrees(np.arctan2(3, 4)))
    assert statistics.angle_max == pytest.approx(90.0)
    assert (statistics.edge_min, statistics.edge_mean, statistics.edge_max) == pytest.approx((3, 4, 5))
    assert statistics.edge_variation == pytest.approx(np.sqrt(2 / 3) / 4)


def test_slivers_of_the_reference_do_not_decide_the_metric():
    """In the planes of a plate the metric is the identity, so that G is the Euclidean quality."""
    plate = thick_comb(60, bulge=0.2)
    plate = plate.with_points(unit_frame(plate.points).to_unit(plate.points))
    creases = sharp_edges(plate, 20.0)
    even = working_surface(plate, 2000, creases=creases, tagged=np.zeros_like(creases)).surface
    quality = quality_in_reference_metric(plate, even)
    euclidean = anisotropic_quality(even.points, even.faces, np.tile(np.eye(3), (even.n_points, 1, 1)))
    flat = np.abs(even.face_normals[:, 2]) > 1.0 - 1e-9
    np.testing.assert_allclose(quality[flat], euclidean[flat], atol=1e-6)
    assert (euclidean[~flat] - quality[~flat]).max() > 0.1


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
