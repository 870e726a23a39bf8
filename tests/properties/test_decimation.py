"""Quadric decimation as a start of fits: it keeps topology, outline and held points, and is as near as others."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from anisomesh._kernels import decimate as kernels
from anisomesh._kernels import quadrics
from anisomesh.bench.methods import METHODS
from anisomesh.features.detect import corners, sharp_edges
from anisomesh.fitting.decimation import decimated
from anisomesh.mesh.distance import surface_distance
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import (
    boundary_loops,
    connected_components,
    euler_characteristic,
    is_oriented,
    nonmanifold_points,
)
from anisomesh.shapes import analytic as shapes
from anisomesh.shapes.cad_part import cad_part

SHAPES = {
    "sphere": lambda: shapes.sphere(3),
    "torus": lambda: shapes.torus(n_major=30, n_minor=12),
    "part": lambda: cad_part(6),
    "open patch": lambda: shapes.open_patch(lambda x, y: 0.3 * np.sin(4 * x) * y, n=15),
}


def nothing_held(surface):
    return np.zeros(surface.n_points, dtype=bool)


@given(
    name=st.sampled_from(sorted(SHAPES)),
    share=st.floats(0.05, 1.0),
    shake=st.floats(0.0, 0.3),
    seed=st.integers(0, 1_000),
)
def test_count_topology_and_held_points_are_kept(name, share, shake, seed):
    surface, rng = SHAPES[name](), np.random.default_rng(seed)
    moves = rng.normal(size=surface.points.shape) * shake * surface.edge_lengths.mean()
    surface = Surface(surface.points + moves, surface.faces)
    held = rng.random(surface.n_points) < 0.3 * share
    n = max(int(share * surface.n_points), 20)
    result = decimated(surface, n, held)
    if result is None:  # not all of it can be reached with sound triangles
        assert share < 0.5
        return
    assert result.n_points == n
    assert euler_characteristic(result.faces) == euler_characteristic(surface.faces)
    assert connected_components(result.faces, n)[0] == connected_components(surface.faces, surface.n_points)[0]
    assert len(boundary_loops(result.faces)) == len(boundary_loops(surface.faces))
    assert is_oriented(result.faces)
    assert len(nonmanifold_points(result.faces)) == 0
    assert result.edge_face_count.max() <= 2
    kept = {tuple(point) for point in result.points.tolist()}
    assert all(tuple(point) in kept for point in surface.points[held].tolist())


@pytest.mark.parametrize("name", ["sphere", "torus", "part"])
def test_it_is_about_as_near_as_the_decimation_of_vtk(name):
    surface = SHAPES[name]()
    surface = surface.with_points(surface.points / surface.diagonal)
    n = surface.n_points // 4
    held = corners(surface, sharp_edges(surface, 40.0))
    mine, other = decimated(surface, n, held), METHODS["vtk-quadric"].run(surface, n, 0, {}).surface
    rms = [surface_distance(surface, mesh, samples=20_000).rms for mesh in (mine, other)]
    assert rms[0] < 1.25 * rms[1] + 1e-9


def test_a_box_keeps_its_eight_corners_alone():
    box = shapes.box(n=5)
    result = decimated(box, 8, nothing_held(box))
    assert {tuple(np.round(point, 6)) for point in result.points} == {
        (x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)
    }
    assert surface_distance(box, result, samples=2_000).hausdorff < 1e-6


def test_a_square_sheet_keeps_its_outline():
    sheet = shapes.open_patch(lambda x, y: 0.0 * x, n=9)
    result = decimated(sheet, 4, nothing_held(sheet))
    assert result.area == pytest.approx(sheet.area, rel=1e-6)


def test_the_cheapest_edge_goes_first():
    """The costs are computed anew with dense algebra."""
    sphere = shapes.sphere(2)
    moves = 0.1 * np.random.default_rng(5).normal(size=sphere.points.shape) * sphere.edge_lengths.mean()
    surface = Surface(sphere.points + moves, sphere.faces)
    planes = np.concatenate(
        [
            surface.face_normals,
            -np.einsum("fx,fx->f", surface.face_normals, surface.points[surface.faces[:, 0]])[:, None],
        ],
        axis=1,
    )
    quadric = np.zeros((surface.n_points, 4, 4))
    for face, corner in enumerate(surface.faces):
        quadric[corner] += surface.face_areas[face] * np.outer(planes[face], planes[face])
    costs = []
    for p, q in surface.edges:
        total = quadric[p] + quadric[q]
        place = np.append(np.linalg.solve(total[:3, :3], -total[:3, 3]), 1.0)
        costs.append(place @ total @ place)
    p, q = surface.edges[int(np.argmin(costs))]
    result = decimated(surface, surface.n_points - 1, nothing_held(surface))
    left = {tuple(point) for point in result.points.tolist()}
    gone = [k for k in range(surface.n_points) if tuple(surface.points[k].tolist()) not in left]
    assert set(gone) == {p, q}


@given(seed=st.integers(0, 10_000))
def test_quadrics_are_sums_of_squared_distances_with_the_lowest_place(seed):
    rng = np.random.default_rng(seed)
    normals, points, weights = rng.normal(size=(6, 3)), rng.normal(size=(6, 3)), rng.random(6)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    quadric = np.zeros(10)
    for normal, point, weight in zip(normals, points, weights, strict=True):
        quadrics.add_plane.py_func(quadric, weight, normal, point)

    def value(place):
        return (weights * np.einsum("nx,nx->n", normals, place - points) ** 2).sum()

    place = rng.normal(size=3)
    assert quadrics.quadric_value.py_func(quadric, place) == pytest.approx(value(place), rel=1e-9, abs=1e-12)
    lowest = place + np.array(quadrics.quadric_step(quadric, tuple(place.tolist()), 1e-12))
    for _ in range(5):
        assert value(lowest) <= value(lowest + 0.1 * rng.normal(size=3)) + 1e-9
    assert quadrics.quadric_trace(quadric) == pytest.approx(weights.sum())


def test_a_count_that_held_points_do_not_allow_is_not_reached():
    sphere = shapes.sphere(2)
    assert decimated(sphere, 20, np.ones(sphere.n_points, dtype=bool)) is None
    assert decimated(sphere, sphere.n_points + 1, nothing_held(sphere)) is None
    same = decimated(sphere, sphere.n_points, nothing_held(sphere))
    np.testing.assert_array_equal(same.points, sphere.points)


def test_a_heap_that_overflows_is_filled_anew(monkeypatch):
    monkeypatch.setattr("anisomesh.fitting.decimation._HEAP_ROOM", 1)
    torus = shapes.torus(n_major=30, n_minor=12)
    result = decimated(torus, 40, nothing_held(torus))
    assert result.n_points == 40
    assert euler_characteristic(result.faces) == 0
    assert kernels.decimate.signatures


def test_parts_of_long_triangles_are_decimated_as_well():
    """The caps of the cylinder are fans of needles, and its wall strips a hundred times as long as they are wide."""
    cylinder = trimesh.creation.cylinder(radius=0.1, height=1.0, sections=400)
    surface = Surface(np.array(cylinder.vertices), np.array(cylinder.faces))
    result = decimated(surface, 120, corners(surface, sharp_edges(surface, 40.0)))
    other = METHODS["vtk-quadric"].run(surface, 120, 0, {}).surface
    rms = [surface_distance(surface, mesh, samples=20_000).rms for mesh in (result, other)]
    assert rms[0] < 1.25 * rms[1]
    assert result.volume == pytest.approx(surface.volume, rel=0.01)
