"""Distances between surfaces that are known."""

import json

import numpy as np
import pytest

from anisomesh.errors import OptionError
from anisomesh.mesh.distance import hausdorff_distance, squared_distances, surface_distance
from anisomesh.mesh.sampling import points_on_faces
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import ellipsoid, open_patch, sphere, torus


def plane(n=6):
    return open_patch(lambda x, y: 0.0 * x, n=n)


@pytest.mark.parametrize("shape", [sphere(2), torus(1.0, 0.3, 20, 10), plane()])
def test_surface_is_at_distance_zero_from_itself(shape):
    distance = surface_distance(shape, shape, samples=2000)
    assert distance.hausdorff < 1e-7
    assert distance.rms < 1e-7


@pytest.mark.parametrize("lift", [1e-3, 0.2, 3.0])
def test_lifted_plane_is_everywhere_equally_far(lift):
    below = plane()
    above = below.with_points(below.points + np.array([0, 0, lift]))
    distance = surface_distance(below, above, samples=500)
    found = (distance.max_ab, distance.max_ba, distance.rms_ab, distance.rms_ba, distance.rms, distance.hausdorff)
    np.testing.assert_allclose(found, lift, rtol=1e-9)


def test_shifted_plane_is_far_only_where_it_stands_out():
    one = plane()
    other = one.with_points(one.points + np.array([0.5, 0, 0]))
    distance = surface_distance(one, other, samples=200_000)
    assert distance.max_ab == pytest.approx(0.5)
    assert distance.max_ba == pytest.approx(0.5)
    expected = 0.5**3 / 3 / 2.0
    assert distance.mean_square_ab == pytest.approx(expected, rel=0.02)
    assert distance.mean_square_ba == pytest.approx(expected, rel=0.02)


def test_concentric_spheres():
    small, large = sphere(4, 1.0), sphere(4, 1.25)
    distance = surface_distance(small, large, samples=5000)
    for found in (distance.max_ab, distance.max_ba, distance.rms_ab, distance.rms_ba):
        assert found == pytest.approx(0.25, rel=0.02)


def test_part_against_whole_is_one_sided():
    whole = plane(8)
    part = Surface(whole.points, whole.faces[whole.points[whole.faces][:, :, 0].max(axis=1) <= 1e-9])
    distance = surface_distance(part, whole, samples=2000)
    assert distance.max_ab < 1e-9
    assert distance.max_ba == pytest.approx(1.0)
    assert distance.hausdorff == pytest.approx(1.0)


def test_maximum_is_found_at_points_and_midpoints_whatever_the_samples():
    flat = plane(2)
    points = flat.points.copy()
    centre = np.flatnonzero((points == 0).all(axis=1))
    points[centre, 2] = 0.3
    assert surface_distance(flat.with_points(points), flat, samples=1).max_ab == pytest.approx(0.3)
    square = Surface(np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    ridge = np.array([[0.0, -1, 0.5], [0, 1, 0.5]])
    tent_faces = np.array([[0, 4, 5], [0, 5, 3], [4, 1, 2], [4, 2, 5]])
    tent = Surface(np.concatenate([square.points, ridge]), tent_faces)
    assert surface_distance(square, tent, samples=1).max_ab == pytest.approx(0.5 / np.sqrt(1.25))


def test_points_without_faces_do_not_count():
    ball = sphere(1)
    more = Surface(np.concatenate([ball.points, [[50.0, 0, 0]]]), ball.faces)
    assert surface_distance(more, ball, samples=100).hausdorff < 1e-7


def test_distance_to_a_triangle_against_a_search_over_its_points():
    rng = np.random.default_rng(0)
    triangle = Surface(rng.standard_normal((3, 3)), np.array([[0, 1, 2]]))
    u, v = np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 201))
    u, v = u[u + v <= 1], v[u + v <= 1]
    cloud = np.stack([1 - u - v, u, v], axis=1) @ triangle.points
    queries = 2 * rng.standard_normal((40, 3))
    searched = np.linalg.norm(queries[:, None] - cloud[None], axis=2).min(axis=1)
    exact = np.sqrt(squared_distances(queries, triangle))
    assert (exact <= searched + 1e-12).all()
    np.testing.assert_allclose(exact, searched, atol=0.01)


def test_samples_are_uniform_by_area():
    surface = ellipsoid((1.0, 0.5, 0.2), 2)
    samples, _ = points_on_faces(surface, 40_000, np.random.default_rng(0))
    assert squared_distances(samples, surface).max() < 1e-20
    share = surface.face_areas / surface.area
    upper = surface.points[surface.faces].mean(axis=1)[:, 0] > 0.3
    by_area = (share[:, None] * surface.points[surface.faces].mean(axis=1)).sum(axis=0)
    np.testing.assert_allclose(samples.mean(axis=0), by_area, atol=0.01)
    assert np.mean(samples[:, 0] > 0.3) == pytest.approx(share[upper].sum(), abs=0.03)


def test_same_seed_gives_the_same_result():
    a, b = sphere(2), ellipsoid((1.0, 0.9, 0.8), 2)
    assert surface_distance(a, b, 1000, 5) == surface_distance(a, b, 1000, 5)
    assert surface_distance(a, b, 1000, 5) != surface_distance(a, b, 1000, 6)
    assert surface_distance(a, b, 1000, np.random.default_rng(5)) == surface_distance(a, b, 1000, 5)


def test_surface_without_area_can_be_measured():
    line = Surface(np.outer(np.arange(3.0), [1, 0, 0]), np.array([[0, 1, 2]]))
    distance = surface_distance(line, plane(), samples=50)
    assert distance.max_ab == pytest.approx(1.0)


def test_values_can_be_written_as_json():
    values = surface_distance(sphere(1), sphere(2), samples=10).as_dict()
    assert json.loads(json.dumps(values)) == values
    assert {"max_ab", "max_ba", "mean_square_ab", "mean_square_ba", "rms", "hausdorff"} <= set(values)


def test_no_sample_is_refused():
    with pytest.raises(OptionError, match="samples"):
        surface_distance(sphere(0), sphere(0), samples=0)


def test_no_place_off_the_surface_is_taken_for_a_maximum():
    """A step out of a triangle on all three sides at once gave the origin, which may be far from both surfaces."""
    ball = sphere(0)
    assert max(hausdorff_distance(ball, ball, samples=1_000, seed=seed) for seed in range(50)) < 1e-7


@pytest.mark.parametrize("seed", range(5))
def test_the_hausdorff_distance_is_found_between_samples(seed):
    """A bump off the middle of one large triangle, narrower than the distance of samples, is farthest at its tip."""
    rng = np.random.default_rng(seed)
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    tip = rng.dirichlet([4.0, 4.0, 4.0]) @ corners
    base = tip + 0.12 * np.array([[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.5, -0.8, 0.0]])
    flat = Surface(np.concatenate([corners, base]), [[0, 1, 2], [3, 4, 5]])
    bump = Surface(
        np.concatenate([corners, base, tip[None] + np.array([[0.0, 0.0, 0.1]])]),
        [[0, 1, 2], [3, 4, 6], [4, 5, 6], [5, 3, 6]],
    )
    assert hausdorff_distance(flat, bump, samples=200) == pytest.approx(0.1)
    # from the flat triangle to one without it: farthest inside, where no vertex is
    fan = Surface(np.concatenate([corners, tip[None] - np.array([[0.0, 0.0, 0.3]])]), [[0, 1, 3], [1, 2, 3], [2, 0, 3]])
    single = Surface(corners, [[0, 1, 2]])
    steps = np.linspace(0.0, 1.0, 400)
    grid = np.array([(u, v, 1.0 - u - v) for u in steps for v in steps if u + v <= 1.0]) @ corners
    exact = max(np.sqrt(squared_distances(grid, fan).max()), np.sqrt(squared_distances(fan.points, single).max()))
    found = hausdorff_distance(single, fan, samples=50)
    assert found == pytest.approx(exact, rel=2e-3)
