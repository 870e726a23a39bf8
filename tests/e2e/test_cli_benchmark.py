"""``anisomesh benchmark``: rows, reports, resuming after an interruption or a kill, failures as rows."""

import json
import os
import signal
import subprocess
import time
from dataclasses import replace

import pytest

from anisomesh.bench import methods
from anisomesh.bench.runs import read_rows, run_suite
from anisomesh.bench.suite import load_suite, parse_suite
from anisomesh.bench.tables import markdown, run_table, web_page
from anisomesh.errors import AnisomeshError, OptionError
from anisomesh.io.meshes import save
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import box, open_patch, sphere
from conftest import CLI

OURS = {"name": "ours", "method": "anisomesh", "options": {"max_iterations": 3, "embedding": "direct"}}
TOML = """
description = "two spheres"
shapes = ["sphere:40", "sphere:160"]
ratios = [0.5, 0.3]
samples = 200
methods = [{name = "ours", method = "anisomesh", options = {max_iterations = 3, embedding = "direct"}}]
"""


def suite(**change):
    return parse_suite("mine", {"shapes": ["sphere:100"], "ratios": [0.5], "samples": 200, "methods": [OURS], **change})


@pytest.mark.slow
def test_command_writes_rows_and_reports_and_goes_on(run_cli, tmp_path):
    (tmp_path / "two.toml").write_text(TOML)
    first = run_cli("benchmark", tmp_path / "two.toml", "-o", tmp_path / "out")
    assert first.returncode == 0, first.stderr
    assert "[4/4]" in first.stderr
    rows = [json.loads(line) for line in (tmp_path / "out/two.jsonl").read_text().splitlines()]
    assert [row["status"] for row in rows] == 4 * ["done"]
    assert {row["asked"] for row in rows} == {max(4, round(r * n)) for r in (0.5, 0.3) for n in (42, 162)}
    assert all(row["evaluation"]["validity"]["closed"] for row in rows)
    page, text = (tmp_path / "out/two.html").read_text(), (tmp_path / "out/two.md").read_text()
    assert "two spheres" in page
    assert "<svg" in page
    assert "![Distance against quality](two.svg)" in text
    assert "30% of the vertices" in (tmp_path / "out/two.svg").read_text()
    assert text.count("| ours |") >= 6
    again = run_cli("benchmark", tmp_path / "two.toml", "-o", tmp_path / "out")
    assert (again.returncode, again.stderr) == (0, "")
    assert (tmp_path / "out/two.jsonl").read_text().splitlines() == [json.dumps(row) for row in rows]


@pytest.mark.slow
def test_smoke_suite_runs_and_ours_are_valid_and_in_the_order_of_the_paper(run_cli, tmp_path, monkeypatch):
    given = load_suite("smoke")
    shorter = [
        replace(method, options={**method.options, "max_iterations": 15}) if method.method == "anisomesh" else method
        for method in given.methods
    ]
    smaller = replace(given, shapes=("part:300", "ring:300"), methods=tuple(shorter))  # half the points
    monkeypatch.setattr("anisomesh.bench.suite.load_suite", {"smoke": smaller}.get)
    done = run_cli("benchmark", "smoke", "-o", tmp_path, "--workers", 0, "--quiet")
    assert done.returncode == 0, done.stderr
    rows = read_rows(tmp_path / "smoke.jsonl")
    assert {row["status"] for row in rows} <= {"done", "absent"}
    found = {(row["mesh"], row["method"]): row["evaluation"] for row in rows if row["status"] == "done"}
    for mesh in {row["mesh"] for row in rows}:
        normal_metric, plain = found[mesh, "tessellation only (s = 7)"], found[mesh, "plain CVT (s = 1)"]
        for evaluation in (normal_metric, plain):
            validity = evaluation["validity"]
            assert validity["euler"] == validity["euler_input"]
            assert not (validity["nonmanifold_edges"] or validity["nonmanifold_vertices"] or validity["inverted"])
        assert normal_metric["distance"]["rms"] < plain["distance"]["rms"]
        assert normal_metric["shape"]["g_mean"] < plain["shape"]["g_mean"]
        fitted = found[mesh, "anisomesh"]
        assert fitted["distance"]["rms"] < normal_metric["distance"]["rms"]
        assert fitted["shape"]["g_mean"] > normal_metric["shape"]["g_mean"]


@pytest.mark.slow
def test_one_ratio_of_a_suite(run_cli, tmp_path):
    (tmp_path / "two.toml").write_text(TOML)
    done = run_cli("benchmark", tmp_path / "two.toml", "-o", tmp_path, "--ratio", 0.3, "--workers", 0, "--quiet")
    assert (done.returncode, done.stderr) == (0, "")
    assert {row["ratio"] for row in read_rows(tmp_path / "two.jsonl")} == {0.3}
    assert run_cli("benchmark", tmp_path / "two.toml", "-o", tmp_path, "--ratio", -1).returncode == 2


@pytest.mark.slow
def test_a_killed_benchmark_goes_on(run_cli, tmp_path):
    (tmp_path / "two.toml").write_text(TOML)
    rows = tmp_path / "out/two.jsonl"
    words = ["benchmark", str(tmp_path / "two.toml"), "-o", str(tmp_path / "out")]
    process = subprocess.Popen([*CLI, *words], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 240
    while not (rows.exists() and rows.read_bytes().count(b"\n") >= 1) and time.monotonic() < deadline:
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()
    before = rows.read_text()
    assert 1 <= before.count("\n") <= 4
    rows.write_text(before + '{"mesh": "sphe')  # a row that was being written
    done = run_cli(*words)
    assert done.returncode == 0, done.stderr
    after = rows.read_text()
    assert after.startswith(before)
    assert len(read_rows(rows)) == 4
    assert f"[{4 - before.count(chr(10))}/" in done.stderr or before.count("\n") == 4


def test_other_options_are_run_again(tmp_path):
    run_suite(suite(), tmp_path / "rows")
    steps = []
    run_suite(suite(), tmp_path / "rows", on_step=steps.append)
    assert not steps
    changed = {**OURS, "options": {**OURS["options"], "max_iterations": 4}}
    rows = run_suite(suite(methods=[changed]), tmp_path / "rows", on_step=steps.append)
    assert len(steps) == 1
    assert rows[0]["options"]["max_iterations"] == 4
    assert rows[0]["facts"]["iterations"] == 4


@pytest.mark.slow
def test_methods_get_disturbed_meshes_and_are_compared_with_the_clean_one(tmp_path, monkeypatch):
    given = {}

    def unchanged(surface, n, seed, options):
        given[len(given)] = surface
        return methods.MethodResult(surface, {})

    monkeypatch.setitem(methods.METHODS, "acvd", methods.Method(unchanged))
    inputs = ["clean", "noise 0.1", "noise 0.3", "stretched"]
    three = suite(shapes=["sphere:640"], inputs=inputs, methods=[{"name": "none", "method": "acvd"}])
    rows = run_suite(three, tmp_path / "rows")
    assert [row["input"] for row in rows] == inputs
    assert [row["asked"] for row in rows] == 4 * [round(0.5 * given[0].n_points)]
    far = [row["evaluation"]["distance"]["rms"] for row in rows]
    assert far[0] < 1e-9
    assert far[0] < far[1] < far[2]
    away = given[1].points - given[0].points
    assert away.std() == pytest.approx(0.1 * given[0].edge_lengths.mean(), rel=0.1)
    assert rows[3]["evaluation"]["shape"]["g_mean"] < rows[0]["evaluation"]["shape"]["g_mean"]
    again = run_suite(three, tmp_path / "others")
    assert [row["evaluation"] for row in again] == [row["evaluation"] for row in rows]
    assert "50% of noise 0.3" in markdown(three, rows)
    older = json.loads(json.dumps({key: value for key, value in rows[0].items() if key != "input"}))
    older["evaluation"]["validity"]["flipped"] = older["evaluation"]["validity"].pop("inverted")
    (tmp_path / "older").write_text(json.dumps(older) + "\n")
    steps = []
    read = run_suite(
        suite(shapes=["sphere:640"], methods=three_methods(three)), tmp_path / "older", on_step=steps.append
    )
    assert not steps
    assert read[0]["evaluation"]["validity"] == rows[0]["evaluation"]["validity"]


def three_methods(some):
    return [{"name": method.name, "method": method.method} for method in some.methods]


def test_failures_and_missing_packages_are_rows(tmp_path, monkeypatch):
    def broken(surface, n, seed, options):
        raise ZeroDivisionError("no luck")

    monkeypatch.setitem(methods.METHODS, "acvd", methods.Method(broken))
    monkeypatch.setitem(methods.METHODS, "pymeshlab-quadric", methods.Method(broken, ("no_such_package",)))
    three = suite(methods=[OURS, {"name": "broken", "method": "acvd"}, {"name": "away", "method": "pymeshlab-quadric"}])
    rows = run_suite(three, tmp_path / "rows")
    assert [row["status"] for row in rows] == ["done", "failed", "absent"]
    assert rows[1]["error"] == "ZeroDivisionError: no luck"
    assert rows[2]["error"] == "no_such_package not installed"
    assert len(read_rows(tmp_path / "rows")) == 2  # what is absent now may be there next time
    for report in (markdown(three, rows), web_page(three, rows)):
        assert "no luck" in report
        assert "away (no_such_package not installed)" in report


@pytest.mark.slow
def test_open_and_broken_meshes_are_rows(tmp_path):
    folder = tmp_path / "data"
    folder.mkdir()
    save(box(n=3), folder / "a.ply")
    save(open_patch(lambda x, y: x * y, n=4), folder / "b.ply")
    (folder / "c.ply").write_text("ply\nformat ascii 1.0\nend_header\n")
    rows = run_suite(suite(meshes=["*.ply"], shapes=[], closed=True), tmp_path / "rows", data=folder)
    assert [(row["mesh"], row["status"]) for row in rows] == [
        ("a.ply", "done"),
        ("b.ply", "skipped"),
        ("c.ply", "failed"),
    ]
    assert "c.ply" in rows[2]["error"]


def test_the_boundary_of_open_meshes_is_in_the_tables(tmp_path):
    save(open_patch(lambda x, y: x * y, n=12), tmp_path / "open.ply")
    both = suite(meshes=["*.ply"], ratios=[0.5])
    rows = run_suite(both, tmp_path / "rows", data=tmp_path)
    heading, lines = run_table(rows)
    shown = {line[0]: line[heading.index("boundary max [edges]")] for line in lines}
    closed = next(name for name in shown if name != "open.ply")
    assert 0.0 <= float(shown["open.ply"]) < 0.5
    assert shown[closed] == "-"


def test_a_foreign_file_of_rows_is_not_touched(tmp_path):
    path = tmp_path / "rows"
    path.write_text("not a row\n")
    with pytest.raises(AnisomeshError, match="line 1: not a row"):
        run_suite(suite(), path)
    assert path.read_text() == "not a row\n"


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in methods.METHODS if name != "anisomesh"])
def test_other_remeshers_give_about_the_requested_number_of_vertices(name):
    remesher = methods.METHODS[name]
    if remesher.missing:
        pytest.skip(f"{', '.join(remesher.missing)} not installed")
    surface = sphere(4)
    produced = remesher.run(surface, 300, 0, {}).surface
    assert isinstance(produced, Surface)
    assert 200 < produced.n_points < 400


def test_list_and_errors(run_cli, tmp_path):
    assert "table1" in run_cli("benchmark", "--list").stdout
    assert run_cli("benchmark").returncode == 2
    environment = {key: "" for key in os.environ if key == "ANISOMESH_DATA"}
    away = run_cli("benchmark", "table1", "-o", tmp_path, "--data", tmp_path, **environment)
    assert away.returncode == 1
    assert "has none of them" in away.stderr
    unknown = run_cli("benchmark", "smok", "-o", tmp_path)
    assert unknown.returncode == 1
    assert "did you mean 'smoke'" in unknown.stderr


@pytest.mark.slow
def test_a_suite_trains_the_networks_that_it_compares(tmp_path, item_folder):
    pytest.importorskip("torch")

    training = {"epochs": 2, "network": {"channels": 8, "scales": 2, "blocks": 1, "heads": 1}}
    paper = {"epochs": 1, "paper": {"channels": 8, "levels": 2}}
    neural = {"method": "anisomesh", "options": {"embedding": "neural", "max_iterations": 3}}
    ours, theirs = ({"name": n, **neural, "training": t} for n, t in (("ours 1", training), ("theirs", paper)))
    wanted = suite(shapes=["ring:100"], methods=[ours, theirs])
    with pytest.raises(OptionError, match="name a data set with --items"):
        run_suite(wanted, tmp_path / "rows.jsonl")
    told, steps = [], []
    rows = run_suite(wanted, tmp_path / "rows.jsonl", items=item_folder, on_step=told.append)
    assert [row["status"] for row in rows] == ["done", "done"]
    assert [step.split(",")[0] for step in told if isinstance(step, str)] == [
        "ours 1: epoch 1 of 2",
        "ours 1: epoch 2 of 2",
        "theirs: epoch 1 of 1",
    ]
    folders = [path.parent.name for path in (tmp_path / "rows").glob("*/weights.safetensors")]
    assert sorted(name.rpartition("-")[0] for name in folders) == ["ours-1", "theirs"]
    run_suite(wanted, tmp_path / "rows.jsonl", on_step=steps.append)
    assert not steps
    told.clear()
    changed = suite(shapes=["ring:100"], methods=[ours, {**theirs, "training": {**paper, "rate": 1e-3}}])
    run_suite(changed, tmp_path / "rows.jsonl", items=item_folder, on_step=told.append)
    line, step = told
    assert line.split(",")[0] == "theirs: epoch 1 of 1"  # and not a refusal to go on
    assert step.row["method"] == "theirs"
    wrong = suite(methods=[{**ours, "training": {"epoch": 2}}])
    with pytest.raises(OptionError, match="did you mean 'epochs'"):
        run_suite(wrong, tmp_path / "others.jsonl", items=item_folder)
