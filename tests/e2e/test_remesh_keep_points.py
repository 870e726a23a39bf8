"""Points to keep are vertices of the result, at the same coordinates."""

import numpy as np
import pytest

import anisomesh
from anisomesh import Mesh, Surface
from anisomesh.errors import OptionError
from anisomesh.shapes.analytic import box, sphere

BOX, BALL, PLATE = box((1.0, 0.7, 0.5), n=8), sphere(3), box((1.0, 1.0, 0.005), n=10)


def some_points(surface, count, seed=0):
    return np.random.default_rng(seed).choice(surface.n_points, count, replace=False)


def cap_of(surface, height):
    faces = surface.faces[(surface.points[surface.faces][..., 2] > height).all(axis=1)]
    used, faces = np.unique(faces, return_inverse=True)
    return Surface(surface.points[used], faces.reshape(-1, 3))


def noisy_ball():
    ball = sphere(4)
    noise = 0.02 * np.random.default_rng(1).standard_normal((ball.n_points, 1))
    return ball.with_points(ball.points * (1.0 + noise))


def assert_kept(result, places):
    """Every place is a vertex to the last digit, and the mesh is valid."""
    vertices = {tuple(point) for point in result.surface.points.tolist()}
    assert {tuple(place) for place in places.tolist()} <= vertices
    faults = result.validity
    assert faults.inverted == faults.flat == faults.new_intersections == faults.nonmanifold_vertices == 0


@pytest.mark.parametrize(
    ("surface", "how"),
    [
        (BOX, {"n_vertices": 40}),
        (BALL, {"n_vertices": 200, "fit": False}),
        (PLATE, {"n_vertices": 150, "metric": "approximation"}),
        (cap_of(BALL, -0.2), {"n_vertices": 60}),
    ],
)
def test_points_stay_exactly_where_they_are(surface, how):
    shifted = surface.with_points(surface.points * 17.3 + [3.0, -40.0, 1.0 / 3.0])
    kept = some_points(surface, 30)
    result = anisomesh.remesh(shifted, keep_points=kept, **how)
    assert_kept(result, shifted.points[kept])
    assert result.surface.n_points == how["n_vertices"]


def test_points_can_be_a_mask():
    kept = some_points(BOX, 5)
    mask = np.isin(np.arange(BOX.n_points), kept)
    result = anisomesh.remesh(BOX, n_vertices=60, keep_points=mask, max_iterations=2)
    assert_kept(result, BOX.points[kept])
    with pytest.raises(OptionError, match=r"keep_points is a mask of shape \(3,\); expected"):
        anisomesh.remesh(BOX, n_vertices=60, keep_points=mask[:3])


def test_a_count_that_is_not_the_one_asked_for_is_said():
    kept = some_points(BALL, 200)
    result = anisomesh.remesh(BALL, n_vertices=200, keep_points=kept, max_iterations=2)
    told = any(f"{result.surface.n_points} vertices instead of 200" in each for each in result.warnings)
    assert told == (result.surface.n_points != 200)


def test_points_stay_where_noise_is_removed():
    ball = noisy_ball()
    kept = some_points(ball, 10)
    result = anisomesh.remesh(ball, n_vertices=300, keep_points=kept)
    assert result.noise > 0.0
    assert_kept(result, ball.points[kept])


def test_points_stay_where_a_crack_is_welded():
    low = BOX.points[BOX.faces][..., 0].mean(axis=1) < 0.5
    halves = [BOX.faces[low], BOX.faces[~low] + BOX.n_points]
    moved = BOX.points + np.array([1e-7, 0.0, 0.0])
    cracked = Surface(np.concatenate([BOX.points, moved]), np.concatenate(halves))
    kept = np.unique(halves[1])[::20]
    result = anisomesh.remesh(cracked, n_vertices=100, keep_points=kept, weld_tolerance=1e-6)
    assert result.prepare_report.points_welded > 0
    assert_kept(result, cracked.points[kept])
    both = np.intersect1d(*(np.unique(half) % BOX.n_points for half in halves))[:1]
    with pytest.raises(OptionError, match=r"which become one point with weld_tolerance"):
        anisomesh.remesh(cracked, n_vertices=100, keep_points=[*both, *(both + BOX.n_points)], weld_tolerance=1e-6)


def test_fixed_points_of_a_mesh_stay_exactly_where_they_are():
    kept = some_points(BALL, 40)
    result = anisomesh.remesh(Mesh(surface=BALL, fixed_points=kept), n_vertices=100)
    assert_kept(result, BALL.points[kept])
    assert len(result.mesh.fixed_points) == 40


@pytest.mark.slow
@pytest.mark.parametrize("surface", [BOX, BALL])
def test_points_stay_in_the_search_for_a_distance(surface):
    kept = some_points(surface, 30)
    result = anisomesh.remesh(surface, max_error=0.02, keep_points=kept)
    assert_kept(result, surface.points[kept])
    assert result.distance <= 0.02
    assert result.surface.n_points >= 30


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (np.arange(60), r"50 vertices are asked for, and keep_points and fixed points of the mesh are 60"),
        ([BOX.n_points], rf"keep_points has {BOX.n_points}; expected 0 to"),
        ([0.5], r"keep_points has shape \(1,\) and type float64"),
        ([[1, 2]], r"keep_points has shape \(1, 2\)"),
    ],
)
def test_points_that_cannot_be_kept_are_refused(given, message):
    with pytest.raises(OptionError, match=message):
        anisomesh.remesh(BOX, n_vertices=50, keep_points=given)


def test_a_point_that_no_face_uses_cannot_be_kept():
    surface = Surface(np.concatenate([BOX.points, [[9.0, 9.0, 9.0]]]), BOX.faces)
    with pytest.raises(OptionError, match=rf"keep_points has {BOX.n_points}, which the repair of the mesh removes"):
        anisomesh.remesh(surface, n_vertices=50, keep_points=[3, BOX.n_points])
