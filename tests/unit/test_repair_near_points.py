"""Boundary points that nearly coincide are counted, others are not."""

import json

import numpy as np
import pytest

from anisomesh.errors import MeshError, OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.options import RemeshOptions
from anisomesh.repair.near_points import AUTO_WELD, count_near_boundary_points, weld_distance
from anisomesh.repair.prepare import prepare
from anisomesh.shapes import analytic as shapes
from conftest import write_obj

BALL = shapes.sphere(2)


def cracked(noise, seed=0):
    """Return the ball as separate triangles whose corners are moved by up to ``noise`` diagonals."""
    corners = BALL.points[BALL.faces].reshape(-1, 3)
    step = np.random.default_rng(seed).uniform(-1, 1, corners.shape) / 3**0.5
    return Surface(corners + noise * BALL.diagonal * step, np.arange(len(corners)).reshape(-1, 3))


def test_a_tolerance_that_leaves_no_face_is_named():
    with pytest.raises(MeshError, match=r"no\w* of the 320 faces has an area once .* give a smaller weld_tolerance"):
        prepare(BALL, weld_tolerance=0.1 * BALL.diagonal)
    flat = Surface([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)])
    with pytest.raises(MeshError, match="none of the 1 faces has an area; nothing is left"):
        prepare(flat, weld_tolerance=0.1)


def test_cracks_count_and_the_tolerance_closes_them():
    soup = cracked(0.4 * AUTO_WELD)
    assert count_near_boundary_points(soup) == soup.n_points
    welded = prepare(soup, weld_tolerance=weld_distance(soup, "auto")).surface
    assert (welded.n_points, count_near_boundary_points(welded)) == (BALL.n_points, 0)
    assert not welded.on_boundary.any()


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_points_that_coincide_or_lie_apart_do_not_count(noise):
    assert count_near_boundary_points(cracked(noise)) == 0


def test_dense_boundaries_and_closed_surfaces_do_not_count():
    strip = shapes.box(n=3)
    tiny = 1e-6 * strip.points[strip.faces[:9]].reshape(-1, 3)
    far = np.vstack([strip.points, tiny + 5])
    faces = np.vstack([strip.faces, np.arange(27).reshape(-1, 3) + strip.n_points])
    dense = prepare(Surface(far, faces)).surface
    assert dense.on_boundary.any()
    assert count_near_boundary_points(dense) == 0
    assert count_near_boundary_points(BALL) == 0


def test_the_option():
    assert RemeshOptions(weld_tolerance="auto").weld_tolerance == "auto"
    assert weld_distance(BALL, "auto") == 1e-5 * BALL.diagonal
    assert weld_distance(BALL, 0.25) == 0.25
    with pytest.raises(OptionError, match="weld_tolerance = 'wide'; expected a number"):
        RemeshOptions(weld_tolerance="wide")


@pytest.mark.slow
def test_hint_and_option_of_the_command_line(run_cli, tmp_path):
    """Regression: nothing told why a soup with cracks came back as separate triangles, and nothing could join them."""
    soup = cracked(0.4 * AUTO_WELD)
    path, out = write_obj(tmp_path / "soup.obj", soup.points, soup.faces), tmp_path / "out.ply"
    hint = f"{soup.n_points:,} boundary points lie within 1e-5 of the diagonal of others; --weld auto joins them"
    assert json.loads(run_cli("info", path, "--json").stdout)["hints"] == [hint]
    assert hint in run_cli("info", path).stdout
    for weld in ("auto", "0.001%", str(1e-5 * soup.diagonal)):
        process = run_cli("remesh", path, "-o", out, "-n", 60, "--weld", weld, "--json", "--no-fit")
        report = json.loads(process.stdout)
        assert (report["validity"]["closed"], report["vertices"], report["hints"]) == (True, 60, [])
    process = run_cli("remesh", path, "-o", out, "-n", 60, "--weld", "near")
    assert process.returncode == 2
    assert "--weld near: expected a length" in process.stderr
