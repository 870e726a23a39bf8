"""Quadric decimation keeps topology, outline, creases and held points, and is as near as others."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from anisomesh._kernels import decimate as kernels
from anisomesh._kernels import quadrics
from anisomesh.bench.methods import METHODS
from anisomesh.execution.deadline import Deadline
from anisomesh.features.detect import corners, sharp_edges
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.distance import surface_distance
from anisomesh.mesh.geometry import thickness
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import (
    boundary_loops,
    connected_components,
    count_nonmanifold_points,
    euler_characteristic,
    is_oriented,
)
from anisomesh.mesh.validity import inverted_faces
from anisomesh.meshops.decimation import decimate, decimate_facing, ends_of_creases
from anisomesh.shapes import analytic as shapes
from anisomesh.shapes.cad_part import cad_part

SHAPES = {
    "sphere": lambda: shapes.sphere(3),
    "torus": lambda: shapes.torus(n_major=30, n_minor=12),
    "part": lambda: cad_part(6),
    "open patch": lambda: shapes.open_patch(lambda x, y: 0.3 * np.sin(4 * x) * y, n=15),
}


@pytest.mark.parametrize("moves", [True, False])
@given(
    name=st.sampled_from(sorted(SHAPES)),
    share=st.floats(0.05, 1.0),
    shake=st.floats(0.0, 0.3),
    seed=st.integers(0, 1_000),
)
def test_count_topology_and_held_points_are_kept(moves, name, share, shake, seed):
    surface, rng = SHAPES[name](), np.random.default_rng(seed)
    away = rng.normal(size=surface.points.shape) * shake * surface.edge_lengths.mean()
    surface = Surface(surface.points + away, surface.faces)
    held = rng.random(surface.n_points) < 0.3 * share
    n = max(int(share * surface.n_points), 20)
    result = decimate(surface, n, held=held, moves=moves).surface
    if share > 0.5 or shake < 0.1:  # less than that may not be reached with sound triangles
        assert result.n_points == n
    assert euler_characteristic(result.faces) == euler_characteristic(surface.faces)
    assert (
        connected_components(result.faces, result.n_points)[0]
        == connected_components(surface.faces, surface.n_points)[0]
    )
    assert len(boundary_loops(result.faces)) == len(boundary_loops(surface.faces))
    assert is_oriented(result.faces)
    assert count_nonmanifold_points(result.faces) == 0
    assert result.edge_face_count.max() <= 2
    kept = {tuple(point) for point in result.points.tolist()}
    assert all(tuple(point) in kept for point in surface.points[held].tolist())
    before = {tuple(point) for point in surface.points.tolist()}
    assert moves or kept <= before
    assert {tuple(point) for point in result.points[result.on_boundary].tolist()} <= before


@pytest.mark.parametrize("name", ["sphere", "torus", "part"])
def test_it_is_about_as_near_as_the_decimation_of_vtk(name):
    surface = SHAPES[name]()
    surface = surface.with_points(surface.points / surface.diagonal)
    n = surface.n_points // 4
    held = corners(surface, sharp_edges(surface, 40.0))
    mine, other = decimate(surface, n, held=held).surface, METHODS["vtk-quadric"].run(surface, n, 0, {}).surface
    rms = [surface_distance(surface, mesh, samples=20_000).rms for mesh in (mine, other)]
    assert rms[0] < 1.25 * rms[1] + 1e-9


def test_a_box_keeps_its_eight_corners_alone():
    box = shapes.box(n=5)
    result = decimate(box, 8).surface
    assert {tuple(np.round(point, 6)) for point in result.points} == {
        (x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)
    }
    assert surface_distance(box, result, samples=2_000).hausdorff < 1e-6


def test_a_square_sheet_keeps_its_outline():
    sheet = shapes.open_patch(lambda x, y: 0.0 * x, n=9)
    result = decimate(sheet, 4).surface
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
    result = decimate(surface, surface.n_points - 1).surface
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
    for n in (20, sphere.n_points, sphere.n_points + 1):
        same = decimate(sphere, n, held=np.ones(sphere.n_points, dtype=bool)).surface
        np.testing.assert_array_equal(same.points, sphere.points)
        np.testing.assert_array_equal(same.faces, sphere.faces)


def test_a_heap_that_overflows_is_filled_anew(monkeypatch):
    monkeypatch.setattr("anisomesh.meshops.decimation._HEAP_ROOM", 1)
    torus = shapes.torus(n_major=30, n_minor=12)
    result = decimate(torus, 40).surface
    assert result.n_points == 40
    assert euler_characteristic(result.faces) == 0
    assert kernels.decimate.signatures


def test_parts_of_long_triangles_are_decimated_as_well():
    """The caps of the cylinder are fans of needles, and its wall strips a hundred times as long as they are wide."""
    cylinder = trimesh.creation.cylinder(radius=0.1, height=1.0, sections=400)
    surface = Surface(np.array(cylinder.vertices), np.array(cylinder.faces))
    result = decimate(surface, 120, held=corners(surface, sharp_edges(surface, 40.0))).surface
    other = METHODS["vtk-quadric"].run(surface, 120, 0, {}).surface
    rms = [surface_distance(surface, mesh, samples=20_000).rms for mesh in (result, other)]
    assert rms[0] < 1.25 * rms[1]
    assert result.volume == pytest.approx(surface.volume, rel=0.01)


def test_a_tetrahedron_stays():
    tetrahedron = Surface(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    result = decimate(tetrahedron, 1).surface
    assert result.n_points == result.n_faces == 4


def test_a_triangle_in_an_open_mesh_is_the_last_one():
    sheet = shapes.open_patch(lambda x, y: x * y, n=4)
    result = decimate(sheet, 1).surface
    assert result.n_points >= 3
    assert euler_characteristic(result.faces) == 1


def test_a_square_tube_keeps_its_topology_down_to_few_points():
    """A thin tube with many bends: what collapses is often flat, or half way between two walls."""
    steps = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0], [0, 0, -1]] * 4)
    path = np.cumsum(np.repeat(steps, 2, axis=0), axis=0)
    surface = cubes_boundary(np.unique(path, axis=0))
    result = decimate(surface, 8).surface
    assert result.n_points < 0.9 * surface.n_points
    assert thickness(result.points[result.faces]).min() >= 1e-4
    assert is_oriented(result.faces)
    assert euler_characteristic(result.faces) == euler_characteristic(surface.faces) == 2


def cubes_boundary(cubes):
    """Return the boundary of a union of unit cubes, at integer corners, that share faces only."""
    quads = []
    filled = {tuple(cube) for cube in cubes.tolist()}
    for cube in filled:
        for axis in range(3):
            for side in (0, 1):
                across = list(cube)
                across[axis] += 2 * side - 1
                if tuple(across) not in filled:
                    corner = np.array(cube)
                    corner[axis] += side
                    u, v = np.roll(np.eye(3, dtype=int), axis, axis=1)[1:]
                    loop = [corner, corner + u, corner + u + v, corner + v]
                    quads.append(loop if side else loop[::-1])
    corners = np.array(quads, dtype=float).reshape(-1, 3)
    points, index = np.unique(corners, axis=0, return_inverse=True)
    index = index.reshape(-1, 4)
    return Surface(points, np.concatenate([index[:, [0, 1, 2]], index[:, [0, 2, 3]]]))


def test_a_component_of_one_triangle_is_not_collapsed():
    """Regression: the link condition alone lets a triangle without neighbours go."""
    ball = shapes.sphere(2)
    points = np.concatenate([ball.points, [[3.0, 0, 0], [4, 0, 0], [3, 1, 0]]])
    faces = np.concatenate([ball.faces, np.arange(ball.n_points, ball.n_points + 3, dtype=np.int32)[None]])
    coarse = decimate(Surface(points, faces), 10).surface
    assert connected_components(coarse.faces, coarse.n_points)[0] == 2
    assert euler_characteristic(coarse.faces) == 3


def test_points_of_creases_only_go_along_them():
    """The creases are two loops around a torus, smooth all around, and one path that ends."""
    torus = shapes.torus(n_major=30, n_minor=12)
    around = np.flatnonzero(np.abs(torus.points[:, 2]) < 1e-9)
    inner = around[np.linalg.norm(torus.points[around, :2], axis=1) < 1.0]
    chosen = torus.edges[np.isin(torus.edges, inner).all(axis=1)]
    assert len(chosen) == 30
    result = decimate(torus, 60, crease_edges=chosen.astype(np.int64))
    ends = result.surface.points[result.crease_edges]
    assert 3 <= len(ends) < 30
    assert np.abs(ends[..., 2]).max() < 0.02
    assert np.bincount(result.crease_edges.ravel())[np.unique(result.crease_edges)].tolist() == [2] * len(ends)
    assert euler_characteristic(result.surface.faces) == 0


def test_creases_do_not_vanish_in_each_other():
    """A triangle with creases on all sides, in a smooth surface, cannot get smaller."""
    sphere = shapes.sphere(3)
    face = sphere.faces[100]
    loop = np.stack([face, np.roll(face, -1)], axis=1).astype(np.int64)
    result = decimate(sphere, 40, crease_edges=loop)
    assert result.surface.n_points == 40
    assert len(result.crease_edges) == 3


def test_ends_of_creases_stay_in_place():
    sphere = shapes.sphere(3)
    path = [0]
    for _ in range(6):
        ring = np.unique(sphere.edges[(sphere.edges == path[-1]).any(axis=1)])
        path.append(int(ring[np.argmax(sphere.points[ring, 0])]))
    path = list(dict.fromkeys(path))
    links = np.stack([path[:-1], path[1:]], axis=1)
    assert ends_of_creases(links, sphere.n_points).sum() == 2
    result = decimate(sphere, 40, crease_edges=links)
    ends = result.surface.points[np.flatnonzero(ends_of_creases(result.crease_edges, result.surface.n_points))]
    assert {tuple(point) for point in ends.tolist()} == {
        tuple(point) for point in sphere.points[[path[0], path[-1]]].tolist()
    }


def pyramids_and_waves(x, y):
    ridge = np.minimum(np.abs(8.0 * (x + 1.0) % 2.0 - 1.0), np.abs(8.0 * (y + 1.0) % 2.0 - 1.0))
    return np.where(x < 0.0, 0.3 * ridge, 0.6 * np.sin(np.pi * x) * np.cos(0.5 * np.pi * y))


def nothing_stays(surface):
    return {"held": np.zeros(surface.n_points, dtype=bool), "crease_edges": np.zeros((0, 2), dtype=np.int64)}


@pytest.mark.parametrize("n", [150, 200, 300])
def test_no_triangle_is_inverted_against_the_reference(n):
    """Steep pyramids beside waves: collapses of least error leave triangles below the tips."""
    sheet = shapes.open_patch(pyramids_and_waves, n=30)
    reference = ClosestPoints(sheet)
    free = decimate(sheet, n, moves=False).surface
    result = decimate_facing(sheet, n, reference, **nothing_stays(sheet)).surface
    assert not inverted_faces(result, reference).any()
    assert result.n_points == n
    assert n > 150 or inverted_faces(free, reference).any()


def test_when_time_is_over_it_is_not_repeated_for_inverted_triangles():
    sheet = shapes.open_patch(pyramids_and_waves, n=30)
    over = Deadline(limit=1.0, start=-np.inf)
    free = decimate(sheet, 150, moves=False).surface
    result = decimate_facing(sheet, 150, ClosestPoints(sheet), **nothing_stays(sheet), deadline=over).surface
    assert inverted_faces(result, ClosestPoints(sheet)).any()
    np.testing.assert_array_equal(result.points, free.points)
    np.testing.assert_array_equal(result.faces, free.faces)


@given(seed=st.integers(0, 1_000), share=st.floats(0.1, 0.9))
def test_creases_on_an_open_surface_keep_its_topology(seed, share):
    """Regression: the crease edge between two points of the boundary was collapsed, which pinched the sheet."""
    rng = np.random.default_rng(seed)
    sheet = shapes.open_patch(lambda x, y: 0.2 * x * y, n=6)
    chosen = sheet.edges[rng.random(len(sheet.edges)) < 0.3].astype(np.int64)
    result = decimate(sheet, int(share * sheet.n_points), crease_edges=chosen).surface
    assert count_nonmanifold_points(result.faces) == 0
    assert len(boundary_loops(result.faces)) == 1
    assert euler_characteristic(result.faces) == 1


def test_an_edge_across_a_strip_stays():
    """Regression: it fulfils the link condition, but both its ends are on the boundary."""
    points = np.array([[k, side, 0.0] for k in range(6) for side in (0.0, 1.0)])
    faces = np.array([face for k in range(0, 10, 2) for face in ([k, k + 2, k + 1], [k + 1, k + 2, k + 3])])
    strip = Surface(points, faces)
    across = np.array([[k, k + 1] for k in range(2, 10, 2)])
    result = decimate(strip, 3, crease_edges=across).surface
    assert count_nonmanifold_points(result.faces) == 0
    assert len(boundary_loops(result.faces)) == 1
