"""prepare() against a brute-force definition of oriented manifold sheets, on random soups and known cases."""

import os
from collections import Counter, defaultdict
from heapq import heappop, heappush
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anisomesh.errors import MeshError, OptionError
from anisomesh.io.meshes import load
from anisomesh.mesh import topology
from anisomesh.mesh.surface import Surface
from anisomesh.repair.prepare import Prepared, prepare
from anisomesh.shapes import analytic as shapes
from conftest import examples, pairwise

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def problems(surface: Surface) -> list[str]:
    """Everything that keeps the surface from being oriented manifold sheets, by definition and in plain loops."""
    found = []
    faces = surface.faces.tolist()
    directed = Counter((face[k], face[(k + 1) % 3]) for face in faces for k in range(3))
    found += [f"side {side} used {count} times" for side, count in directed.items() if count > 1]
    found += [f"face {face} repeats a point" for face in faces if len(set(face)) < 3]
    repeated = Counter(tuple(sorted(face)) for face in faces)
    found += [f"faces {key} occur {count} times" for key, count in repeated.items() if count > 1]
    at = defaultdict(list)
    for face in faces:
        for point in face:
            at[point].append(face)
    found += [f"point {point} is not used" for point in range(surface.n_points) if point not in at]
    for point, star in at.items():
        reached, frontier = [star[0]], [star[0]]
        while frontier:
            face = frontier.pop()
            for other in star:
                if other not in reached and len(set(face) & set(other)) == 2:
                    reached.append(other)
                    frontier.append(other)
        if len(reached) < len(star):
            found.append(f"point {point} has more than one fan")
    return found


def check(prepared: Prepared, original: Surface) -> None:
    surface = prepared.surface
    assert problems(surface) == []
    again = prepare(surface)
    assert again.surface is surface
    assert not again.report.changed
    assert again.report.lines() == []
    extent = np.abs(original.points).max()
    np.testing.assert_allclose(surface.points, original.points[prepared.point_source], rtol=0, atol=1e-13 * extent)
    assert prepared.report.changed == (surface is not original)
    assert prepared.report.components == topology.connected_components(surface.faces, surface.n_points)[0]


def n_boundary(surface: Surface) -> int:
    return int((surface.edge_face_count == 1).sum())


def volume(surface: Surface) -> float:
    a, b, c = (surface.points[surface.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


@st.composite
def soups(draw):
    n_points = draw(st.integers(3, 9))
    coordinate = st.integers(0, 2) if draw(st.booleans()) else st.floats(-1, 1, width=32)
    points = draw(st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=n_points, max_size=n_points))
    index = st.integers(0, n_points - 1)
    any_face, true_face = st.tuples(index, index, index), st.permutations(range(n_points)).map(lambda order: order[:3])
    faces = draw(st.lists(draw(st.sampled_from([any_face, true_face])), min_size=1, max_size=48))
    return Surface(np.array(points, dtype=float), np.array(faces))


@examples(300)
@given(soups())
def test_random_soup_becomes_oriented_manifold_sheets(soup):
    try:
        prepared = prepare(soup)
    except MeshError as error:
        assert "nothing is left" in str(error)
        return
    check(prepared, soup)


@examples(60)
@given(st.integers(0, 2**32 - 1), st.floats(0, 1), st.booleans())
def test_scrambled_closed_surface_comes_back_closed(seed, share, explode):
    rng = np.random.default_rng(seed)
    clean = shapes.torus(n_major=7, n_minor=5)
    faces = np.array(clean.faces)
    turned = rng.random(len(faces)) < share
    faces[turned] = faces[turned][:, ::-1]
    faces = faces[rng.permutation(len(faces))]
    points = clean.points[faces].reshape(-1, 3) if explode else clean.points
    faces = np.arange(faces.size).reshape(-1, 3) if explode else faces
    scrambled = Surface(points, np.concatenate([faces, faces[:3]]))
    prepared = prepare(scrambled)
    check(prepared, scrambled)
    assert prepared.surface.n_points == clean.n_points
    assert n_boundary(prepared.surface) == 0
    assert prepared.report.faces_duplicate == 3
    assert abs(volume(prepared.surface)) == pytest.approx(volume(clean), rel=1e-12)


@pytest.mark.parametrize("name", sorted(shapes.SAMPLES))
def test_clean_surface_is_returned_itself(name):
    clean = shapes.sample(name)
    prepared = prepare(clean)
    assert prepared.surface is clean
    np.testing.assert_array_equal(prepared.point_source, np.arange(clean.n_points))
    check(prepared, clean)


def two_boxes(shift, n=2):
    box = shapes.box(n=n)
    points = np.concatenate([box.points, box.points + shift])
    return Surface(points, np.concatenate([box.faces, box.faces + box.n_points]))


@pytest.mark.parametrize(
    ("shift", "shared", "seed"), pairwise([(1, 1, 0), (1, 1, 1), (0, 1, 1)], [True, False], range(3))
)
def test_boxes_that_touch_stay_two_closed_boxes(shift, shared, seed):
    pair = two_boxes(np.array(shift, dtype=float))
    faces = pair.faces
    if shared:
        lowest = [int(np.flatnonzero((pair.points == p).all(axis=1))[0]) for p in pair.points]
        faces = np.array(lowest)[faces]
    faces = np.random.default_rng(seed).permutation(faces)
    touching = Surface(pair.points, faces)
    prepared = prepare(touching)
    check(prepared, touching)
    assert prepared.report.components == 2
    assert n_boundary(prepared.surface) == 0
    _, label = topology.connected_components(prepared.surface.faces, prepared.surface.n_points)
    for part in range(2):
        assert volume(Surface(prepared.surface.points, prepared.surface.faces[label == part])) == pytest.approx(1)
    assert (prepared.report.points_nonmanifold_split > 0) == shared


def test_fin_on_a_closed_surface_leaves_it_closed():
    box = shapes.box(n=1)
    a, b = box.edges[np.flatnonzero(np.isclose(box.edge_lengths, 1.0))[0]]
    outside = 2 * box.points[[a, b]].mean(axis=0) - 0.5
    finned = Surface(np.vstack([box.points, outside]), np.vstack([box.faces, [a, b, 8]]))
    prepared = prepare(finned)
    check(prepared, finned)
    assert prepared.report.edges_nonmanifold_cut == 1
    assert n_boundary(prepared.surface) == 3
    assert prepared.report.components == 2


def moebius_strip(rows: int, rng: np.random.Generator) -> Surface:
    """A strip with one side, of width .6 and three squares across, its faces in any order."""
    angle = 2 * np.pi * np.arange(rows) / rows
    across = np.linspace(-0.3, 0.3, 4)
    ring = 1 + across * np.cos(angle[:, None] / 2)
    height = across * np.sin(angle[:, None] / 2)
    x, y = ring * np.cos(angle[:, None]), ring * np.sin(angle[:, None])
    number = np.vstack([np.arange(rows * 4).reshape(rows, 4), np.arange(4)[::-1]])
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    faces = rng.permutation(faces)
    return Surface(np.stack([x, y, height], axis=-1).reshape(-1, 3), faces)


def boundary_length(surface: Surface) -> float:
    return float(surface.edge_lengths[surface.edge_face_count == 1].sum())


@pytest.mark.parametrize("rows", [6, 12, 15])
@pytest.mark.parametrize("seed", range(3))
def test_moebius_strip_is_cut_once_straight_across(rows, seed):
    strip = moebius_strip(rows, np.random.default_rng(seed))
    assert len(topology.boundary_loops(strip.faces)) == 1
    prepared = prepare(strip)
    check(prepared, strip)
    assert prepared.surface.n_faces == strip.n_faces
    assert prepared.report.edges_nonorientable_cut == 3
    assert boundary_length(prepared.surface) - boundary_length(strip) == pytest.approx(2 * 0.6)  # the strip is .6 wide
    assert topology.euler_characteristic(prepared.surface.faces) > topology.euler_characteristic(strip.faces)


def test_klein_bottle_is_cut_into_something_orientable():
    n, m = 10, 8
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    ring = 2 + np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v)
    height = np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v)
    number = np.vstack([np.arange(n * m).reshape(n, m), (-np.arange(m)) % m])
    a, d = number[:-1], np.roll(number[:-1], -1, axis=1)
    b, c = number[1:], np.roll(number[1:], -1, axis=1)
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    bottle = Surface(np.stack([ring * np.cos(u), ring * np.sin(u), height], axis=-1).reshape(-1, 3), faces)
    assert topology.euler_characteristic(bottle.faces) == 0
    prepared = prepare(bottle)
    check(prepared, bottle)
    assert prepared.surface.n_faces == bottle.n_faces
    assert n_boundary(prepared.surface) == 2 * prepared.report.edges_nonorientable_cut > 0


def shortest_line_across(strip: Surface) -> float:
    """The length of the shortest path of edges between boundary points that leaves the strip in one piece, by search.

    All simple paths of inner edges are tried in the order of their lengths.
    """
    inner = strip.edge_face_count == 2
    beside = defaultdict(list)
    for edge in np.flatnonzero(inner).tolist():
        a, b = strip.edges[edge].tolist()
        beside[a].append((b, edge))
        beside[b].append((a, edge))
    on_boundary = set(strip.edges[~inner].ravel().tolist())
    waiting = [(0.0, [], [start]) for start in sorted(on_boundary)]
    while waiting:
        length, path, points = heappop(waiting)
        if path and points[-1] in on_boundary:
            left = inner.copy()
            left[path] = False
            if topology.graph_components(strip.edge_faces[left], strip.n_faces)[0] == 1:
                return length
            continue
        for point, edge in beside[points[-1]]:
            if point not in points:
                heappush(waiting, (length + float(strip.edge_lengths[edge]), [*path, edge], [*points, point]))
    raise AssertionError("there is no line across")


@pytest.mark.parametrize("seed", range(5))
def test_an_uneven_moebius_strip_is_cut_along_the_shortest_line_of_edges(seed):
    rng = np.random.default_rng(seed)
    flat = moebius_strip(7, rng)
    strip = flat.with_points(flat.points + 0.08 * rng.standard_normal(flat.points.shape))
    prepared = prepare(strip)
    check(prepared, strip)
    cut = 0.5 * (boundary_length(prepared.surface) - boundary_length(strip))
    assert cut == pytest.approx(shortest_line_across(strip))
    again = prepare(Surface(prepared.surface.points, prepared.surface.faces[::-1]))
    assert boundary_length(again.surface) == pytest.approx(boundary_length(prepared.surface))


def test_bow_tie_gets_two_points_for_its_knot():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 0, 0], [-1, -1, 0]], dtype=float)
    tie = Surface(points, np.array([[0, 1, 2], [0, 3, 4]]))
    prepared = prepare(tie)
    check(prepared, tie)
    assert prepared.surface.n_points == 6
    assert prepared.report.points_nonmanifold_split == 1
    assert prepared.point_source.tolist().count(0) == 2


def test_the_larger_area_decides_the_orientation():
    clean = shapes.sphere(2)
    faces = np.array(clean.faces)
    faces[:100] = faces[:100][:, ::-1]
    prepared = prepare(Surface(clean.points, faces))
    assert volume(prepared.surface) == pytest.approx(volume(clean))
    assert prepared.report.faces_flipped == 100
    assert prepared.report.lines() == ["100 face(s) reversed to agree with their neighbours"]


def test_components_are_oriented_one_by_one():
    pair = two_boxes(np.array([3.0, 0, 0]))
    faces = np.array(pair.faces)
    half = len(faces) // 2
    faces[:half] = faces[:half][:, ::-1]
    prepared = prepare(Surface(pair.points, faces))
    np.testing.assert_array_equal(prepared.surface.faces, faces)


@pytest.mark.parametrize("where", range(4))
@pytest.mark.parametrize("count", [1, 2, 5])
def test_caps_on_a_closed_surface_keep_it_closed(where, count):
    """A side of a tetrahedron is cut at points on it for one of its faces only: the gap is filled by caps."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    a, b, c = TETRAHEDRON[where]
    share = (np.arange(count) + 1.0) / (count + 1)
    on_side = points[a] + (points[b] - points[a]) * share[:, None]
    chain = [a, *range(4, 4 + count), b]
    fan = [[chain[k], chain[k + 1], c] for k in range(len(chain) - 1)]
    caps = [[chain[k], b, chain[k + 1]] for k in range(count)]
    faces = [face for k, face in enumerate(TETRAHEDRON.tolist()) if k != where] + fan + caps
    closed = Surface(np.vstack([points, on_side]), np.array(faces))
    assert n_boundary(closed) == 0
    prepared = prepare(closed)
    check(prepared, closed)
    assert n_boundary(prepared.surface) == 0
    assert prepared.surface.face_areas.min() > 1e-3
    assert volume(prepared.surface) == pytest.approx(1 / 6, rel=1e-12)
    assert prepared.surface.area == pytest.approx(1.5 + np.sqrt(3) / 2, rel=1e-12)
    assert prepared.surface.n_points == 4 + count


def test_needle_on_a_closed_surface_is_collapsed():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1e-16 + 1]], dtype=float)
    points[4] = [1e-17, 0, 1]
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 4], [2, 0, 3], [1, 4, 3], [2, 3, 4]])
    closed = Surface(points, faces)
    assert n_boundary(closed) == 0
    prepared = prepare(closed)
    check(prepared, closed)
    assert prepared.surface.n_faces == 4
    assert n_boundary(prepared.surface) == 0
    assert volume(prepared.surface) == pytest.approx(1 / 6)


def test_flap_on_a_closed_surface_is_removed():
    points = np.vstack([np.vstack([np.zeros(3), np.eye(3)]), [-1, -1, -1]])
    flap = Surface(points, np.vstack([TETRAHEDRON, [[0, 1, 4], [1, 0, 4]]]))
    prepared = prepare(flap)
    check(prepared, flap)
    assert n_boundary(prepared.surface) == 0
    assert prepared.surface.n_faces == 4


@pytest.mark.parametrize("other", [[1, 0, 4], [0, 1, 4]])
def test_flap_without_area_is_removed(other):
    points = np.vstack([np.zeros(3), np.eye(3), [0.25, 0, 0]])
    flap = Surface(points, np.vstack([TETRAHEDRON, [[0, 1, 4], other]]))
    prepared = prepare(flap)
    check(prepared, flap)
    assert prepared.surface.area == pytest.approx(1.5 + np.sqrt(3) / 2, rel=1e-12)
    if other == [1, 0, 4]:
        assert n_boundary(prepared.surface) == 0
        np.testing.assert_array_equal(prepared.surface.faces, TETRAHEDRON)


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_a_face_and_its_copy_leave_one(order):
    patch = shapes.open_patch(lambda x, y: x * y, n=3)
    doubled = Surface(patch.points, np.vstack([patch.faces, patch.faces[:, list(order)]]))
    prepared = prepare(doubled)
    check(prepared, doubled)
    np.testing.assert_array_equal(prepared.surface.faces, patch.faces)
    assert prepared.report.faces_duplicate == patch.n_faces


def test_two_faces_back_to_back_are_one():
    # every edge has two faces and they agree in orientation, but it is no surface of triangles
    pillow = Surface(np.eye(3), np.array([[0, 1, 2], [0, 2, 1]]))
    prepared = prepare(pillow)
    check(prepared, pillow)
    np.testing.assert_array_equal(prepared.surface.faces, [[0, 1, 2]])
    assert prepared.report.faces_duplicate == 1


def test_unused_points_are_dropped():
    box = shapes.box(n=1)
    padded = Surface(np.vstack([np.full((5, 3), 9.0), box.points]), box.faces + 5)
    prepared = prepare(padded)
    assert prepared.report.points_unreferenced == 5
    np.testing.assert_array_equal(prepared.surface.points, box.points)
    np.testing.assert_array_equal(prepared.surface.faces, box.faces)


def test_tolerance_closes_a_gap():
    box = shapes.box(n=3)
    rng = np.random.default_rng(5)
    corners = box.points[box.faces].reshape(-1, 3) + 1e-6 * rng.uniform(-1, 1, (3 * box.n_faces, 3))
    soup = Surface(corners, np.arange(len(corners)).reshape(-1, 3))
    assert n_boundary(prepare(soup).surface) == 3 * box.n_faces
    prepared = prepare(soup, weld_tolerance=1e-5)
    assert problems(prepared.surface) == []
    assert n_boundary(prepared.surface) == 0
    assert prepared.surface.n_points == box.n_points
    assert prepare(prepared.surface, weld_tolerance=1e-5).surface is prepared.surface


@pytest.mark.parametrize("scale", [1e-150, 1e-30, 1e30, 1e150])
def test_scale_does_not_matter(scale):
    tie = two_boxes(np.array([1.0, 1.0, 0.0]))
    scaled = prepare(tie.with_points(tie.points * scale))
    np.testing.assert_array_equal(scaled.surface.faces, prepare(tie).surface.faces)


@pytest.mark.parametrize("tolerance", [-1.0, float("nan"), float("inf"), 1.0])
def test_unreasonable_tolerance_is_refused(tolerance):
    with pytest.raises(OptionError, match="weld_tolerance"):
        prepare(shapes.box(n=1), weld_tolerance=tolerance)


@pytest.mark.parametrize("points", [np.zeros((3, 3)), np.array([[0, 0, 0], [1, 1, 1], [3, 3, 3]])])
def test_nothing_left_is_an_error(points):
    with pytest.raises(MeshError, match="nothing is left"):
        prepare(Surface(points, np.array([[0, 1, 2]])))


@pytest.mark.skipif("ANISOMESH_DATA" not in os.environ, reason="set ANISOMESH_DATA to the folder of real meshes")
def test_broken_meshes_of_the_wild():
    paths = sorted(Path(os.environ["ANISOMESH_DATA"]).glob("wild/*.ply"))
    if not paths:
        pytest.skip("no meshes in the folder wild")
    for path in paths:
        prepared = prepare(load(path))
        faces = prepared.surface.faces
        assert topology.is_oriented(faces), path
        assert topology.count_nonmanifold_edges(faces) + topology.count_nonmanifold_points(faces) == 0, path
        assert prepare(prepared.surface).surface is prepared.surface, path


def test_a_side_of_no_length_leaves_a_point_near_its_source():
    points = np.array([[0, 0, 1], [0, 0, 0], [0, 1, 0], [0, 0, 1.2e-38]], dtype=float)
    check(prepare(Surface(points, np.array([[0, 1, 3], [0, 2, 3]]))), Surface(points, np.array([[0, 1, 3], [0, 2, 3]])))
