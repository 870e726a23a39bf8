"""``anisomesh remesh`` keeps what files carry."""

import numpy as np
import pytest

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.meshes import load_mesh, save
from anisomesh.shapes.analytic import box

PLATE = box((2.0, 1.0, 0.25), n=6)
MIDDLES = PLATE.points[PLATE.faces].mean(axis=1)
RIGHT = MIDDLES[:, 0] > 1.0
NAMES = {3: "left half", 8: "right half"}
OPTIONS = ("-n", 150, "--embedding", "direct", "--no-fit")


def sides(mesh, division):
    """Return the names of the regions on both sides of the middle, weighed by area."""
    regions = mesh.regions[division]
    right = mesh.surface.points[mesh.surface.faces].mean(axis=1)[:, 0] > 1.0
    names = np.array([regions.names.get(label, "") for label in regions.labels])
    areas = mesh.surface.face_areas
    return [{name: areas[half & (names == name)].sum() for name in np.unique(names)} for half in (~right, right)]


@pytest.mark.parametrize(("source", "target", "division"), [("msh", "vtu", "physical"), ("obj", "stl", "solid")])
def test_regions_keep_names_and_places(run_cli, tmp_path, caplog, source, target, division):
    given = {"physical" if source == "msh" else "group": Regions(np.where(RIGHT, 8, 3), NAMES)}
    save(Mesh(surface=PLATE, regions=given), tmp_path / f"a.{source}")
    process = run_cli("remesh", f"a.{source}", "-o", f"b.{target}", *OPTIONS, cwd=tmp_path)
    assert process.returncode == 0, process.stderr
    assert caplog.text == ""
    left, right = sides(load_mesh(tmp_path / f"b.{target}"), division)
    total = PLATE.area / 2
    assert left["left half"] == pytest.approx(total, rel=0.02)
    assert right["right half"] == pytest.approx(total, rel=0.02)


@pytest.mark.slow
def test_data_textures_and_one_warning(run_cli, tmp_path):
    """Data are linear on the flat sides of a plate, where interpolation is exact."""
    axis = np.abs(PLATE.face_normals).argmax(axis=1)
    corners = PLATE.points[PLATE.faces]
    uv = np.stack([corners @ [0.3, 0.1, 0.2] + axis[:, None], corners[..., 2]], axis=2)
    height = PLATE.points @ [1.0, 2.0, 3.0]
    save(Mesh(surface=PLATE, point_data={"height": height}, corner_data={"uv": uv}), tmp_path / "a.ply")
    process = run_cli("remesh", "a.ply", "-o", "b.ply", *OPTIONS, cwd=tmp_path)
    assert process.returncode == 0, process.stderr
    mesh = load_mesh(tmp_path / "b.ply")
    points = mesh.surface.points
    np.testing.assert_allclose(mesh.point_data["height"], points @ [1.0, 2.0, 3.0], atol=1e-9)
    off = mesh.corner_data["uv"][..., 0] - points[mesh.surface.faces] @ [0.3, 0.1, 0.2]
    np.testing.assert_allclose(off, np.rint(off), atol=1e-9)
    process = run_cli("remesh", "a.ply", "-o", "b.glb", *OPTIONS, cwd=tmp_path)
    assert "warning" not in process.stderr
    assert load_mesh(tmp_path / "b.glb").point_data["uv"].shape[1] == 2
    process = run_cli("remesh", "a.ply", "-o", "b.off", *OPTIONS, cwd=tmp_path)
    (line,) = [line for line in process.stderr.splitlines() if "warning" in line]
    assert line == "anisomesh: warning: b.off: left out what OFF cannot hold: corner data 'uv'; point data 'height'"
