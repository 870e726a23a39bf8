"""Parts that touch keep their creases, and surfaces with one side say that they were cut."""

import numpy as np
import pytest

import anisomesh
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.distance import surface_distance
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import new_intersections
from anisomesh.shapes.analytic import box


def two_boxes(shift, n=1):
    """Return two unit cubes, the second one shifted; points at one place are one point."""
    first = box(n=n)
    points = np.concatenate([first.points, first.points + np.asarray(shift, dtype=float)])
    unique, number = np.unique(points.round(9), axis=0, return_inverse=True)
    faces = np.concatenate([first.faces, first.faces + first.n_points])
    return Surface(unique, number.reshape(-1)[faces].astype(np.int32))


@pytest.mark.parametrize(("shift", "n"), [((1, 1, 0), 1), ((1, 1, 0), 3), ((1, 1, 1), 1)])
def test_cubes_with_a_common_edge_or_corner_are_exact(shift, n):
    cubes = two_boxes(shift, n)
    result = anisomesh.remesh(cubes, n_vertices=150, embedding="direct")
    assert surface_distance(cubes, result.surface, samples=20_000).hausdorff < 1e-6
    assert result.validity.components == (1 if shift == (1, 1, 0) else 2)
    assert result.surface.n_points == 150
    assert not result.warnings


def test_intersections_away_from_a_common_edge_are_found():
    cubes = anisomesh.prepare(two_boxes((1, 1, 0), 4)).surface
    moved = np.array(cubes.points)
    corner = int(np.argmin(np.abs(moved - [0.0, 0.0, 0.0]).sum(axis=1)))
    moved[corner] = (0.4, 0.4, 1.3)  # through the upper face of its cube
    assert len(new_intersections(Surface(moved, cubes.faces), ClosestPoints(cubes))) > 0


def test_a_moebius_strip_says_that_it_was_cut():
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 41)[:-1], np.linspace(-0.3, 0.3, 5), indexing="ij")
    radius = 1.0 + v * np.cos(u / 2)
    points = np.stack([radius * np.cos(u), radius * np.sin(u), v * np.sin(u / 2)], axis=-1).reshape(-1, 3)
    faces = []
    for i in range(40):
        for j in range(4):
            a, b = 5 * i + j, 5 * i + j + 1
            c, d = (5 * (i + 1) + j, 5 * (i + 1) + j + 1) if i < 39 else (4 - j, 3 - j)
            faces += [[a, c, b], [b, c, d]]
    result = anisomesh.remesh(points, np.array(faces), n_vertices=150, embedding="direct")
    assert any("one side only" in warning for warning in result.warnings)
