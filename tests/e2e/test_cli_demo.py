"""``anisomesh demo``: needs no input and names its results."""

import importlib.util
import json

import pytest
import trimesh


@pytest.fixture(scope="module")
def demo(run_cli, tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo") / "new" / "folder"
    process = run_cli("demo", "--out", folder, "-n", 500)
    assert process.returncode == 0, process.stderr
    return folder, process


@pytest.mark.slow
def test_demo_writes_meshes_report_and_picture_and_names_them(demo):
    folder, process = demo
    names = {"input.ply", "remeshed.ply", "report.json", "side_by_side.png"}
    assert {path.name for path in folder.iterdir()} == names
    assert all(str(folder / name) in process.stdout for name in names)
    assert (folder / "side_by_side.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_demo_result_has_the_topology_of_its_input(demo):
    folder, _ = demo
    before, after = (trimesh.load(folder / name, process=False, force="mesh") for name in ("input.ply", "remeshed.ply"))
    assert after.is_watertight
    assert after.euler_number == before.euler_number
    assert after.volume == pytest.approx(before.volume, rel=0.1)
    assert json.loads((folder / "report.json").read_text())["vertices"] == len(after.vertices)


def test_demo_refuses_a_file_in_place_of_the_folder(run_cli, tmp_path):
    (tmp_path / "taken").write_text("")
    process = run_cli("demo", "--out", "taken", cwd=tmp_path)
    assert process.returncode == 2
    assert "taken is a file" in process.stderr


@pytest.mark.slow
def test_demo_goes_on_without_a_picture_where_none_can_be_drawn(run_cli, monkeypatch, tmp_path):
    find_spec = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "pyvista" else find_spec(name))
    done = run_cli("demo", "--out", tmp_path, "-n", 400)
    assert done.returncode == 0, done.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"input.ply", "remeshed.ply", "report.json"}
    assert 'pip install "anisomesh[picture]"' in done.stderr
    assert "side_by_side.png" not in done.stdout
