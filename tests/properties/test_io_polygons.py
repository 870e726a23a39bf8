"""Polygons become triangles that cover them once, whatever their outline."""

import logging
import time
from types import SimpleNamespace

import meshio
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anisomesh.io.formats.vtk.write import vtp_bytes
from anisomesh.io.meshes import load
from anisomesh.io.polygons import PolygonSoup, as_triangles, triangulate
from conftest import examples

U = np.array([(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)], dtype=float)
ANNULUS = np.array(  # a square with a square hole, joined by a bridge that the outline follows twice
    [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)], dtype=float
)
TWO_HOLES = np.array(
    [[0, 9, 9, 0, 0, 1, 2, 3, 6, 7, 8, 7, 6, 3, 2, 1, 0], [0, 0, 4, 4, 2, 2, 3, 2, 2, 3, 2, 1, 2, 2, 1, 2, 2]],
    dtype=float,
).T
STRAIGHT = np.array([(0, 0), (1, 0), (2, 0), (3, 0), (3, 1), (3, 2), (0, 2), (0, 1)], dtype=float)
REPEATED = np.array([(0, 0), (3, 0), (3, 0), (3, 3), (2, 3), (2, 1), (2, 1), (1, 1), (1, 3), (0, 3)], dtype=float)


def shoelace(xy):
    x, y = xy.T
    return 0.5 * float(x @ np.roll(y, -1) - np.roll(x, -1) @ y)


def signed_areas(xy, faces):
    a, b, c = (xy[faces[:, k]] for k in range(3))
    u, v = b - a, c - a
    return 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def triangles_of(points, *polygons):
    soup = PolygonSoup(points=points, corners=np.concatenate(polygons), sizes=np.array([len(p) for p in polygons]))
    found = triangulate(soup)
    return SimpleNamespace(faces=soup.corners[found.corners], polygon=found.polygon, overlapping=found.overlapping)


def check_cover(xy, faces, *, flat=0):
    """Areas of the same sign that sum to the polygon's, over the same outline, cover it exactly once."""
    areas = signed_areas(xy, faces) * np.sign(shoelace(xy))
    assert len(faces) == len(xy) - 2
    assert areas.min() > (-1e-12 if flat else 0.0) * abs(shoelace(xy))
    assert np.count_nonzero(areas <= 1e-12 * abs(shoelace(xy))) <= flat
    assert areas.sum() == pytest.approx(abs(shoelace(xy)), rel=1e-9)
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    directed = set(map(tuple, sides.tolist()))
    assert {(k, (k + 1) % len(xy)) for k in range(len(xy))} <= directed
    inner = directed - {(k, (k + 1) % len(xy)) for k in range(len(xy))}
    assert {(b, a) for a, b in inner} == inner


@pytest.mark.parametrize(("xy", "flat"), [(U, 0), (ANNULUS, 0), (TWO_HOLES, 0), (STRAIGHT, 0), (REPEATED, 2)])
@pytest.mark.parametrize("reverse", [False, True])
def test_outlines(xy, flat, reverse):
    """Whatever corner is the first."""
    for shift in range(len(xy)):
        turned = np.roll(xy[::-1] if reverse else xy, shift, axis=0)
        made = triangles_of(np.pad(turned, ((0, 0), (0, 1))), np.arange(len(xy)))
        assert len(made.overlapping) == 0
        check_cover(turned, made.faces, flat=flat)


@settings(examples(60))
@given(
    radii=st.lists(st.floats(0.05, 1.0), min_size=4, max_size=40),
    seed=st.integers(0, 2**31),
    scale=st.sampled_from([1e-6, 1.0, 1e9]),
)
def test_star_shaped_polygons_in_any_plane(radii, seed, scale):
    """The area is the shoelace area in the plane, and no triangle overlaps another."""
    rng = np.random.default_rng(seed)
    n = len(radii)
    angle = 2 * np.pi * (np.arange(n) + rng.uniform(-0.4, 0.4, n)) / n
    xy = scale * np.array(radii)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points = xy @ frame[:2] + scale * rng.normal(size=3)
    made = triangles_of(points, np.arange(n))
    assert len(made.overlapping) == 0
    check_cover(xy, made.faces)


@settings(examples(20))
@given(seed=st.integers(0, 2**31), n=st.integers(5, 30))
def test_random_simple_polygons(seed, n):
    """Random points joined by a tour whose crossings are removed: far from star-shaped."""
    rng = np.random.default_rng(seed)
    xy = rng.random((n, 2))

    def side(p, q, r):
        return np.sign((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    crossing = True
    while crossing:
        crossing = False
        for i in range(n - 2):
            for j in range(i + 2, n - (i == 0)):
                a, b, c, d = xy[i], xy[i + 1], xy[j], xy[(j + 1) % n]
                if side(a, b, c) != side(a, b, d) and side(c, d, a) != side(c, d, b):
                    xy[i + 1 : j + 1] = xy[i + 1 : j + 1][::-1].copy()
                    crossing = True
    made = triangles_of(np.pad(xy, ((0, 0), (0, 1))), np.arange(n))
    check_cover(xy, made.faces)


def test_nearly_flat_concave_polygon_keeps_its_outline():
    points = np.pad(U, ((0, 0), (0, 1))) + 1e-3 * np.random.default_rng(0).normal(size=(8, 3))
    check_cover(points[:, :2], triangles_of(points, np.arange(8)).faces)


def test_convex_polygons_keep_their_triangles():
    angle = 2 * np.pi * np.arange(7) / 7
    points = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    assert triangles_of(points, np.arange(7)).faces.tolist() == [[0, k, k + 1] for k in range(1, 6)]


def test_concave_quadrilateral_is_split_along_its_inner_diagonal():
    dart = np.array([(0, 0, 0), (4, -1, 0), (1, 0, 0), (4, 1, 0)], dtype=float)
    for shift in range(4):
        turned = np.roll(dart, shift, axis=0)
        check_cover(turned[:, :2], triangles_of(turned, np.arange(4)).faces)


def test_polygon_of_each_triangle():
    points = np.pad(np.concatenate([U, U + 5]), ((0, 0), (0, 1)))
    made = triangles_of(points, np.arange(8), np.array([0, 1, 2]), np.arange(8, 16))
    assert made.polygon.tolist() == [0] * 6 + [1] + [2] * 6
    areas = signed_areas(points[:, :2], made.faces)
    assert np.bincount(made.polygon, areas) == pytest.approx([7, 4.5, 7])


@pytest.mark.parametrize("shape", ["comb", "spiral", "gear"])
def test_thousands_of_corners_take_no_time(shape):
    n = 2_000
    turn = np.linspace(0.0, 40 * np.pi, n)
    if shape == "comb":
        x = np.arange(2 * n)
        xy = np.concatenate([[(0.0, -5.0)], np.stack([x, 5.0 * (x % 2)], axis=1), [(2.0 * n, -5.0)]])[::-1]
    elif shape == "spiral":
        outer = (turn + 7)[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        xy = np.concatenate([outer, 0.9 * outer[::-1]])
    else:
        angle = 2 * np.pi * np.arange(2 * n) / (2 * n)
        xy = (1 + 0.1 * (np.arange(2 * n) % 4 < 2))[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    triangles_of(np.pad(U, ((0, 0), (0, 1))), np.arange(8))  # compiles
    start = time.process_time()
    made = triangles_of(np.pad(xy, ((0, 0), (0, 1))), np.arange(len(xy)))
    assert time.process_time() - start < 2.0
    check_cover(xy, made.faces)


def test_polygon_that_crosses_itself_is_named(caplog, tmp_path):
    bow = "v 0 0 0\nv 4 3 0\nv 4 0 0\nv 0 2 0\nv -1 1 0\n"
    (tmp_path / "a.obj").write_text(bow + "f 1 2 3\nf 1 2 3 4 5\n")
    with caplog.at_level(logging.WARNING, logger="anisomesh"):
        assert load(tmp_path / "a.obj").n_faces == 4
    assert "1 polygon(s) cross themselves" in caplog.text
    assert "the first is face 1 " in caplog.text


def prism(suffix):
    """Return a file of the closed prism of height 1 over the U, area 30, with two concave faces of 8 corners."""
    n = len(U)
    points = [(x, y, z) for z in (0, 1) for x, y in U]
    polygons = [[*range(n)][::-1], [*range(n, 2 * n)], *([k, (k + 1) % n, n + (k + 1) % n, n + k] for k in range(n))]
    lines = ["{} {} {}".format(*p) for p in points]
    if suffix == ".obj":
        return "".join(f"v {line}\n" for line in lines) + "".join(
            "f " + " ".join(str(k + 1) for k in polygon) + "\n" for polygon in polygons
        )
    rows = "\n".join([*lines, *(f"{len(p)} " + " ".join(map(str, p)) for p in polygons)]) + "\n"
    if suffix == ".off":
        return f"OFF\n{len(points)} {len(polygons)} 0\n{rows}"
    head = "".join(f"property float {c}\n" for c in "xyz")
    return (
        f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n{head}element face {len(polygons)}\n"
        f"property list uchar int vertex_indices\nend_header\n{rows}"
    )


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply"])
def test_concave_faces_of_files(tmp_path, suffix):
    """Regression: polygons were split into fans, so that a concave one covered parts twice."""
    path = tmp_path / f"prism{suffix}"
    path.write_text(prism(suffix))
    surface = load(path)
    assert surface.area == pytest.approx(30)
    assert np.einsum(
        "ij,ij->",
        *[np.cross(*surface.points[surface.faces[:, :2]].swapaxes(0, 1)), surface.points[surface.faces[:, 2]]],
    ) / 6 == pytest.approx(7)


def test_odd_parts_are_left_out_and_named():
    points = np.vstack([np.eye(3), [np.nan] * 3])
    soup = PolygonSoup(points=points, corners=np.array([0, 1, 0, 1, 2, 0]), sizes=np.array([2, 3, 1]))
    surface, source, _, remarks = as_triangles(soup)
    assert source.tolist() == [1]
    assert surface.n_points == 4
    assert len(remarks) == 2
    assert "face 0 (counted from 0) with 2" in remarks[0]
    assert "the first of them 3" in remarks[1]
    with pytest.raises(ValueError, match="point 3"):
        as_triangles(PolygonSoup.from_array(points, np.array([[0, 1, 3]])))


@pytest.mark.parametrize("noise", [0.0, 1e-13, 1e-9, 1e-6])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_straight_sides_with_many_corners_give_no_slivers(noise, offset):
    """Corners on the sides of a rectangle, exactly or up to rounding: every triangle has a height above the noise."""
    rng = np.random.default_rng(0)
    along = np.linspace(0, 4, 9)
    xy = np.concatenate(
        [
            np.stack([along[:-1], 0 * along[:-1]], 1),
            [(4, 0), (4, 1)],
            np.stack([along[::-1][1:-1], 1 + 0 * along[1:-1]], 1),
            [(0, 1)],
        ]
    )
    xy = xy + offset + noise * rng.uniform(-1, 1, xy.shape)
    made = triangles_of(np.pad(xy, ((0, 0), (0, 1))), np.arange(len(xy)))
    areas = signed_areas(xy - offset, made.faces)
    assert areas.sum() == pytest.approx(4, abs=1e-5)
    assert areas.min() > 0.2


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply", ".vtu", ".vtp", ".msh", ".mesh"])
def test_concave_quadrilaterals_and_unused_points_of_all_formats(tmp_path, suffix, caplog):
    """A dart beside a square, in every format that holds quadrilaterals, and a point without coordinates."""
    outline = [(0, 0, 0), (4, -1, 0), (1, 0, 0), (4, 1, 0), (9, 0, 0), (9, 1, 0), (4, 1, 0), (4, 0, 0)]
    points = np.array([*outline, [np.nan] * 3])
    quads = np.array([[1, 2, 3, 0], [7, 4, 5, 6]])
    path = tmp_path / f"a{suffix}"
    if suffix == ".vtp":
        path.write_bytes(vtp_bytes(points, quads, np.array([4, 4]), {}))
    elif suffix == ".off":
        rows = [*map("{} {} {}".format, *points.T), *map("4 {} {} {} {}".format, *quads.T)]
        path.write_text("\n".join(["OFF", "9 2 0", *rows]))
    else:
        form = {".mesh": "medit", ".msh": "gmsh22"}.get(suffix, suffix[1:])
        meshio.Mesh(points, [("quad", quads)]).write(path, file_format=form)
    surface = load(path)
    assert surface.n_points == 9
    assert np.isfinite(surface.points).all()
    assert surface.area == pytest.approx(1 + 5)
    assert np.ptp(surface.face_normals[:2, 2]) == 0
    assert "1 point(s) that no face uses" in caplog.text
