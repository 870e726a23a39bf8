"""Procedural parts: volume and area from formulas, closed and oriented outwards, outlines that are refused."""

import numpy as np
import pytest

from anisomesh.errors import OptionError
from anisomesh.features.detect import corners, sharp_edges
from anisomesh.mesh import topology
from anisomesh.mesh.intersections import self_intersections
from anisomesh.shapes.lofts import random_part
from anisomesh.shapes.parts import hollow_loft, loft, prism, revolution, sparse_parts

CORNERS = {"cube": 8, "slab": 8, "rod": 8, "bracket": 12, "channel": 16, "stairs": 20, "hexagon": 12, "gear": 24}


def volume(surface):
    a, b, c = (surface.points[surface.faces[:, k]] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0


def shoelace(outline):
    x, y = np.asarray(outline, dtype=float).T
    return 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1))


@pytest.mark.parametrize("name", sparse_parts())
def test_parts_are_closed_spheres_of_few_triangles(name):
    part = sparse_parts()[name]
    assert (part.edge_face_count == 2).all()
    assert topology.is_oriented(part.faces)
    assert topology.euler_characteristic(part.faces) == 2
    assert topology.count_nonmanifold_points(part.faces) == 0
    assert part.n_faces <= 500
    assert part.face_areas.min() > 0.0
    assert volume(part) > 0.0
    if name in CORNERS:
        assert corners(part, sharp_edges(part, 40.0)).sum() == CORNERS[name]


@pytest.mark.parametrize("n", [3, 5, 11])
def test_a_prism_has_the_volume_and_the_area_of_its_outline(n):
    rng = np.random.default_rng(n)
    turn = 2 * np.pi * np.arange(2 * n) / (2 * n)
    outline = np.stack([np.cos(turn), np.sin(turn)], axis=1) * rng.uniform(0.2, 1.0, (2 * n, 1))  # a star, not convex
    part = prism(outline, 0.7)
    around = np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1).sum()
    assert volume(part) == pytest.approx(0.7 * shoelace(outline))
    assert part.area == pytest.approx(2 * shoelace(outline) + 0.7 * around)


def test_a_solid_of_revolution_has_the_volume_of_its_frustums():
    profile = np.array([[0.0, 0.0], [1.0, 0.2], [0.5, 1.0], [0.8, 1.5], [0.0, 2.0]])
    n = 17
    (a, z), (b, w) = profile[:-1].T, profile[1:].T
    share = n * np.sin(2 * np.pi / n) / 2  # of a regular polygon in the square of its radius
    assert volume(revolution(profile, n)) == pytest.approx(share * ((w - z) * (a * a + a * b + b * b) / 3).sum())


def star(n=5, seed=0):
    turn = 2 * np.pi * np.arange(2 * n) / (2 * n)
    radius = np.random.default_rng(seed).uniform(0.3, 1.0, (2 * n, 1))
    return radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def test_a_loft_has_the_volume_of_its_frustums():
    profile = np.array([[0.0, 0.0], [1.0, 0.2], [0.5, 1.0], [0.8, 1.5], [0.0, 2.0]])
    (a, z), (b, w) = profile[:-1].T, profile[1:].T
    wanted = shoelace(star()) * ((w - z) * (a * a + a * b + b * b) / 3).sum()
    assert volume(loft(star(), profile)) == pytest.approx(wanted)


def test_a_hollow_loft_is_the_loft_less_its_hole():
    around = loft(star(), [[0, 0], [1, 0], [1, 2], [0, 2]])
    hole = loft(star(), [[0, 0], [0.5, 0], [0.7, 2], [0, 2]])
    part = hollow_loft(star(), [[1, 0], [1, 2], [0.7, 2], [0.5, 0]])
    assert volume(part) == pytest.approx(volume(around) - volume(hole))
    assert (part.edge_face_count == 2).all()
    assert topology.euler_characteristic(part.faces) == 0


def test_random_parts_are_closed_solids_that_depend_on_the_numbers_alone():
    kinds = set()
    for seed in range(40):
        part = random_part(np.random.default_rng(seed))
        assert (part.edge_face_count == 2).all()
        assert topology.is_oriented(part.faces)
        assert len(self_intersections(part)) == 0
        assert part.face_areas.min() > 0.0
        assert volume(part) > 0.0
        kinds.add(topology.euler_characteristic(part.faces))
    assert kinds == {0, 2}
    np.testing.assert_array_equal(random_part(np.random.default_rng(39)).points, part.points)


@pytest.mark.parametrize(
    "make",
    [
        lambda: prism([[0, 0], [0, 1], [1, 1], [1, 0]], 1.0),  # clockwise
        lambda: prism([[0, 0], [1, 1], [1, 0], [0, 1]], 1.0),  # crosses itself
        lambda: prism([[0, 0], [1, 0]], 1.0),
        lambda: prism([[0, 0], [1, 0], [0, 1]], 0.0),
        lambda: revolution([[0.1, 0], [1, 1], [0, 2]]),
        lambda: revolution([[0, 0], [0, 1], [0, 2]]),
        lambda: revolution([[0, 0], [1, 1], [0, 2]], 2),
        lambda: loft([[0, 1], [1, 1], [1, 2], [0, 2]], [[0, 0], [1, 0], [0, 1]]),  # the origin is outside
        lambda: loft([[1, 0], [0, -1], [-1, 0], [0, 1]], [[0, 0], [1, 0], [0, 1]]),  # clockwise
        lambda: hollow_loft(star(), [[1, 0], [0.5, 0], [0.5, 1], [1, 1]]),  # clockwise
        lambda: hollow_loft(star(), [[1, 0], [1, 1], [0, 0]]),  # touches the axis
    ],
)
def test_outlines_that_make_no_solid_are_refused(make):
    with pytest.raises(OptionError):
        make()
