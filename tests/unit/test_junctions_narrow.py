"""Faces between two chains of one junction curve."""

from itertools import pairwise

import numpy as np
import pytest

from anisomesh.conforming.chains import Bundle, Chain
from anisomesh.junctions.chains import Bundled
from anisomesh.junctions.narrow import without_narrow_faces
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import euler_characteristic

A, B, MIDDLE, AGAIN = 0, 1, 2, 3
POINTS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    ("faces", "chains"),
    [
        ([[A, B, MIDDLE]], [[A, B], [A, MIDDLE, B]]),
        ([[A, B, MIDDLE], [A, MIDDLE, AGAIN]], [[A, B], [AGAIN, MIDDLE, B]]),
    ],
)
def test_faces_between_two_chains_get_points_beside_them(faces, chains):
    faces = np.array(faces, dtype=np.int32)
    points = POINTS[: faces.max() + 1]
    curve = points[[A, MIDDLE, B]]
    bundle = Bundle(curve, [Chain(np.array(each), points[each, 0]) for each in chains])
    plate = Surface(np.array([[-2.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 1.0]]), np.array([[0, 1, 2]]))
    made = without_narrow_faces(Bundled(points, faces, [bundle]), ClosestPoints(plate))
    assert euler_characteristic(made.faces) == euler_characteristic(faces)
    assert (made.points[: len(points)] == points).all()
    assert (made.faces >= len(points)).any(axis=1).all()
    surface = Surface(made.points, made.faces)
    sides = {tuple(edge) for edge in surface.edges[surface.edge_face_count == 1].tolist()}
    for chain in chains:
        assert {tuple(sorted(pair)) for pair in pairwise(chain)} <= sides
    inner = surface.edges[surface.edge_face_count == 2]
    assert (inner >= len(points)).any(axis=1).all()
