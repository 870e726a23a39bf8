"""``anisomesh remesh``: files, report, standard output, reproducibility."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from anisomesh import save
from anisomesh.shapes.analytic import box

REPORT_KEYS = {
    "vertices_asked",
    "vertices",
    "faces",
    "seconds",
    "energy",
    "iterations",
    "status",
    "stretch",
    "validity",
    "warnings",
}


def read(path):
    return trimesh.load(path, process=False, force="mesh")


@pytest.fixture(scope="module")
def run_with_everything(run_process, torus_obj, tmp_path_factory):
    """A process that writes every kind of output; its folder and the finished process."""
    folder = tmp_path_factory.mktemp("everything")
    process = run_process(
        *("remesh", torus_obj, "-o", folder / "out.ply", "-n", 150, "--json"),
        *("--report", folder / "report.json", "--rvd", folder / "rvd.vtu", "--picture", folder / "both.png"),
    )
    assert process.returncode == 0, process.stderr
    return folder, process


@pytest.mark.slow
def test_json_is_all_there_is_on_standard_output_and_equals_the_report_file(run_with_everything):
    folder, process = run_with_everything
    report = json.loads(process.stdout)
    assert report == json.loads((folder / "report.json").read_text())
    assert set(report) >= REPORT_KEYS


@pytest.mark.slow
def test_report_agrees_with_the_mesh_that_was_written(run_with_everything):
    folder, process = run_with_everything
    report, mesh = json.loads(process.stdout), read(folder / "out.ply")
    assert (report["vertices"], report["faces"]) == (len(mesh.vertices), len(mesh.faces))
    assert report["vertices_asked"] == 150
    assert report["validity"]["closed"] == mesh.is_watertight
    assert report["validity"]["euler"] == mesh.euler_number
    assert report["validity"]["oriented"] == mesh.is_winding_consistent


@pytest.mark.slow
def test_the_result_is_a_torus_of_about_the_asked_size_in_model_units(run_with_everything):
    folder, _ = run_with_everything
    mesh = read(folder / "out.ply")
    assert 135 <= len(mesh.vertices) <= 165
    assert mesh.is_watertight
    assert mesh.euler_number == 0
    assert mesh.volume == pytest.approx(2 * np.pi**2 * 0.35**2, rel=0.05)


@pytest.mark.slow
def test_stage_seconds_do_not_exceed_the_total(run_with_everything):
    seconds = json.loads(run_with_everything[1].stdout)["seconds"]
    assert {"load", "prepare", "metric", "embed", "cvt", "dual", "total"} <= set(seconds)
    assert all(value >= 0 for value in seconds.values())
    assert sum(value for stage, value in seconds.items() if stage != "total") <= seconds["total"] + 0.05


@pytest.mark.slow
def test_only_the_requested_files_are_written(run_with_everything):
    folder, _ = run_with_everything
    assert {path.name for path in folder.iterdir()} == {"out.ply", "report.json", "rvd.vtu", "both.png"}
    assert (folder / "both.png").read_bytes().startswith(b"\x89PNG")
    assert all(path.stat().st_size > 500 for path in folder.iterdir())


@pytest.mark.slow
def test_progress_goes_to_standard_error_in_plain_lines(run_with_everything):
    lines = run_with_everything[1].stderr.splitlines()
    assert 3 <= len(lines) <= 60
    assert not any("\x1b" in line or "\r" in line for line in lines)


@pytest.mark.slow
def test_the_result_depends_on_the_seed_and_not_on_the_threads(run_cli, torus_obj, tmp_path):
    def points(name, *words):
        process = run_cli(
            "remesh", torus_obj, "-o", tmp_path / name, "-n", 100, "--max-iterations", 10, "--quiet", *words
        )
        assert (process.returncode, process.stdout, process.stderr) == (0, "", "")
        return (tmp_path / name).read_bytes()

    first = points("a.ply", "--seed", 3, "--threads", 1)
    assert first == points("b.ply", "--seed", 3, "--threads", 3)
    assert first != points("c.ply", "--seed", 4)


def test_summary_names_size_and_files(run_cli, torus_obj, tmp_path):
    process = run_cli(
        "remesh", torus_obj, "-o", "out.obj", "-n", 200, "--metric", "uniform", "--max-iterations", 5, cwd=tmp_path
    )
    assert process.returncode == 0
    count = len(read(tmp_path / "out.obj").vertices)
    assert f"{count:,} (asked for 200)" in process.stdout
    assert "out.obj" in process.stdout


@pytest.mark.parametrize("words", [["-n", 6], ["-n", 6, "-n", 5]])
def test_a_quiet_remesh_still_warns_of_the_result(run_cli, tmp_path, words):
    """Regression: the warnings were a part of the summary, and lost with it."""
    save(box(n=2), tmp_path / "box.obj")
    process = run_cli("remesh", "box.obj", "-o", "out.glb", *words, "--no-fit", "-q", cwd=tmp_path)
    assert (process.returncode, process.stdout) == (0, "")
    lines = process.stderr.splitlines()
    assert any("of 8 corners have no vertex; ask for more vertices" in line for line in lines)
    assert all(line.startswith("anisomesh: warning: ") for line in lines)


def test_the_output_may_replace_the_input(run_cli, torus_obj, tmp_path):
    mesh = tmp_path / "mesh.obj"
    mesh.write_bytes(Path(torus_obj).read_bytes())
    assert run_cli("remesh", mesh, "-o", mesh, "-n", 150, "--max-iterations", 5, "-q").returncode == 0
    assert len(read(mesh).vertices) < 250
    assert list(tmp_path.iterdir()) == [mesh]
