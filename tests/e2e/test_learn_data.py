"""``anisomesh dataset``: built in parallel, resumed after a kill, bad meshes listed, families kept together."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import typer

import anisomesh
from anisomesh.cli.dataset import app
from anisomesh.errors import MeshFileError, OptionError
from anisomesh.execution.engine import WorkerPool
from anisomesh.learn.data.build import build
from anisomesh.learn.data.items import load_item
from anisomesh.learn.data.manifest import MANIFEST, files_of, read_manifest
from anisomesh.learn.data.recipe import VARIANTS, Recipe
from anisomesh.learn.data.sources import sources_of
from anisomesh.pipeline import remesh
from anisomesh.shapes.analytic import ellipsoid, sphere, torus

RECIPE = Recipe(target=100, variants=("decimated",))


@pytest.fixture
def folder(tmp_path):
    """Return a folder of three good meshes of two families, a round one, and a file that is no mesh."""
    folder = tmp_path / "meshes"
    (folder / "more").mkdir(parents=True)
    anisomesh.save(ellipsoid((1.0, 0.5, 0.3), 2), folder / "egg.ply")
    anisomesh.save(ellipsoid((1.0, 0.5, 0.32), 2), folder / "egg2.ply")
    anisomesh.save(torus(1.0, 0.3, 20, 10), folder / "more" / "ring.obj")
    anisomesh.save(sphere(2), folder / "ball.ply")
    (folder / "bad.ply").write_text("ply\nnothing")
    rows = [
        ("egg.ply", "eggs"),
        ("egg2.ply", "eggs"),
        ("more/ring.obj", "rings"),
        ("ball.ply", "balls"),
        ("bad.ply", "b"),
    ]
    (folder / "manifest.csv").write_text("file,family\n" + "\n".join(",".join(row) for row in rows))
    return folder


@pytest.mark.slow
def test_a_build_keeps_drops_and_lists_and_a_second_one_does_nothing(folder, tmp_path):
    """A source that is kept and one that fails are made by workers; the others in this process."""
    out, calls = tmp_path / "out", []
    recipe = Recipe(target=100, variants=("decimated",), min_stretch=1.2)
    sources = sources_of(folder, 1)
    two = [source for source in sources if source.name in {"egg", "bad"}]
    first = build(two, out, recipe, remesh, workers=WorkerPool(count=2), on_row=lambda *step: calls.append(step))
    assert sorted(number for _, number, _ in calls) == [1, 2]
    rows = build(sources, out, recipe, remesh, on_row=lambda *step: calls.append(step))
    assert all(row in rows for row in first)
    status = {row["name"]: row["status"] for row in rows}
    good = {"egg": "kept", "egg2": "kept", "more-ring": "kept", "blobs-0000": "kept"}
    assert status == {**good, "ball": "dropped", "bad": "failed"}
    reasons = {row["name"]: row["reason"] for row in rows if row["status"] != "kept"}
    assert "flat or round" in reasons["ball"]
    assert "bad.ply" in reasons["bad"]
    assert {row["split"] for row in rows if row["family"] == "eggs"} in ({"training"}, {"validation"})
    for row in rows:
        for entry in row.get("items", []):
            item = load_item(out / entry["file"])
            assert len(item.points) == entry["points"]
    assert sorted(number for _, number, _ in calls) == [1, 1, 2, 2, 3, 4]
    calls.clear()
    again = build(sources, out, recipe, remesh, on_row=lambda *step: calls.append(step))
    assert (again, calls) == (rows, [])
    anisomesh.save(ellipsoid((1.0, 0.6, 0.3), 2), folder / "egg.ply")
    ring = next(row for row in rows if row["name"] == "more-ring")
    (out / ring["items"][0]["file"]).unlink()
    build(sources_of(folder, 1), out, recipe, remesh, on_row=lambda *step: calls.append(step))
    assert {row["name"] for row, _, _ in calls} == {"egg", "more-ring"}  # what has changed, or is gone


@pytest.mark.slow
def test_a_build_that_was_killed_goes_on(folder, tmp_path):
    out = tmp_path / "out"
    code = (
        "from pathlib import Path; from anisomesh.learn.data.build import build\n"
        "from anisomesh.learn.data.sources import sources_of; from anisomesh.pipeline import remesh\n"
        "from anisomesh.learn.data.recipe import Recipe; from anisomesh.execution.engine import WorkerPool\n"
        f"if __name__ == '__main__': build(sources_of(Path({str(folder)!r}), 0), Path({str(out)!r}), "
        "Recipe(target=100, variants=('decimated',)), remesh, workers=WorkerPool(count=1))"
    )
    script = tmp_path / "run.py"
    script.write_text(code)
    process = subprocess.Popen([sys.executable, script], start_new_session=True)
    deadline = time.monotonic() + 120
    while not (out / MANIFEST).exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    before = read_manifest(out)
    assert 1 <= len(before) < 5
    for row in before:
        for entry in row.get("items", []):
            load_item(out / entry["file"])
    with (out / MANIFEST).open("a") as file:
        file.write('{"name": "half a ro')
    made = []
    rows = build(sources_of(folder, 0), out, RECIPE, remesh, on_row=lambda row, *_: made.append(row["name"]))
    assert len(rows) == 5
    assert set(made) == {row["name"] for row in rows} - {row["name"] for row in before}
    assert len(read_manifest(out)) == 5


@pytest.mark.slow
def test_the_manifest_has_the_requested_sources_and_their_current_families(folder, tmp_path):
    out, recipe = tmp_path / "out", Recipe(target=100, variants=())
    build(sources_of(folder, 2), out, recipe, remesh)
    (folder / "odd.ply").mkdir()  # no mesh, in spite of its name
    files = [path.relative_to(folder).as_posix() for path in sorted(folder.rglob("*.ply")) if path.is_file()]
    list_ = "".join(f"{file},{'one' if 'egg' in file else file}\n" for file in files)
    (folder / "manifest.csv").write_text("\ufefffile,family\n" + list_, encoding="utf-8")
    made = []
    sources = sources_of(folder, 1, validation=0.6)
    rows = build(sources, out, recipe, remesh, on_row=lambda row, *_: made.append(row))
    (folder / "odd.ply").rmdir()
    assert made == []
    assert read_manifest(out) == rows
    assert "blobs-0001" not in {row["name"] for row in rows}
    assert {row["family"] for row in rows if "egg" in row["name"]} == {"one"}
    splits = {row["family"]: row["split"] for row in rows}
    assert set(splits.values()) == {"training", "validation"}
    assert len(files_of(out).validation) == sum(
        len(row["items"]) for row in rows if row["split"] == "validation" and row["status"] == "kept"
    )


def test_the_split_depends_on_the_family_alone(folder):
    splits = {}
    for source in sources_of(folder, 300, validation=0.2):
        splits.setdefault(source.family, set()).add(source.split)
    assert all(len(found) == 1 for found in splits.values())
    share = np.mean([found == {"validation"} for found in splits.values()])
    assert 0.12 < share < 0.28


def test_wrong_folders_and_lists_are_refused(tmp_path):
    with pytest.raises(OptionError, match="not a folder"):
        sources_of(tmp_path / "none", 3)
    with pytest.raises(OptionError, match="no mesh"):
        sources_of(tmp_path, 0)
    (tmp_path / MANIFEST).write_text('nonsense\n{"name": "a"}\n')
    with pytest.raises(MeshFileError, match="line 1"):
        read_manifest(tmp_path)
    anisomesh.save(sphere(1), tmp_path / "a.ply")
    anisomesh.save(sphere(1), tmp_path / "a.obj")
    with pytest.raises(OptionError, match="two meshes have the same name"):
        sources_of(tmp_path, 0)


@pytest.mark.slow
def test_the_command_builds_and_tells(run_cli, folder, tmp_path):
    words = ("dataset", "build", folder, tmp_path / "out", "--target", 100, "--blobs", 1, "--parts", 1, "--no-variants")
    done = run_cli(*words, "--workers", 0)
    assert done.returncode == 0, done.stderr
    assert "bad" in done.stderr
    assert "[7/7]" in done.stderr
    info = run_cli("dataset", "info", tmp_path / "out")
    assert info.returncode == 0
    assert info.stdout.startswith(done.stdout.rstrip("\n"))
    assert "failed   bad" in info.stdout
    rows = [json.loads(line) for line in (tmp_path / "out" / MANIFEST).read_text().splitlines()]
    assert len(rows) == 7
    for words, code in ((("info", tmp_path), 1), (("build", tmp_path / "no", tmp_path / "x"), 1)):
        done = run_cli("dataset", *words)
        assert done.returncode == code
        assert len(done.stderr.strip().splitlines()) == 1


def test_variants_and_no_variants_exclude_each_other(run_cli, folder, tmp_path):
    done = run_cli("dataset", "build", folder, tmp_path / "out", "--variant", "given", "--no-variants")
    assert done.returncode == 2
    assert "either --variant or --no-variants" in done.stderr
    assert not (tmp_path / "out").exists()
    unknown = run_cli("dataset", "build", folder, tmp_path / "out", "--variant", "melted")
    assert unknown.returncode == 2
    assert "'melted' is not one of given, decimated, stretched" in unknown.stderr


def test_the_command_has_the_variants_of_a_recipe():
    command = typer.main.get_command(app).commands["build"]
    (variant,) = (parameter for parameter in command.params if parameter.name == "variant")
    assert tuple(variant.metavar.split("|")) == VARIANTS
