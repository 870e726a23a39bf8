"""Wrong usage is exit code 2, refused input exit code 1; one line on stderr, nothing on stdout, no file left."""

import subprocess
from importlib.metadata import version

import pytest

from anisomesh.cli.main import main
from conftest import CLI


@pytest.fixture
def refuse(capsys, monkeypatch, tmp_path):
    """Run the command line in this process, in an empty folder, and check the manner of its refusal."""
    monkeypatch.chdir(tmp_path)

    def run(code, *words):
        assert main([str(word) for word in words]) == code
        out, err = capsys.readouterr()
        assert out == ""
        line = err.splitlines()[-1]
        assert line.startswith("anisomesh: error: ")
        assert "Traceback" not in err
        return line

    return run


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([], "-n"),
        (["-n", "100", "--ratio", "0.5"], "give one of"),
        (["-n", "0"], "--vertices"),
        (["-n", "-5"], "--vertices"),
        (["-n", "many"], "--vertices"),
        (["--ratio", "0"], "0.0 is not a positive finite number"),
        (["--ratio", "nan"], "nan is not a positive finite number"),
        (["--ratio", "inf"], "inf is not a positive finite number"),
        (["-n", "100", "--sharpness", "nan"], "--sharpness"),
        (["-n", "100", "--sharpness", "-1"], "--sharpness"),
        (["-n", "100", "--final-sharpness", "inf"], "--final-sharpness"),
        (["-n", "100", "--threads", "0"], "--threads"),
        (["-n", "100", "--seed", "-1"], "--seed"),
        (["-n", "100", "--metric", "euclidean"], "--metric"),
        (["-n", "100", "--embedding", "magic"], "--embedding"),
        (["-n", "100", "--rvd", "cells.png"], ".vtu or .obj"),
        (["-n", "100", "--picture", "both.jpg"], ".png"),
        (["-n", "100", "--report", "out.ply"], "same file name"),
        (["-n", "100", "--report", "missing/report.json"], "there is no folder missing"),
        (["-n", "100", "--shapness", "3"], "--shapness"),
    ],
)
def test_wrong_usage(refuse, torus_obj, tmp_path, words, expected):
    line = refuse(2, "remesh", torus_obj, "-o", "out.ply", *words)
    assert expected in line
    assert line.endswith("see 'anisomesh remesh --help'")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("out", ["missing/out.ply", ".", "out.xyz", "out"])
def test_an_output_that_cannot_be_written_is_refused_before_any_work(run_cli, torus_obj, tmp_path, out):
    process = run_cli("remesh", torus_obj, "-o", out, "-n", 100, cwd=tmp_path)
    assert (process.returncode, process.stdout) == (2, "")
    assert process.stderr.startswith("anisomesh: error: ")
    assert len(process.stderr.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("missing.ply", None),
        ("empty.obj", ""),
        ("noise.ply", "ply\nformat ascii 1.0\nelement vertex 3\n"),
        ("nan.obj", "v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n"),
        ("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
        ("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"),
        ("drawing.svg", "<svg/>"),
    ],
)
@pytest.mark.parametrize("command", ["remesh", "info"])
def test_a_file_that_is_no_mesh_is_one_line(refuse, tmp_path, command, name, content):
    if content is not None:
        (tmp_path / name).write_text(content)
    words = ["-o", "out.ply", "-n", 100] if command == "remesh" else []
    assert name in refuse(1, command, name, *words)
    assert len(list(tmp_path.iterdir())) == (content is not None)


def test_an_old_output_survives_an_error(run_cli, tmp_path):
    (tmp_path / "bad.obj").write_text("v 0 0 0\nf 1 1 1\n")
    (tmp_path / "out.ply").write_text("precious")
    assert run_cli("remesh", "bad.obj", "-o", "out.ply", "-n", 100, cwd=tmp_path).returncode == 1
    assert (tmp_path / "out.ply").read_text() == "precious"
    assert len(list(tmp_path.iterdir())) == 2


def test_no_command_shows_the_help_and_is_wrong_usage(run_cli):
    process = run_cli()
    assert process.returncode == 2
    assert all(command in process.stdout for command in ("remesh", "info", "demo"))


def test_unknown_command(refuse):
    assert "smooth" in refuse(2, "smooth")


def test_version(run_cli):
    process = run_cli("--version")
    assert (process.returncode, process.stdout) == (0, f"anisomesh {version('anisomesh')}\n")


def test_a_reader_that_goes_away_is_no_traceback(torus_obj):
    with subprocess.Popen([*CLI, "info", str(torus_obj)], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert process.stderr.read() == b""
