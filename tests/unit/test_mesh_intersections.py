"""Pairs of triangles that intersect, against clipping in exact rational arithmetic."""

import itertools
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anisomesh._kernels import orientation
from anisomesh.mesh.intersections import count_intersections_from, self_intersections
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import box, cylinder, open_patch, sphere, torus
from conftest import examples


def minus(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def normal_of(triangle):
    return cross(minus(triangle[1], triangle[0]), minus(triangle[2], triangle[0]))


def clipped(polygon, normal, origin):
    """Return the part of a convex polygon, which may be a segment or a point, in the closed half-space."""
    kept = []
    heights = [dot(normal, minus(p, origin)) for p in polygon]
    for k, (p, height) in enumerate(zip(polygon, heights, strict=True)):
        q, following = polygon[(k + 1) % len(polygon)], heights[(k + 1) % len(polygon)]
        if height >= 0:
            kept.append(p)
        if height * following < 0:
            t = Fraction(height) / (height - following)
            kept.append([x + t * (y - x) for x, y in zip(p, q, strict=True)])
    return kept


def common_points(first, second):
    """Return points of which the convex hull is what two closed triangles have in common."""
    for c in range(3):
        a, b = [p[c] for p in first], [p[c] for p in second]
        if max(a) < min(b) or max(b) < min(a):
            return []
    normal = normal_of(second)
    polygon = clipped(first, normal, second[0])
    polygon = clipped(polygon, [-x for x in normal], second[0])
    for k in range(3):
        start, end = second[k], second[(k + 1) % 3]
        polygon = clipped(polygon, cross(normal, minus(end, start)), start)
    return polygon


def triangles_meet(first, second):
    """Return whether two triangles with area meet in more than the corners and the edge they have in common."""
    shared = [p for p in first if p in second]
    common = common_points(first, second)
    if len(shared) == 3:
        return True
    if len(shared) == 2:
        along = minus(shared[1], shared[0])
        return any(any(cross(along, minus(p, shared[0]))) for p in common)
    return any(p not in shared for p in common)


def exact(points):
    """Return coordinates as integers, in a power of two as unit; integers are faster than rational numbers."""
    ratios = [[float(x).as_integer_ratio() for x in row] for row in points]
    unit = max(denominator for row in ratios for _, denominator in row)
    return [[numerator * (unit // denominator) for numerator, denominator in row] for row in ratios]


def naive_pairs(surface):
    corners = exact(surface.points)
    triangles = [[corners[p] for p in face] for face in surface.faces.tolist()]
    with_area = [f for f, triangle in enumerate(triangles) if any(normal_of(triangle))]
    return [[i, j] for i, j in itertools.combinations(with_area, 2) if triangles_meet(triangles[i], triangles[j])]


def joined(*surfaces):
    starts = np.cumsum([0, *(s.n_points for s in surfaces)])
    faces = [s.faces + start for s, start in zip(surfaces, starts, strict=False)]
    return Surface(np.concatenate([s.points for s in surfaces]), np.concatenate(faces))


def rotation(seed):
    return np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]


@st.composite
def soups(draw, n_faces=50, tops=(1, 2, 3, 5)):
    """Triangles on few points of a small grid, some grids flat: many touch, share points, coincide or have no area."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    top, height = draw(st.sampled_from(tops)), draw(st.sampled_from([0, 1, 5]))
    points = rng.integers(0, [top, top, min(top, height)], size=(draw(st.integers(8, 30)), 3), endpoint=True)
    return Surface(points, rng.integers(0, len(points), size=(n_faces, 3)))


# Images of the grid under which what was coplanar or touched does so no longer, by a rounding error.
def shift(points):
    return points * 0.1 + 1e6


def turn(points):
    return points @ rotation(0).T


def shear(points):
    return points @ np.array([[1.0, 0.1, 0.3], [0, 1 / 3, 0.7], [0.2, 0, 1]])


def shrink(points):
    return points @ rotation(1).T * 1e-9


@examples(60)
@given(soups())
def test_pairs_on_a_grid_match_exact_arithmetic(soup):
    assert self_intersections(soup).tolist() == naive_pairs(soup)


@pytest.mark.slow
@pytest.mark.parametrize("image", [shift, turn, shear, shrink])
@examples(20)
@given(soup=soups(tops=(2, 5)))
def test_pairs_within_a_rounding_error_of_touching_are_exact(image, soup):
    soup = soup.with_points(image(soup.points))
    assert self_intersections(soup).tolist() == naive_pairs(soup)


@examples(20)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e6]))
def test_pairs_among_long_thin_oblique_triangles_are_exact(seed, offset):
    rng = np.random.default_rng(seed)
    along, width = rng.normal(size=3), 1e-3
    start = rng.normal(size=(40, 1, 3)) * 0.1
    corners = start + rng.uniform(0.5, 1.0, size=(40, 3, 1)) * along + width * rng.normal(size=(40, 3, 3)) + offset
    soup = Surface(corners.reshape(-1, 3), np.arange(120).reshape(-1, 3))
    assert self_intersections(soup).tolist() == naive_pairs(soup)


@examples(50)
@given(soups(), st.randoms(use_true_random=False), st.sampled_from([-1000, -60, -1, 7, 1000]))
def test_pairs_do_not_depend_on_order_scale_or_axes(soup, random, exponent):
    pairs = self_intersections(soup)
    order = random.sample(range(soup.n_faces), soup.n_faces)
    turned = [np.roll(soup.faces[f], random.randrange(3))[:: random.choice([1, -1])] for f in order]
    shuffled = np.sort(np.array(order)[self_intersections(Surface(soup.points, np.array(turned)))], axis=1)
    assert sorted(shuffled.tolist()) == pairs.tolist()
    axes = random.sample(range(3), 3)
    signs = np.array([random.choice([1.0, -1.0]) for _ in axes])
    image = soup.with_points(np.ldexp(soup.points, exponent)[:, axes] * signs)
    assert self_intersections(image).tolist() == pairs.tolist()


@examples(50)
@given(soups(), st.integers(0, 20))
def test_pairs_with_the_last_faces_are_counted_as_they_are_found(soup, last):
    first = max(0, soup.n_faces - last)
    wanted = np.count_nonzero(self_intersections(soup).max(axis=1, initial=-1) >= first)
    assert count_intersections_from(first, soup.points, soup.faces) == wanted


A, B, C = [0, 0, 0], [4, 0, 0], [0, 4, 0]  # the first of two triangles
PLACES = {
    "above": ([0, 0, 1], [4, 0, 1], [0, 4, 1], False),
    "beside, in the same plane": ([5, 0, 0], [9, 0, 0], [5, 4, 0], False),
    "in the plane, within the box of the other": ([4, 4, 0], [4, 1, 0], [3, 4, 0], False),
    "pierced": ([1, 1, -1], [1, 1, 1], [9, 9, 1], True),
    "passes in front of a corner": ([-1, 0, -2], [-1, 0, 2], [0, -1, 0], False),
    "a corner on the inside": ([1, 1, 0], [1, 1, 3], [2, 1, 3], True),
    "a corner on an edge": ([2, 2, 0], [1, 1, 3], [2, 1, 3], True),
    "an edge across a corner": ([-1, 1, 0], [1, -1, 0], [0, 0, 3], True),
    "edges cross": ([2, 0, 1], [2, 0, -1], [2, -3, 0], True),
    "edges overlap, planes differ": ([1, 0, 0], [6, 0, 0], [1, 0, 3], True),
    "edges on one line, apart": ([5, 0, 0], [6, 0, 0], [5, 0, 3], False),
    "edges overlap in the plane": ([1, 0, 0], [6, 0, 0], [1, -3, 0], True),
    "a corner on an edge in the plane": ([2, 2, 0], [9, 2, 0], [9, 9, 0], True),
    "inside, in the plane": ([1, 1, 0], [2, 1, 0], [1, 2, 0], True),
    "around, in the plane": ([-1, -1, 0], [9, -1, 0], [-1, 9, 0], True),
    "star in the plane": ([3, 3, 0], [-1, 3, 0], [3, -1, 0], True),
    "one point common": (A, [-4, 0, 0], [-4, -4, 1], False),
    "one point common, in the plane": (A, [-4, 0, 0], [0, -4, 0], False),
    "one point common, edges overlap": (A, [2, 0, 0], [2, 0, 3], True),
    "one point common, edges overlap in the plane": (A, [2, 0, 0], [2, -3, 0], True),
    "one point common, edges on one line on either side": (A, [-2, 0, 0], [-2, 0, 3], False),
    "one point common, wedge within wedge": (A, [9, 4, 0], [4, 9, 0], True),
    "one point common, wedges cross": (A, [1, 1, 0], [-1, 1, 0], True),
    "one point common, pierced": (A, [1, 1, -1], [1, 1, 1], True),
    "one point common, the other pierces": (A, [9, 9, -1], [9, 9, 1], True),
    "one point common, passes aside": (A, [-1, -1, -1], [-1, -1, 1], False),
    "one edge common": (A, B, [0, 4, 1], False),
    "one edge common, flat": (A, B, [1, -4, 0], False),
    "one edge common, folded": (A, B, [9, 1, 0], True),
    "one edge common, almost folded": (A, B, [1, 4, 1e-80], False),
    "the same": (A, B, C, True),
    "the same, reversed": (C, B, A, True),
    "no area": ([1, 1, 0], [2, 1, 0], [3, 1, 0], False),
    "no area, across": ([1, 1, -1], [1, 1, 0], [1, 1, 1], False),
    "no area, a point twice": (A, A, [1, 1, 1], False),
}


@pytest.mark.parametrize("corners", PLACES.values(), ids=PLACES.keys())
@pytest.mark.parametrize("welded", [True, False])
def test_two_triangles(corners, welded):
    points, faces = np.array([A, B, C, *corners[:3]], dtype=float), np.array([[0, 1, 2], [3, 4, 5]])
    if welded:
        points, faces = np.unique(points[faces.ravel()], axis=0, return_inverse=True)
    expected = [[0, 1]] if corners[3] else []
    for turns in itertools.product(itertools.permutations(range(3)), repeat=2):
        rows = np.stack([row[list(turn)] for row, turn in zip(faces.reshape(2, 3), turns, strict=True)])
        for both in (rows, rows[::-1]):
            pairs = self_intersections(Surface(points, both))
            assert pairs.tolist() == expected
            assert pairs.shape == (len(expected), 2)
            assert pairs.dtype == np.int32


def test_sheets_cut_apart_along_an_edge_do_not_touch():
    patch = open_patch(lambda x, y: 0.1 * x * y, n=6)
    apart = Surface(patch.points[patch.faces.ravel()], np.arange(3 * patch.n_faces).reshape(-1, 3))
    assert len(self_intersections(apart)) == 0
    moved = joined(patch, patch.with_points(patch.points + np.array([0.0, 0.0, 1e-12])))
    assert len(self_intersections(moved)) == 0
    assert len(self_intersections(joined(patch, patch))) >= patch.n_faces


@pytest.mark.parametrize(
    "shape",
    [sphere(5), torus(1.0, 0.35, 96, 48), torus(1.0, 0.35, 6, 600), box(n=12), cylinder(0.3, 1.0, 24, 8)],
    ids=["sphere", "torus", "thin", "box", "cylinder"],
)
@pytest.mark.parametrize("stretch", [1.0, 1000.0])
def test_embedded_surface_has_none(shape, stretch):
    for turn in (np.eye(3), rotation(2)):
        pairs = self_intersections(shape.with_points((shape.points * [stretch, 1, 1]) @ turn.T))
        assert pairs.shape == (0, 2)
        assert pairs.dtype == np.int32


def test_overlapping_spheres_intersect_only_each_other():
    one, other = sphere(2), sphere(2)
    both = joined(one, other.with_points(other.points + np.array([0.7, 0.3, 0.2])))
    pairs = self_intersections(both)
    assert len(pairs) > 0
    assert (pairs[:, 0] < one.n_faces).all()
    assert (pairs[:, 1] >= one.n_faces).all()
    assert pairs.tolist() == naive_pairs(both)


@pytest.mark.parametrize("image", [lambda p: p, lambda p: p + 1e6, lambda p: p * 1e-9], ids=["", "far", "tiny"])
def test_flat_patch_with_a_vertex_folded_over(image):
    patch = open_patch(lambda x, y: 0.0 * x, n=6)
    inside = np.flatnonzero((np.abs(patch.points[:, :2]) < 0.4).all(axis=1))[0]
    around = np.unique(patch.faces[(patch.faces == inside).any(axis=1)])
    points = patch.points.copy()
    assert len(self_intersections(patch.with_points(image(points)))) == 0
    points[inside] += 1.75 * (points[around[0]] - points[inside])
    folded = patch.with_points(image(points))
    pairs = self_intersections(folded)
    assert pairs.tolist() == naive_pairs(folded)
    moved = (patch.faces == inside).any(axis=1)
    assert len(pairs) > 0
    assert moved[pairs].any(axis=1).all()


def test_more_pairs_than_fit_one_block():
    n = 700  # 244,650 pairs, several times the room of a block
    faces = np.concatenate([np.tile([[0, 1, 2]], (n, 1)), [[3, 4, 5]]])
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]])
    expected = np.stack(np.triu_indices(n, 1), axis=1)
    np.testing.assert_array_equal(self_intersections(Surface(points, faces)), expected)


@pytest.mark.parametrize("points", [np.zeros((3, 3)), np.outer([0.0, 1, 3], [1, 2, -1]), 1e6 + np.eye(3)[[0, 1, 1]]])
def test_surface_without_area_has_none(points):
    pairs = self_intersections(Surface(points, np.array([[0, 1, 2], [2, 1, 0]])))
    assert pairs.shape == (0, 2)
    assert pairs.dtype == np.int32


def test_faces_without_area_do_not_shift_the_others():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]])
    surface = Surface(points, np.array([[0, 1, 3], [0, 1, 2], [1, 1, 2], [2, 1, 0], [3, 0, 1]]))
    assert self_intersections(surface).tolist() == [[1, 3]]


near = st.tuples(st.integers(-3, 3), st.integers(-2, 2)).map(lambda parts: parts[0] * 0.1 + parts[1] * 2.0**-56)
coordinates = st.one_of(
    st.integers(-3, 3).map(float), near, st.floats(-1, 1).filter(lambda x: x == 0 or abs(x) > 1e-60)
)


def determinant(a, b, c, d):
    a, b, c, d = exact([a, b, c, d])
    return dot(minus(a, d), cross(minus(b, d), minus(c, d)))


@examples(500)
@given(st.lists(st.tuples(coordinates, coordinates, coordinates), min_size=4, max_size=4))
def test_orientations_are_exact(points):
    a, b, c, d = points
    volume = determinant(a, b, c, d)
    assert orientation.orient3d(np.array(points), 0, 1, 2, 3) == (volume > 0) - (volume < 0)
    for axis in range(3):
        area = normal_of(exact([a, b, c]))[axis]
        assert orientation.orient2d(np.array(points), axis, 0, 1, 2) == (area > 0) - (area < 0)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1.0, 100.0]))
def test_orientations_beside_a_line_and_a_plane_are_exact(seed, offset):
    """The last point is rounded from one on the line or the plane through the others."""
    rng = np.random.default_rng(seed)
    a, b, c = rng.uniform(-1, 1, size=(3, 3)) + offset
    s, t = rng.uniform(-2, 2, size=2)
    on_line, on_plane = a + s * (b - a), a + s * (b - a) + t * (c - a)
    points = np.array([a, b, c, on_line, on_plane])
    volume = determinant(a, b, c, on_plane)
    assert orientation.orient3d(points, 0, 1, 2, 4) == (volume > 0) - (volume < 0)
    for axis in range(3):
        area = normal_of(exact([a, b, on_line]))[axis]
        assert orientation.orient2d(points, axis, 0, 1, 3) == (area > 0) - (area < 0)
