"""``anisomesh evaluate``: text, JSON and errors."""

import json

import pytest

from anisomesh.io.meshes import save
from anisomesh.shapes.analytic import box, sphere


@pytest.fixture
def files(tmp_path):
    save(box(n=6), tmp_path / "reference.ply")
    save(box(n=2), tmp_path / "result.obj")
    save(sphere(1), tmp_path / "ball.off")
    return tmp_path


def test_text_names_every_group_of_figures(run_cli, files):
    done = run_cli("evaluate", files / "reference.ply", files / "result.obj", "--samples", 2000)
    assert done.returncode == 0
    for word in ("closed", "RMS", "quality G", "angles", "creases", "corners", "CD x1e-5", "floor"):
        assert word in done.stdout
    assert "8 of 8 kept" in done.stdout
    assert "100.0%" in done.stdout


@pytest.mark.slow
def test_json_is_strict_and_complete(run_cli, files):
    done = run_cli("evaluate", files / "reference.ply", files / "ball.off", "--samples", 200, "--json")
    facts = json.loads(done.stdout, parse_constant=pytest.fail)
    assert done.returncode == 0
    assert set(facts) >= {"sampled", "floor", "distance", "shape", "features", "validity", "boundary"}
    assert facts["sampled"]["edge_f1"] >= 0.0
    assert facts["features"]["corners"] == 8


def test_errors_are_one_line(run_cli, files):
    missing = run_cli("evaluate", files / "reference.ply", files / "nothing.ply")
    assert missing.returncode == 1
    assert len(missing.stderr.splitlines()) == 1
    assert "nothing.ply" in missing.stderr
    assert run_cli("evaluate", files / "reference.ply").returncode == 2
    assert run_cli("evaluate", files / "reference.ply", files / "ball.off", "--samples", 0).returncode == 2
