"""T-junctions are closed by splitting sides, and nothing else is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anisomesh.mesh.surface import Surface
from anisomesh.repair.prepare import prepare

CUBE_FACES = (  # origin and two directions, counter-clockwise seen from outside
    ((0, 0, 0), (0, 1, 0), (1, 0, 0)),
    ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
    ((0, 0, 0), (1, 0, 0), (0, 0, 1)),
    ((0, 1, 0), (0, 0, 1), (1, 0, 0)),
    ((0, 0, 0), (0, 0, 1), (0, 1, 0)),
    ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
)


def grid(origin, u, v, rng):
    """Return the points and faces of a parallelogram that is cut at random places."""
    places = np.arange(1, 40) / 40  # cuts that are nearly equal are left to the weld tolerance
    cuts = [np.array([0.0, *np.sort(rng.choice(places, rng.integers(0, 4), replace=False)), 1.0]) for _ in range(2)]
    s, t = np.meshgrid(*cuts, indexing="ij")
    points = np.asarray(origin) + s.reshape(-1, 1) * np.asarray(u) + t.reshape(-1, 1) * np.asarray(v)
    number = np.arange(s.size).reshape(s.shape)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=2)
    return points, faces.reshape(-1, 3)


def cube(seed):
    """Return a cube whose faces do not know where the others are cut."""
    rng = np.random.default_rng(seed)
    parts = [grid(*face, rng) for face in CUBE_FACES]
    first = np.cumsum([0, *(len(points) for points, _ in parts)])
    faces = np.concatenate([part[1] + start for part, start in zip(parts, first, strict=False)])
    return Surface(np.concatenate([points for points, _ in parts]), faces)


def rotation(seed):
    return np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]


@given(seed=st.integers(0, 10_000), rounded=st.booleans())
def test_a_cube_of_faces_cut_at_different_places_becomes_closed(seed, rounded):
    soup = cube(seed)
    turn = rotation(seed)
    turn *= np.sign(np.linalg.det(turn))
    soup = soup.with_points(soup.points @ turn.T + [3.0, -2.0, 5.0])
    if rounded:
        soup = soup.with_points(soup.points.astype(np.float32))
    prepared = prepare(soup)
    assert prepared.surface.volume == pytest.approx(1.0, rel=1e-6)  # None where there is a boundary
    assert prepared.surface.area == pytest.approx(6.0, rel=1e-6)
    assert prepared.report.components == 1
    assert prepare(prepared.surface).surface is prepared.surface


def test_the_number_of_split_sides_is_said():
    base = [(0, 0, 0), (2, 0, 0), (1, 1, 0)]
    below = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (1, -1, 0)]
    sheet = Surface(np.array([*base, *below], dtype=float), np.array([[0, 1, 2], [3, 6, 4], [4, 6, 5]]))
    prepared = prepare(sheet)
    assert prepared.report.sides_split == 1
    assert "1 side(s) split at points of other faces that lie on them" in prepared.report.lines()
    assert prepared.surface.n_faces == 4
    assert np.count_nonzero(prepared.surface.edge_face_count == 1) == 4


@pytest.mark.parametrize("gap", [0.0, 1e-3])
def test_a_point_that_only_touches_a_side_changes_nothing(gap):
    points = [(0, 0, 0), (2, 0, 0), (1, 1, 0), (1, -gap, 0), (0.5, -1, 0), (1.5, -1, 0)]
    sheet = Surface(np.array(points, dtype=float), np.array([[0, 1, 2], [3, 4, 5]]))
    assert prepare(sheet).surface is sheet


def test_a_gap_is_closed_up_to_the_weld_tolerance():
    base, below = [(0, 0, 0), (2, 0, 0), (1, 1, 0)], [(0, 0, 0), (1, -1e-3, 0), (2, 0, 0), (1, -1, 0)]
    sheet = Surface(np.array([*base, *below], dtype=float), np.array([[0, 1, 2], [3, 6, 4], [4, 6, 5]]))
    assert prepare(sheet).report.sides_split == 0
    assert prepare(sheet, weld_tolerance=2e-3).report.sides_split == 1


def test_two_sides_of_a_face_are_split_one_after_the_other():
    big = [(0, 0, 0), (2, 0, 0), (0, 2, 0)]
    below = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (1, -1, 0)]
    left = [(0, 0, 0), (0, 1, 0), (0, 2, 0), (-1, 1, 0)]
    faces = [[0, 1, 2], [3, 6, 4], [4, 6, 5], [7, 8, 10], [8, 9, 10]]
    sheet = Surface(np.array([*big, *below, *left], dtype=float), np.array(faces))
    prepared = prepare(sheet)
    assert prepared.report.sides_split == 2
    assert prepared.surface.n_faces == 4 + 3
    assert prepared.surface.area == pytest.approx(sheet.area)
    assert prepared.report.components == 1
