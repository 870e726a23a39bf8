"""Wrong usage is exit code 2, refused input exit code 1; one line on stderr, nothing on stdout, no file left."""

import shlex
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from conftest import CLI


@pytest.fixture
def refuse(run_cli, tmp_path):
    """Run the command line in an empty folder and check the form of its refusal."""

    def run(code, *words):
        done = run_cli(*words, cwd=tmp_path)
        assert (done.returncode, done.stdout) == (code, "")
        line = done.stderr.splitlines()[-1]
        assert line.startswith("anisomesh: error: ")
        assert "Traceback" not in done.stderr
        return line

    return run


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([], "-n"),
        (["-n", "100", "--ratio", "0.5"], "give one of"),
        (["-n", "0"], "expected at least 4;"),
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
        (["-n", "100", "--metric", "euclidean"], "'--metric': 'euclidean' is not one of"),
        (["-n", "100", "--embedding", "magic"], "--embedding"),
        (["-n", "100", "--rvd", "cells.png"], ".vtu or .obj"),
        (["-n", "100", "--picture", "both.jpg"], ".png"),
        (["-n", "100", "--report", "out.ply"], "same file name"),
        (["-n", "100", "--report", "missing/report.json"], "the folder missing does not exist"),
        (["-n", "100", "--shapness", "3"], "--shapness"),
        (["-n", "100", "--weld", "-1"], "--weld -1: expected a finite length of at least 0, or auto"),
        (["-n", "100", "--weld", "x"], "0.1% of the diagonal, or auto"),
        (["-n", "1e3"], "expected a whole number;"),
        (["--edge-length", ".2", "-n", "100"], "-n and --edge-length are given; give one of"),
        (["--adapt-to", "u"], "not how small; give -n, --ratio or --ratios with it;"),
        (["--edge-length", "nan"], "--edge-length nan: expected a positive finite length"),
        (["--max-error", "0%"], "--max-error 0%: expected a positive finite length"),
        (["-n", "100", "--threads", "99999999999999999999"], "--threads"),
        (["-n", "100", "--report", "/dev/null"], "not a plain file"),
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


@pytest.mark.parametrize("option", ["--report", "--picture", "--rvd", "--out"])
def test_no_output_overwrites_an_input(run_cli, torus_obj, tmp_path, option):
    """Only the mesh may replace its own input; no file of features or network is replaced either."""
    suffix = {"--report": ".obj", "--picture": ".png", "--rvd": ".obj", "--out": ".obj"}[option]
    mesh, pairs = tmp_path / f"mesh{suffix}", tmp_path / "pairs.obj"
    mesh.write_bytes(torus_obj.read_bytes())
    pairs.write_text("0 1\n")
    (tmp_path / "link").symlink_to(tmp_path)
    out = pairs if option == "--out" else tmp_path / "link" / mesh.name
    words = [option, out] if option == "--out" else ["-o", "out.ply", option, out]
    done = run_cli("remesh", mesh, "-n", 100, *words, "--features", pairs, cwd=tmp_path)
    assert done.returncode == 2
    assert "is an input and would be overwritten" in done.stderr
    assert mesh.read_bytes() == torus_obj.read_bytes()
    assert pairs.read_text() == "0 1\n"
    assert not (tmp_path / "out.ply").exists()


def test_no_figure_overwrites_its_input_through_a_link(run_cli, torus_obj, tmp_path):
    (tmp_path / "mesh.obj").write_bytes(torus_obj.read_bytes())
    (tmp_path / "link.png").symlink_to(tmp_path / "mesh.obj")
    for words in (["result", "mesh.obj", "mesh.obj"], ["gallery", torus_obj, "mesh.obj"], ["strip", "mesh.obj"]):
        done = run_cli("figure", *words, "-o", "link.png", cwd=tmp_path)
        assert done.returncode == 2
        assert "is an input and would be overwritten" in done.stderr
    assert (tmp_path / "mesh.obj").read_bytes() == torus_obj.read_bytes()


def test_a_ratio_that_no_machine_can_do_is_refused(refuse, torus_obj):
    assert "--ratio = 1e+308" in refuse(1, "remesh", torus_obj, "-o", "out.ply", "--ratio", "1e308")


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["-n", 100, "--lock", "lid"], "error: --lock = 'lid' is not a region of the mesh"),
        (["-n", 100, "--weld", "1000"], "error: --weld is 1000; expected a length"),
        (["-n", 100, "--weld", "10%"], "give a smaller --weld"),
        (["-n", 100, "--seed", 2**64], f"error: --seed = {2**64}; expected a whole number"),
        (["-n", 100, "--keep-points", "few.txt"], "error: --keep-points has 99999; expected 0 to"),
        (["--edge-length", ".3", "--density", "ones.txt"], "an --edge-length or size of --metric-file both say"),
    ],
)
def test_messages_name_options_of_the_command_line(refuse, torus_obj, tmp_path, words, expected):
    """Regression: messages had the names that options have in Python, such as weld_tolerance."""
    n = sum(line.startswith("v ") for line in torus_obj.read_text().splitlines())
    (tmp_path / "few.txt").write_text("99999\n")
    (tmp_path / "ones.txt").write_text("1\n" * n)
    assert expected in refuse(1, "remesh", torus_obj, "-o", "out.ply", *words)


def test_an_output_that_is_a_loop_of_links_is_refused(refuse, torus_obj, tmp_path):
    (tmp_path / "loop.ply").symlink_to(tmp_path / "loop.ply")
    assert "loop.ply cannot be written" in refuse(2, "remesh", torus_obj, "-o", "loop.ply", "-n", 100)


@pytest.mark.skipif(sys.platform == "win32", reason="needs a POSIX shell")
@pytest.mark.slow
def test_a_closed_standard_output_is_no_error(torus_obj):
    command = shlex.join([*CLI, "info", str(torus_obj)])
    done = subprocess.run(["sh", "-c", f"{command} >&-"], capture_output=True, text=True, timeout=60, check=False)
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a folder that nobody can write")
def test_a_folder_that_cannot_be_written_is_found_out_before_the_work(refuse, torus_obj):
    assert "cannot be written" in refuse(2, "remesh", torus_obj, "-o", "/proc/out.ply", "-n", 100)


def test_a_file_of_features_that_is_missing_or_binary_is_named(refuse, torus_obj, tmp_path):
    words = ["remesh", torus_obj, "-o", "out.ply", "-n", 100, "--features"]
    line = refuse(1, *words, "missing.txt")
    assert line == ("anisomesh: error: missing.txt: no such file; expected a text file, two vertex numbers per line")
    (tmp_path / "pairs.bin").write_bytes(b"\xff\xfe\x00")
    assert "pairs.bin: cannot be read as text" in refuse(1, *words, "pairs.bin")


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
def test_an_invalid_mesh_file_is_reported_in_one_line(refuse, tmp_path, command, name, content):
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


@pytest.mark.slow
@pytest.mark.parametrize("command", [[Path(sys.executable).with_name("anisomesh")], CLI], ids=["script", "module"])
def test_the_entry_points_print_the_version(command):
    done = subprocess.run([*command, "--version"], capture_output=True, text=True, timeout=60, check=True)
    assert (done.stdout, done.stderr) == (f"anisomesh {version('anisomesh')}\n", "")


@pytest.mark.slow
@pytest.mark.parametrize(("words", "code"), [(["info", "missing.ply"], 1), (["info"], 2)])
def test_the_exit_code_of_the_process_is_the_one_of_the_command(run_process, tmp_path, words, code):
    done = run_process(*words, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (code, "")
    assert done.stderr.startswith("anisomesh: error: ")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.slow
def test_a_closed_pipe_gives_no_traceback(torus_obj):
    with subprocess.Popen([*CLI, "info", str(torus_obj)], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert process.stderr.read() == b""


@pytest.mark.parametrize(
    "words",
    [
        ("info", "{}.ply"),
        ("evaluate", "{}.ply", "{}.ply"),
        ("remesh", "MESH", "-o", "out.ply", "-n", 100, "--features", "{}.txt"),
        ("remesh", "MESH", "-o", "out.ply", "-n", 100, "--density", "{}.txt"),
        ("remesh", "MESH", "-o", "out.ply", "-n", 100, "--weights", "{}.safetensors"),
        ("train", "{}.toml"),
        ("benchmark", "{}.toml"),
        ("figure", "result", "{}.ply", "MESH", "-o", "out.png"),
    ],
)
def test_a_missing_folder_of_an_input_is_named(refuse, torus_obj, words):
    def told(name):
        return refuse(1, *(torus_obj if word == "MESH" else str(word).format(name) for word in words))

    assert "the folder no does not exist" in told("no/such/file")
    assert "does not exist" not in told("./file")


@pytest.mark.parametrize(
    ("words", "first", "second"),
    [
        (("evaluate", "a.ply", "b.ply"), "a.ply", "b.ply"),
        (("remesh", "a.ply", "-n", 100, "-o", "o.ply", "--density", "b.txt"), "a.ply", "b.txt"),
        (("remesh", "a.ply", "-o", "o.ply", "--metric-file", "b.sol:1"), "a.ply", "b.sol"),
        (("remesh", "a.ply", "-n", 100, "-o", "o.ply", "--adapt-to", "b.vtu:p"), "a.ply", "b.vtu"),
        (("remesh", "MESH", "-o", "o.ply", "--metric-file", "a.npy", "--features", "b.txt"), "a.npy", "b.txt"),
        (("figure", "result", "a.ply", "b.ply", "-o", "o.png"), "a.ply", "b.ply"),
        (("figure", "gallery", "MESH", "a.ply", "b.ply", "-o", "o.png"), "a.ply", "b.ply"),
        (("batch", "-n", 100, "-o", "out", "a.ply", "MESH", "b.ply"), "a.ply", "b.ply"),
        (("batch", "-n", 100, "-o", "out", "--manifest", "a.csv", "b.ply"), "a.csv", "b.ply"),
    ],
)
def test_of_several_missing_files_all_are_named(refuse, torus_obj, tmp_path, words, first, second):
    """Regression: the one that is read first was named, which was not the first one given."""
    line = refuse(1, *(torus_obj if word == "MESH" else word for word in words))
    assert line == f"anisomesh: error: {first}: no such file; {second}: no such file"
    assert list(tmp_path.iterdir()) == []


def test_files_of_another_number_of_vertices_are_refused_with_both_numbers(refuse, torus_obj, tmp_path):
    n = sum(line.startswith("v ") for line in torus_obj.read_text().splitlines())
    (tmp_path / "few.txt").write_text("1.0\n" * (n - 1))
    (tmp_path / "pairs.txt").write_text(f"0 {n}\n")
    command = ("remesh", torus_obj, "-o", "out.ply", "-n", 100)
    line = refuse(1, *command, "--density", "few.txt")
    assert f"few.txt: found {n - 1:,} numbers; expected {n:,}" in line
    line = refuse(1, *command, "--features", "pairs.txt")
    assert f"pairs.txt: found vertex {n}; expected 0 to {n - 1}" in line
