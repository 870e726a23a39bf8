"""Topology of a remesh and its inverted triangles."""

import json

import numpy as np
import pytest
from creases import wedge

from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import check_validity, inverted_faces
from anisomesh.shapes.analytic import box, cylinder, ellipsoid, sphere, torus


def joined(*surfaces):
    points, faces, start = [], [], 0
    for surface in surfaces:
        points.append(surface.points)
        faces.append(surface.faces + start)
        start += surface.n_points
    return Surface(np.concatenate(points), np.concatenate(faces))


def with_faces(surface, faces):
    return Surface(surface.points, faces)


@pytest.mark.parametrize(("shape", "euler"), [(sphere(2), 2), (torus(1.0, 0.4, 20, 12), 0), (box(n=2), 2)])
def test_closed_surface_against_itself(shape, euler):
    validity = check_validity(shape, shape)
    assert validity.closed
    assert validity.oriented
    assert (validity.euler, validity.euler_input, validity.components) == (euler, euler, 1)
    assert (
        validity.boundary_loops == validity.nonmanifold_edges == validity.nonmanifold_vertices == validity.inverted == 0
    )


def test_open_tube_beside_a_ball():
    tube = cylinder(0.3, 1.0, n_around=12, n_along=4, closed=False)
    ball = sphere(1, 0.2)
    both = joined(tube, ball.with_points(ball.points + np.array([2.0, 0, 0])))
    validity = check_validity(both, tube)
    assert not validity.closed
    assert (validity.boundary_loops, validity.components, validity.euler, validity.euler_input) == (2, 2, 2, 0)


def test_non_manifold_and_badly_oriented_faces_are_counted():
    ball = sphere(1)
    fin = np.concatenate([ball.faces, [[ball.faces[0, 0], ball.faces[0, 1], ball.n_points]]])
    finned = Surface(np.concatenate([ball.points, [[2.0, 2, 2]]]), fin)
    validity = check_validity(finned, ball)
    assert (validity.nonmanifold_edges, validity.nonmanifold_vertices, validity.closed) == (1, 2, False)
    faces = ball.faces.copy()
    faces[5] = faces[5, ::-1]
    validity = check_validity(with_faces(ball, faces), ball)
    assert not validity.oriented
    assert validity.closed
    assert validity.inverted == 1


def test_values_can_be_written_as_json():
    validity = check_validity(sphere(1), box(n=1))
    assert json.loads(json.dumps(validity.as_dict())) == validity.as_dict()


@pytest.mark.parametrize(
    ("coarse", "fine"),
    [
        (sphere(1), sphere(4)),
        (sphere(0), sphere(4)),
        (ellipsoid((1.0, 0.5, 0.05), 2), ellipsoid((1.0, 0.5, 0.05), 5)),
        (torus(1.0, 0.4, 12, 8), torus(1.0, 0.4, 96, 64)),
        (box(n=1), box(n=7)),
    ],
    ids=["sphere", "icosahedron", "thin", "torus", "box"],
)
def test_coarse_remesh_has_no_inverted_triangle_and_its_reverse_nothing_else(coarse, fine):
    assert not inverted_faces(coarse, ClosestPoints(fine)).any()
    assert inverted_faces(with_faces(coarse, coarse.faces[:, ::-1]), ClosestPoints(fine)).all()


@pytest.mark.parametrize("degrees", [10, 40, 90, 150])
def test_triangles_of_a_blunt_crest_are_not_inverted(degrees):
    """A remesh that rounds a sharp crest has a strip above it: closest to the crest, facing up."""
    roof = wedge(np.radians(degrees))
    assert roof.face_normals[:, 2].min() > 0
    strip = Surface(np.array([[-0.01, 0, 0.01], [0.01, 0, 0.01], [0, 0.1, 0.01]]), np.array([[0, 1, 2]]))
    assert not inverted_faces(strip, ClosestPoints(roof)).any()
    assert inverted_faces(with_faces(strip, strip.faces[:, ::-1]), ClosestPoints(roof)).all()


@pytest.mark.parametrize("degrees", [10, 90])
def test_facets_on_either_side_of_a_crest_are_equally_good(degrees):
    """A triangle steep as one side of the crest and above it: its sides differ by up to 170 degrees."""
    roof = wedge(np.radians(degrees))
    for side in (-1.0, 1.0):
        tilt = side * np.radians(90 - degrees / 2)
        normal = np.array([np.sin(tilt), 0, np.cos(tilt)])
        across = np.array([np.cos(tilt), 0, -np.sin(tilt)])
        points = np.stack([-across, across, [0.0, 1, 0]]) * 0.01 + 0.05 * np.array([0, 0, 1.0])
        steep = Surface(points, np.array([[0, 1, 2]]))
        np.testing.assert_allclose(steep.face_normals[0], normal, atol=1e-12)
        assert not inverted_faces(steep, ClosestPoints(roof)).any()


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_triangle_without_area_is_flat_and_not_inverted(size):
    ball = sphere(2)
    line = Surface(size * np.array([[1.0, 0, 0], [1, 0.1, 0], [1, 0.2, 0]]), np.array([[0, 1, 2]]))
    ball = ball.with_points(size * ball.points)
    assert not inverted_faces(line, ClosestPoints(ball)).any()
    validity = check_validity(line, ball)
    assert (validity.flat, validity.inverted) == (1, 0)
    assert check_validity(ball, ball).flat == 0
