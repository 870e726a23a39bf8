"""What users of other programs expect of a command line: short options, per cent, a log, completion, a default name."""

import logging

import pytest

from anisomesh.io.meshes import load
from conftest import torus_arrays, write_obj

FAST = ("--metric", "uniform", "--max-iterations", 2, "--no-fit")


@pytest.fixture
def part(tmp_path):
    """A torus of 288 points in a folder below the current one, with a face that a reader leaves out."""
    (tmp_path / "parts").mkdir()
    path = write_obj(tmp_path / "parts" / "part.obj", *torus_arrays(24, 12))
    path.write_text(path.read_text() + "f 1 2\n")
    return path


@pytest.fixture
def run(run_cli, tmp_path):
    def run(*words, **environment):
        return run_cli(*words, cwd=tmp_path, **environment)

    return run


def test_the_version_has_a_short_option(run):
    assert run("-V").stdout == run("--version").stdout != ""


@pytest.mark.parametrize("ratio", ["25%", "0.25", ".25", "2.5e1%"])
def test_a_ratio_may_be_in_per_cent(run, part, ratio):
    assert run("remesh", part, "-o", "out.ply", "--ratio", ratio, *FAST).returncode == 0
    assert load(part.parents[1] / "out.ply").n_points == 72


@pytest.mark.parametrize(
    ("ratio", "words"), [("a%", "'a%' is not a share such as 0.2, or 20%"), ("-5%", "-5.0 is not a positive finite")]
)
def test_a_ratio_that_is_none_is_refused(run, part, ratio, words):
    for command in (["remesh", part, "--ratio"], ["figure", "strip", part, "-o", "a.png", "--ratios"]):
        done = run(*command, ratio)
        assert done.returncode == 2
        assert words in done.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--ratios", 0.5, "20%", "abc"], "--ratios: 'abc' is not a share such as 0.2, or 20%"),
        (["--ratios", 0.5, "--seed", 1, "abc"], "extra argument(s) (abc) after --seed 1"),
        (["-n", 200, 100], "extra argument(s) (100) after -n 200"),
        (["--lock", "a", "b", "c", "-n", 50], "extra argument(s) (b c) after --lock a"),
    ],
)
def test_a_word_too_many_is_reported_with_the_option_that_it_follows(run, part, words, message):
    done = run("remesh", part, *words)
    assert done.returncode == 2
    assert message in done.stderr


@pytest.mark.parametrize("sharpness", ["-3", "0.5", "inf", "nan"])
def test_a_sharpness_out_of_range_gets_the_same_answer_whatever_it_is(run, part, sharpness):
    for option in ("--sharpness", "--final-sharpness"):
        done = run("remesh", part, "-n", 50, option, sharpness)
        assert done.returncode == 2
        assert f"'{option}': {sharpness} is not a finite number of at least 1" in done.stderr


def test_without_a_name_the_result_is_beside_the_input_and_replaces_nothing(run, part, tmp_path):
    out = part.with_name("part_remeshed.obj")
    done = run("remesh", part, "-n", 50, *FAST)
    assert done.returncode == 0
    assert str(out) in done.stdout
    assert load(out).n_points == 50
    before = out.read_bytes()
    done = run("remesh", part, "-n", 60, *FAST)
    assert done.returncode == 2
    assert f"{out} exists; give -o {out} to replace it" in done.stderr
    assert out.read_bytes() == before
    assert run("remesh", part, "-o", out, "-n", 60, *FAST).returncode == 0
    assert load(out).n_points == 60
    assert run("remesh", part, "-n", 50, "--output-format", "PLY", *FAST).returncode == 0
    assert load(part.with_name("part_remeshed.ply")).n_points == 50
    plain = tmp_path / "scan"
    plain.write_bytes(part.read_bytes())
    assert run("remesh", plain, "-n", 50, "--input-format", "obj", *FAST).returncode == 0
    assert load(tmp_path / "scan_remeshed.obj").n_points == 50


def test_standard_input_has_no_default_name(run):
    done = run("remesh", "-", "--input-format", "ply", "-n", 50)
    assert done.returncode == 2
    assert "give -o OUT" in done.stderr


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["drawing.svg"], 2, "drawing.svg: expected a file name ending in one of"),
        (["missing.ply"], 1, "missing.ply: no such file"),
        ([".", "--input-format", "ply"], 1, ".: is a folder"),
        (["part.ply", "--output-format", "docx"], 2, "--output-format docx: expected one of"),
    ],
)
def test_an_input_without_a_good_name_is_refused_by_its_own_name(run, tmp_path, words, code, message):
    done = run("remesh", *words, "-n", 50, "-q")
    assert done.returncode == code
    assert done.stderr.startswith("anisomesh: error: ")
    assert message in done.stderr
    assert list(tmp_path.iterdir()) == []


def lines(process, level):
    return [line for line in process.stderr.splitlines() if line.startswith(f"anisomesh: {level}: ")]


def test_the_log_is_shown_on_request(run, part):
    words = ["remesh", part, "-o", "out.ply", "-n", 50, "-q", *FAST]
    silent, verbose, most = run(*words), run(*words, "-v"), run(*words, "-vv")
    assert silent.stderr.splitlines() == lines(silent, "warning")
    assert [bool(lines(done, "info")) for done in (silent, verbose, most)] == [False, True, True]
    assert [bool(lines(done, "debug")) for done in (silent, verbose, most)] == [False, False, True]
    assert run(*words, "--verbose", "--verbose").stderr.count("debug") == most.stderr.count("debug")
    assert not logging.getLogger("anisomesh").handlers


def test_a_warning_of_a_reader_is_shown_once(run, part, caplog):
    """Also if a file is read twice, and if somebody has set up a handler for all loggers."""
    for words in (["info", part], ["evaluate", part, part, "--samples", 100], ["info", part, "-v"]):
        done = run(*words)
        assert done.returncode == 0
        assert len(lines(done, "warning")) == 1
        assert "part.obj" in lines(done, "warning")[0]
    assert caplog.text == ""


def test_density_from_a_file_makes_triangles_smaller_where_it_is_larger(run, part):
    surface = load(part)
    weights = part.with_name("weights.txt")
    weights.write_text("# x > 0\n" + "".join(f"{300.0 if x > 0 else 1.0}\n" for x in surface.points[:, 0]))
    words = ["--metric", "uniform", "--no-fit", "-n", 100, "-q"]
    assert run("remesh", part, "-o", "out.ply", "--density", weights, *words).returncode == 0
    points = load(part.parents[1] / "out.ply").points
    assert (points[:, 0] > 0).mean() > 0.75  # areas differ by a factor of 17


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("1 2\n", "weights.txt, line 1: '1 2'; expected one finite number"),
        ("1\n\nnan\n", "weights.txt, line 3: 'nan'; expected one finite number"),
        ("1\n2\n", "weights.txt: found 2 numbers; expected 288"),
        ("\n".join(["1"] * 287 + ["-1"]), "density[287] = -1; expected a positive weight"),
        (None, "weights.txt: no such file; expected a text file, a number per line"),
    ],
)
def test_a_density_that_cannot_be_used_is_refused(run, part, content, words):
    if content is not None:
        part.with_name("weights.txt").write_text(content)
    done = run("remesh", part, "-o", "out.ply", "-n", 50, "--density", "parts/weights.txt", "-q")
    assert done.returncode == 1
    assert words in done.stderr
    assert not (part.parents[1] / "out.ply").exists()


def test_no_output_replaces_the_density(run, part):
    weights = part.with_name("weights.obj")
    weights.write_text("1\n")
    done = run("remesh", part, "-o", weights, "-n", 50, "--density", weights)
    assert done.returncode == 2
    assert "is an input and would be overwritten" in done.stderr


def test_two_outputs_are_not_the_same_file_under_two_names(run, part, tmp_path):
    (tmp_path / "link").symlink_to(part.parent)
    done = run("remesh", part, "-o", "parts/out.obj", "--rvd", "link/out.obj", "-n", 50)
    assert done.returncode == 2
    assert "two outputs have the same file name" in done.stderr


@pytest.mark.slow
def test_shells_complete_commands_options_and_values(run_process, monkeypatch):
    def completed(words):
        monkeypatch.setenv("_ANISOMESH_COMPLETE", "complete_bash")
        monkeypatch.setenv("COMP_WORDS", words)
        monkeypatch.setenv("COMP_CWORD", str(words.count(" ")))
        return run_process().stdout.split()

    assert completed("anisomesh rem") == ["remesh"]
    assert completed("anisomesh remesh a.ply --max-e") == ["--max-error"]
    assert completed("anisomesh remesh a.ply --metric u") == ["uniform"]
    monkeypatch.delenv("_ANISOMESH_COMPLETE")
    monkeypatch.setenv("_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION", "1")  # the parent process need not be a shell
    assert "_ANISOMESH_COMPLETE=complete_bash" in run_process("--show-completion", "bash").stdout
