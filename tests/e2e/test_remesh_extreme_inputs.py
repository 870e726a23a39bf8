"""Extreme inputs: a valid result, or an error that names the problem."""

import warnings

import numpy as np
import pytest

import anisomesh
from anisomesh.errors import MeshError, OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import box, sphere

BALL = sphere(3)
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
FEW = {"max_iterations": 15}


def strip(around, across, point, twist, squares):
    """Return a band of so many squares across that is glued to itself after a half turn, with ``across`` points."""
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    points = np.stack(point(2 * np.pi * i.ravel() / around, j.ravel()), axis=1)

    def at(a, b):
        return np.where(a == around, twist(b) % across, a * across + b % across)

    a, b = (x.ravel() for x in np.meshgrid(np.arange(around), np.arange(squares), indexing="ij"))
    lower = np.stack([at(a, b), at(a + 1, b), at(a + 1, b + 1)], axis=1)
    return points, np.concatenate([lower, np.stack([at(a, b), at(a + 1, b + 1), at(a, b + 1)], axis=1)])


def moebius():
    across = 5

    def point(u, j):
        w = 0.4 * (2 * j / (across - 1) - 1)
        return (1 + w * np.cos(u / 2)) * np.cos(u), (1 + w * np.cos(u / 2)) * np.sin(u), w * np.sin(u / 2)

    return strip(40, across, point, lambda b: across - 1 - b, across - 1)


def klein_bottle():
    def point(u, j):
        v = 2 * np.pi * j / 12
        r = 2 + np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v)
        return r * np.cos(u), r * np.sin(u), np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v)

    return strip(24, 12, point, lambda b: -b, 12)


def and_a_tetrahedron():
    small = np.array([[3.0, 0, 0], [4, 0, 0], [3, 1, 0], [3, 0, 1]])
    return np.concatenate([BALL.points, small]), np.concatenate([BALL.faces, TETRAHEDRON + BALL.n_points])


def soup():
    rng = np.random.default_rng(0)
    return np.pad(rng.random((90, 2)), ((0, 0), (0, 1))), np.arange(90).reshape(-1, 3)


def with_duplicates():
    return BALL.points, np.concatenate([BALL.faces, BALL.faces[:50], BALL.faces[:20, ::-1]])


def noisy():
    rng = np.random.default_rng(0)
    return (BALL.points + 1e-7 * rng.normal(size=BALL.points.shape)).astype(np.float32), BALL.faces


VALID = {
    "one triangle": (lambda: (np.eye(3), np.array([[0, 1, 2]])), 20),
    "one triangle as it is": (lambda: (np.eye(3), np.array([[0, 1, 2]])), 4),
    "a component of four faces": (and_a_tetrahedron, 60),
    "coplanar soup": (soup, 90),
    "tiny": (lambda: (1e-9 * BALL.points, BALL.faces), 100),
    "huge": (lambda: (1e150 * BALL.points, BALL.faces), 100),
    "smaller than an atom's": (lambda: (1e-150 * BALL.points, BALL.faces), 100),
    "far away": (lambda: (BALL.points + 1e9, BALL.faces), 100),
    "noise of float32": (noisy, 100),
    "duplicate faces": (with_duplicates, 100),
    "Moebius strip": (moebius, 100),
    "Klein bottle": (klein_bottle, 100),
    "four vertices": (lambda: (BALL.points, BALL.faces), 4),
    "five vertices": (lambda: (BALL.points, BALL.faces), 5),
    "many more vertices": (lambda: (sphere(1).points, sphere(1).faces), 12 * 42),
    "flattened box": (lambda: (box(n=4).points * [1, 1, 0], box(n=4).faces), 100),
    "box of twelve faces": (lambda: (box(n=1).points, box(n=1).faces), 8),
    "needle": (
        lambda: (np.array([[0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0], [0.5, 0, 1e-9]]), TETRAHEDRON),
        20,
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", VALID)
def test_the_result_is_a_valid_mesh(name):
    make, n = VALID[name]
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # nothing from a library reaches the user
        result = anisomesh.remesh(*make(), n_vertices=n, **FEW)
    validity = result.validity
    assert validity.components == validity.components_input
    assert validity.euler == validity.euler_input
    assert validity.boundary_loops == validity.boundary_loops_input
    assert validity.nonmanifold_edges == validity.nonmanifold_vertices == validity.duplicate_faces == 0
    assert validity.oriented
    assert np.isfinite(result.surface.points).all()
    if result.surface.n_points != n or validity.inverted or validity.new_intersections:
        assert result.warnings or abs(result.surface.n_points - n) <= 0.02 * n


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"n_vertices": 3}, "at least 4"),
        ({"n_vertices": 1}, "at least 4"),
        ({"n_vertices": 0}, "at least 4"),
        ({"n_vertices": -5}, "at least 4"),
        ({"n_vertices": 10**12}, "GiB of memory"),
        ({"ratio": 0}, "positive number"),
        ({"ratio": float("nan")}, "positive number"),
        ({"ratio": 1e9}, "GiB of memory"),
    ],
)
def test_impossible_numbers_of_vertices_are_refused(options, said):
    with pytest.raises(OptionError, match=said):
        anisomesh.remesh(BALL, **options)


@pytest.mark.parametrize("factor", [1e155, 1e200, 1e-155, 1e-200])
def test_sizes_at_which_areas_overflow_or_vanish_are_refused(factor):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(MeshError, match="scale it"):
            anisomesh.remesh(BALL.with_points(factor * BALL.points), n_vertices=100)


def test_a_mesh_lost_in_rounding_is_refused():
    with pytest.raises(MeshError, match="has an area"):
        anisomesh.remesh(Surface(1e-9 * BALL.points + 1e9, BALL.faces), n_vertices=100)
