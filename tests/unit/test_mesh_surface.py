"""The frozen Surface: validation, immutability, derived tables against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anisomesh.errors import MeshError
from anisomesh.mesh.geometry import thickness, unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.shapes import analytic as shapes

POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


@pytest.mark.parametrize(
    ("points", "faces", "message"),
    [
        (POINTS[:, :2], [[0, 1, 2]], r"\(4, 2\); expected \(V, 3\)"),
        (POINTS, [[0, 1, 2, 3]], "triangulate"),
        (POINTS, np.zeros((0, 3), dtype=int), "no face"),
        (POINTS, [[0.0, 1.0, 2.0]], "expected integers"),
        (np.where(POINTS == 1, np.nan, POINTS), [[0, 1, 2]], r"points\[1\].*not finite \(3 such"),
        (POINTS, [[0, 1, 2], [0, 1, 4]], r"faces\[1\] = \[0, 1, 4\].*4 points"),
        (POINTS, [[0, -1, 2]], "out of range"),
        (POINTS, [[0, 1, 2**32]], "out of range"),
        (POINTS + 1j, [[0, 1, 2]], "points has dtype complex128; expected real numbers"),
        ("a", "b", "expected real numbers"),
    ],
)
def test_bad_arrays_are_refused(points, faces, message):
    with pytest.raises(MeshError, match=message):
        Surface(points, np.asarray(faces))


def test_arrays_are_copied_and_read_only():
    points, faces = POINTS.copy(), np.array([[0, 1, 2]])
    surface = Surface(points, faces)
    points[:] = 7
    faces[:] = 0
    np.testing.assert_array_equal(surface.points, POINTS)
    np.testing.assert_array_equal(surface.faces, [[0, 1, 2]])
    assert (surface.points.dtype, surface.faces.dtype) == (np.float64, np.int32)
    with pytest.raises(ValueError, match="read-only"):
        surface.points[0, 0] = 1
    with pytest.raises(ValueError, match="read-only"):
        surface.faces[0, 0] = 1


def test_geometry_of_a_box():
    box = shapes.box((1, 2, 3), n=2)
    assert box.area == pytest.approx(22)
    assert box.diagonal == pytest.approx(np.sqrt(14))
    centres = box.points[box.faces].mean(axis=1) - [0.5, 1, 1.5]
    outward = (box.face_normals * centres).sum(axis=1)
    np.testing.assert_allclose(np.unique(outward.round(9)), [0.5, 1, 1.5])
    corner = int(np.flatnonzero((box.points == 0).all(axis=1))[0])
    assert (box.point_normals[corner] < 0).all()


def test_normals_of_a_sphere_point_outwards():
    ball = shapes.sphere(4)
    np.testing.assert_allclose(ball.point_normals, ball.points, atol=0.01)


def test_degenerate_faces_have_no_normal_and_no_area():
    flat = Surface(np.vstack([POINTS, [2, 0, 0]]), [[0, 1, 4], [2, 2, 3]])
    np.testing.assert_array_equal(flat.face_normals, 0)
    assert flat.area == 0


@pytest.mark.parametrize("scale", [1e-20, 1.0, 1e20])
def test_unit_frame_is_a_similarity_onto_diagonal_one(scale):
    points = scale * (shapes.sphere(1).points * [1, 2, 3] + 100)
    frame = unit_frame(points)
    inside = frame.to_unit(points)
    assert np.linalg.norm(np.ptp(inside, axis=0)) == pytest.approx(1)
    np.testing.assert_allclose(inside.max(axis=0), -inside.min(axis=0), atol=1e-12)
    np.testing.assert_allclose(frame.to_model(inside), points, rtol=1e-13)


def test_thickness_of_known_triangles():
    regular = np.array([[0, 0, 0], [2, 0, 0], [1, np.sqrt(3), 0]])
    right = np.array([[0, 0, 0], [0, 3, 0], [0, 0, 4.0]])
    flat = np.array([[0, 0, 0], [1, 1, 1], [3, 3, 3.0]])
    point = np.zeros((3, 3))
    np.testing.assert_allclose(
        thickness(np.stack([regular, right, flat, point])), [np.sqrt(3) / 4, 6 / 25, 0, 0], atol=1e-15
    )


def rotation(seed):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.linalg.det(q)


@given(st.floats(1.0, 50.0), st.floats(0.0, 2 * np.pi), st.floats(1e-3, 1e3), st.integers(0, 1000))
def test_stretching_an_equilateral_triangle_by_r_gives_r(r, direction, size, seed):
    angles = direction + 2 * np.pi * np.arange(3) / 3
    flat = np.stack([r * np.cos(angles), np.sin(angles), np.zeros(3)], axis=1)
    surface = Surface(size * flat @ rotation(seed).T, np.array([[0, 1, 2]]))
    assert surface.face_stretch == pytest.approx([r], rel=1e-5, abs=1e-5)


def test_a_triangle_without_area_is_stretched_without_limit():
    surface = Surface(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([[0, 1, 2], [0, 0, 0]]))
    assert np.isposinf(surface.face_stretch).all()
