"""Batches without worker processes: inputs, manifests, keys, rows, what is left, reports, exit codes."""

import csv
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest

from anisomesh.batch import Job, Settings, WorkerPool, run
from anisomesh.batch.inputs import jobs_of
from anisomesh.batch.jobs import checked
from anisomesh.batch.keys import facts_of_files, key_of
from anisomesh.batch.manifest import read_manifest
from anisomesh.batch.options import OPTION_NAMES, for_mesh, plain_options
from anisomesh.batch.rows import Results
from anisomesh.batch.running import Batch
from anisomesh.batch.work import BatchTask, do
from anisomesh.errors import AnisomeshError, OptionError
from anisomesh.execution.engine import Outcome, Work, has_dask
from anisomesh.io.meshes import load
from conftest import torus_arrays, write_obj

HERE = Settings(workers=WorkerPool(count=0))
TARGET = {"n_vertices": 30}
FAST = {**TARGET, "max_iterations": 1, "embedding": "direct", "fit": False, "threads": 1}
QUICK_WORDS = ["-n", 30, "--max-iterations", 1, "--embedding", "direct", "--no-fit", "--workers", 0, "--no-thumbnails"]


@pytest.fixture
def meshes(tmp_path):
    """A folder with three tori, one in a folder of its own, and other files."""
    folder = tmp_path / "in"
    (folder / "sub").mkdir(parents=True)
    for k, name in enumerate(("a.obj", "b.obj", "sub/a.obj")):
        write_obj(folder / name, *torus_arrays(10 + k, 6))
    (folder / "notes.txt").write_text("not a mesh")
    (folder / ".hidden.obj").write_text("left by another program")
    return folder


def jobs(folder, options=TARGET):
    return jobs_of([str(folder)], options)


class Recorder:
    """Work that notes the inputs it is given and writes something in place of a mesh."""

    def __init__(self, failing=()):
        self.seen, self.failing = [], failing

    def __call__(self, task, attempt):
        name = Path(task.job.input).name
        self.seen.append(name)
        if name in self.failing:
            raise ValueError("no luck")
        files = facts_of_files(task.job)
        Path(task.target).parent.mkdir(exist_ok=True)
        Path(task.target).write_text("a mesh")
        return {"status": "done", "key": key_of(task.job, files), "files": files, "seconds": 0.1, "report": {}}

    def run(self, some_jobs, folder, settings=HERE):
        self.seen = []
        return Batch(some_jobs, folder, settings).run(work=Work(do=self))


# --- inputs


def test_folders_patterns_and_files_keep_their_folders(meshes):
    assert [job.output for job in jobs(meshes)] == ["a.obj", "b.obj", "sub/a.obj"]
    assert [job.output for job in jobs_of([f"{meshes}/**/a.obj"], TARGET)] == ["a.obj", "sub/a.obj"]
    assert [job.output for job in jobs_of([f"{meshes}/s*/*.obj"], TARGET)] == ["sub/a.obj"]
    assert [job.output for job in jobs_of([f"{meshes}/sub/a.obj"], TARGET, output_format="PLY")] == ["a.ply"]
    twice = jobs_of([f"{meshes}/a.obj", str(meshes)], TARGET)
    assert len({job.input for job in twice}) == len(twice) == 3


def test_results_below_an_input_folder_are_no_inputs(meshes):
    (meshes / "out").mkdir()
    (meshes / "out/a.obj").write_bytes((meshes / "a.obj").read_bytes())
    found = jobs_of([str(meshes)], TARGET, without=str(meshes / "out"))
    assert [job.output for job in found] == ["a.obj", "b.obj", "sub/a.obj"]


@pytest.mark.parametrize("name", ["missing.obj", "nowhere/*.obj", "sub/*.ply"])
def test_names_without_a_mesh_are_errors(meshes, name):
    with pytest.raises(OptionError, match=re.escape(name)):
        jobs_of([str(meshes / name)], TARGET)


def test_faults_of_jobs_are_found_before_any_work(meshes, tmp_path):
    a, b = str(meshes / "a.obj"), str(meshes / "b.obj")
    for wrong, message in [
        ([], "no meshes were given"),
        (
            [Job(input=a, output="x.ply", options=TARGET), Job(input=b, output="./x.ply", options=TARGET)],
            "both be writ",
        ),
        ([Job(input=a, output=a, options=TARGET)], "would be overwritten"),
        ([Job(input=str(meshes / "c.obj"), output="c.ply", options=TARGET)], "no such file: .*c.obj"),
        ([Job(input=a, output="x.docx", options=TARGET)], "expected a file name ending in"),
        ([Job(input=a, output="x.ply")], "give one of n_vertices"),
        ([Job(input=a, output="x.ply", options={**TARGET, "ratio": 0.5})], "give one of n_vertices"),
        ([Job(input=a, output="x.ply", options={"n_vertexes": 30})], "did you mean 'n_vertices'"),
        ([Job(input=a, output="x.ply", options={**TARGET, "sharpness": 0.5})], "a.obj: sharpness = 0.5"),
        ([Job(input=a, output="x.ply", options={"max_error": "1 mm"})], "a.obj: max_error 1 mm: expected a length"),
        ([Job(input=a, output="x.ply", options={**TARGET, "density": [1.0, 2.0]})], "expected the name of a text file"),
        ([Job(input=a, output="x.ply", options={**TARGET, "metric": [1, 2]})], "expected the name of a metric"),
        ([Job(input=a, output="x.ply", options={"metric_file": "no.npy"})], "no such file: .*no.npy"),
        ([Job(input=a, output="x.ply", options={"metric_file": a, "adapt_to": "u"})], "give one of them"),
        ([Job(input=a, output="x.ply", options={"adapt_to": "u", "edge_length": 1.0})], "ratio or ratios with it"),
        ([Job(input=a, output="x.ply", options={**TARGET, "min_size": 1.0})], "only sizes can be limited"),
        ([Job(input=a, output="x.ply", options={"metric_file": a, "gradation": -1.0})], "gradation = -1"),
        ([Job(input=a, output="x.ply", options={**TARGET, "norm": 2})], "norm goes with adapt_to"),
        (
            [Job(input=a, output="x.ply", options={**TARGET, "density": str(tmp_path / "no.txt")})],
            "no such file: .*no.tx",
        ),
    ]:
        with pytest.raises(OptionError, match=message):
            checked(wrong, str(tmp_path))


# --- options and keys


def test_options_have_one_form_and_none_that_is_as_by_default():
    given = {"ratio": "20%", "max_error": None, "seed": 0, "weld_tolerance": "0.5", "metric": "uniform", "fit": True}
    assert plain_options(given, "x") == {"ratio": 0.2, "weld_tolerance": 0.5, "metric": "uniform"}
    assert plain_options({"max_error": "0.1%"}, "x") == {"max_error": "0.1%"}
    assert plain_options({"ratio": 0.2, "weld_tolerance": "0"}, "x") == {"ratio": 0.2}
    with pytest.raises(OptionError, match="weld_tolerance -1%: expected a finite length of at least 0, or auto"):
        plain_options({"ratio": 0.2, "weld_tolerance": "-1%"}, "x")
    with pytest.raises(OptionError, match="not how small; give n_vertices, ratio or ratios with it"):
        plain_options({"adapt_to": "u"}, "x")
    with pytest.raises(OptionError, match="max_error 0: expected a positive finite length"):
        plain_options({"max_error": "0"}, "x")
    assert for_mesh({"max_error": "0.1%", "weld_tolerance": "auto"}, 20.0) == {
        "max_error": pytest.approx(0.02),
        "weld_tolerance": "auto",
    }


def test_tables_of_a_job_are_read(tmp_path):
    (tmp_path / "edges.txt").write_text("0 1\n1 2  # a crease\n")
    assert for_mesh({"features": str(tmp_path / "edges.txt")}, 1.0)["features"].tolist() == [[0, 1], [1, 2]]


def test_the_key_depends_on_all_that_the_result_does_and_nothing_else(meshes, tmp_path, monkeypatch):
    weights = tmp_path / "density.txt"
    weights.write_text("1\n" * 60)
    base = Job(input=str(meshes / "a.obj"), output="a.ply", options={**TARGET, "density": str(weights)})

    def key(job):
        return key_of(job, facts_of_files(job))

    first = key(base)
    copy = meshes / "copy.obj"
    copy.write_bytes((meshes / "a.obj").read_bytes())
    assert key(Job(input=str(copy), output="b/other.ply", options={**base.options, "threads": 7})) == first
    others = [
        Job(input=str(meshes / "b.obj"), output="a.ply", options=base.options),
        Job(input=base.input, output="a.stl", options=base.options),
        Job(input=base.input, output="a.ply", options={**base.options, "seed": 1}),
        Job(input=base.input, output="a.ply", options=TARGET),
    ]
    weights.write_text("2\n" * 60)
    changed = [key(base), *map(key, others)]
    monkeypatch.setattr("anisomesh.batch.keys.version", lambda name: "99")
    assert len({first, key(base), *changed}) == 2 + len(changed)


def test_the_key_depends_on_the_field_that_prescribes_the_metric_and_not_on_its_place(meshes, tmp_path):
    source, sizes, other = str(meshes / "a.obj"), tmp_path / "sizes.npy", tmp_path / "other.npy"

    def key(**options):
        (job,) = checked([Job(input=source, output="a.ply", options=options)], str(tmp_path))
        return key_of(job, facts_of_files(job))

    for values in ([1.0, 2.0], [1.0, 3.0]):
        np.save(sizes, values)
        other.write_bytes(sizes.read_bytes())
        assert key(metric_file=str(sizes)) == key(metric_file=str(other))
    different = [key(metric_file=str(sizes)), key(metric_file=f"{sizes}:x"), key(metric_file=str(sizes), max_size=2.0)]
    np.save(sizes, [1.0, 4.0])
    different += [key(metric_file=str(sizes)), key(n_vertices=9, adapt_to="u"), key(n_vertices=9, adapt_to="v")]
    assert len({*different, key(n_vertices=9, adapt_to=f"{sizes}:u")}) == 7


def test_a_file_with_the_stamp_of_before_is_not_read_again(meshes, monkeypatch):
    job = Job(input=str(meshes / "a.obj"), output="a.ply", options=TARGET)
    before = facts_of_files(job)
    monkeypatch.setattr("anisomesh.batch.keys.hash_of", lambda path: pytest.fail("it is read"))
    assert facts_of_files(job, before) == before


# --- manifests


def manifest(tmp_path, rows):
    """Write the same rows as JSON lines and as CSV."""
    (tmp_path / "jobs.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows) + "\n")
    text = io.StringIO()
    writer = csv.DictWriter(text, list(dict.fromkeys(name for row in rows for name in row)))
    writer.writeheader()
    writer.writerows(rows)
    (tmp_path / "jobs.csv").write_text("\ufeff" + text.getvalue(), encoding="utf-8")
    return tmp_path / "jobs.jsonl", tmp_path / "jobs.csv"


def test_both_kinds_of_manifest_say_the_same(meshes, tmp_path):
    rows = [
        {"input": "in/a.obj"},
        {"input": "in/b.obj", "output": "deep/b.ply", "ratio": 0.5, "fit": False, "sharpness": 3, "lock": "left, top"},
        {"input": "in/sub/a.obj", "max_error": "0.1%", "density": "w.txt"},
    ]
    (tmp_path / "w.txt").write_text("1\n" * 72)
    found = [
        checked(read_manifest(path, {**TARGET, "seed": 5}, output_format="ply"), "out")
        for path in manifest(tmp_path, rows)
    ]
    assert found[0] == found[1]
    assert [(job.output, job.options) for job in found[0]] == [
        ("in/a.ply", {"n_vertices": 30, "seed": 5}),
        ("deep/b.ply", {"ratio": 0.5, "seed": 5, "fit": False, "sharpness": 3, "lock": "left, top"}),
        ("in/sub/a.ply", {"max_error": "0.1%", "seed": 5, "density": str(tmp_path / "w.txt")}),
    ]
    assert {Path(job.input) for job in found[0]} == {Path(job.input) for job in jobs(meshes)}


def test_a_row_replaces_the_metric_of_the_command_and_names_files_beside_the_manifest(meshes, tmp_path):
    rows = [{"input": "in/a.obj", "metric_file": "m.sol:1"}, {"input": "in/b.obj", "adapt_to": "u", "norm": 4}]
    for path in manifest(tmp_path, rows):
        first, second = read_manifest(path, {**TARGET, "metric": "approximation"})
        assert first.options == {**TARGET, "metric_file": f"{tmp_path / 'm.sol'}:1"}
        assert second.options == {**TARGET, "adapt_to": "u", "norm": 4}


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.csv", "input,vertexes\na.obj,3\n", "line 1: unknown key 'vertexes'"),
        ("a.csv", "input,ratio\na.obj\n", "line 2: expected 2 columns"),
        ("a.csv", "output\na.ply\n", "line 2: input is missing"),
        ("a.csv", "input\n", "no rows; expected a row for each mesh"),
        ("a.jsonl", '{"input": "a.obj"}\n{"input": "b.ob', "line 2: not JSON"),
        ("a.jsonl", '["a.obj"]\n', "line 1: expected an object"),
        ("a.jsonl", '{"input": 3}\n', "line 1: input is missing"),
        ("a.txt", "a.obj\n", "ending in .jsonl or .csv"),
        ("a.csv", None, "no such file"),
    ],
)
def test_faults_of_manifests_are_named_with_their_line(tmp_path, name, text, message):
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(OptionError, match=message):
        read_manifest(tmp_path / name, TARGET)


def test_options_are_the_keywords_that_files_can_hold():
    assert {"n_vertices", "ratio", "max_error", "edge_length", "lock", "weld_tolerance", "seed"} <= set(OPTION_NAMES)
    assert not {"energy", "size_field"} & set(OPTION_NAMES)


# --- what is left


def test_only_what_is_left_is_done(meshes, tmp_path):
    record, out = Recorder(), tmp_path / "out"
    rows = record.run(jobs(meshes), out)
    assert record.seen == ["a.obj", "b.obj", "a.obj"]
    assert record.run(jobs(meshes), out) == rows
    assert record.seen == []
    (out / "b.obj").unlink()
    record.run(jobs(meshes), out)
    assert record.seen == ["b.obj"]
    (meshes / "a.obj").write_bytes((meshes / "a.obj").read_bytes())  # at another time, with the same content
    record.run(jobs(meshes), out)
    assert record.seen == []
    (meshes / "a.obj").write_bytes((meshes / "b.obj").read_bytes())
    record.run(jobs(meshes), out)
    assert record.seen == ["a.obj"]
    record.run(jobs(meshes, {"n_vertices": 31}), out)
    assert len(record.seen) == 3
    assert len((out / "results.jsonl").read_text().splitlines()) == 3


def test_failed_jobs_are_tried_again_and_end_nothing(meshes, tmp_path):
    record = Recorder(failing=["b.obj"])
    rows = record.run(jobs(meshes), tmp_path / "out")
    assert [row["status"] for row in rows] == ["done", "failed", "done"]
    assert rows[1]["error"] == "ValueError: no luck"
    record.failing = []
    rows = record.run(jobs(meshes), tmp_path / "out")
    assert record.seen == ["b.obj"]
    assert [row["status"] for row in rows] == 3 * ["done"]


def test_shards_share_the_work_and_a_later_batch_knows_it(meshes, tmp_path):
    record, seen = Recorder(), []
    for shard in (1, 2):
        rows = record.run(jobs(meshes), tmp_path / "out", Settings(workers=WorkerPool(count=0), shard=(shard, 2)))
        seen += [row["output"] for row in rows]
    assert sorted(seen) == ["a.obj", "b.obj", "sub/a.obj"]
    assert len(record.run(jobs(meshes), tmp_path / "out")) == 3
    assert record.seen == []
    with pytest.raises(OptionError, match="shard"):
        Settings(shard=(3, 2))


def test_a_row_that_was_cut_off_is_done_again_and_leftovers_go(meshes, tmp_path):
    record, out = Recorder(), tmp_path / "out"
    record.run(jobs(meshes), out)
    text = (out / "results.jsonl").read_text()
    (out / "results.jsonl").write_text(text[:-20])
    (out / "sub/.a.0123abcd.obj").write_text("half a mes")
    (out / "sub/.b.0123abcd.obj").write_text("of another output")
    record.run(jobs(meshes), out)
    assert record.seen == ["a.obj"]
    assert sorted(path.name for path in (out / "sub").iterdir()) == [".b.0123abcd.obj", "a.obj"]
    (out / "results.jsonl").write_text('{"output": "a.obj"}\n')
    with pytest.raises(AnisomeshError, match="line 1: not a row of a batch"):
        record.run(jobs(meshes), out)


def test_the_newest_row_of_an_output_counts(tmp_path):
    row = {"output": "a.ply", "key": None, "files": {}, "status": "done"}
    for shard, time in (((2, 2), "2"), ((1, 2), "1"), (None, "0")):
        Results(tmp_path, shard).append({**row, "finished": time, "seconds": float("nan")})
    assert Results(tmp_path).rows()["a.ply"] == {**row, "finished": "2", "seconds": None}


# --- the work itself


def test_refusals_errors_and_warnings_are_in_the_row(meshes, tmp_path, monkeypatch):
    (meshes / "empty.obj").write_text("v 0 0 0\n")

    def row(name, **options):
        return do(
            BatchTask(
                job=Job(input=str(meshes / name), output="x.off", options={**FAST, **options}),
                target=str(tmp_path / "x.off"),
            )
        )

    assert row("a.obj")["status"] == "done"
    assert load(tmp_path / "x.off").n_points == 30
    refused = row("empty.obj")
    assert refused["status"] == "refused"
    assert "empty.obj" in refused["error"]
    monkeypatch.setattr("anisomesh.pipeline.remesh", lambda *_, **__: {}["oops"])
    failed = row("a.obj")
    assert (failed["status"], failed["error"]) == ("failed", "KeyError: 'oops'")
    assert "Traceback" in failed["traceback"]
    with (meshes / "a.obj").open("a") as file:
        file.write("f 1 2\n")
    assert any("a.obj" in line for line in row("a.obj")["log"])


def test_a_job_follows_the_sizes_of_its_metric_file(meshes, tmp_path):
    n_points = load(meshes / "a.obj").n_points

    def row(**options):
        job = Job(input=str(meshes / "a.obj"), output="x.off", options={**FAST, "n_vertices": None, **options})
        (job,) = checked([job], str(tmp_path))
        return do(BatchTask(job=job, target=str(tmp_path / "x.off")))

    np.save(tmp_path / "sizes.npy", np.full(n_points, 0.4))
    file = str(tmp_path / "sizes.npy")
    counts = [row(metric_file=file, **more)["report"]["vertices"] for more in ({}, {"max_size": 0.3})]
    assert counts[1] > 1.3 * counts[0]
    np.save(tmp_path / "sizes.npy", np.full(n_points, -1.0))
    refused = row(metric_file=file)
    assert refused["status"] == "refused"
    assert "sizes.npy" in refused["error"]
    assert "no field 'u'" in row(adapt_to="u", n_vertices=30)["error"]


def test_levels_of_detail_are_one_job_that_is_done_if_all_its_files_are_there(meshes, tmp_path):
    options = {**FAST, "n_vertices": None, "ratios": "60% 0.3"}
    job, other = (Job(input=str(meshes / f"{name}.obj"), output=f"{name}.off", options=options) for name in "ab")
    (row,) = run([job], tmp_path / "out", settings=HERE)
    assert row["status"] == "done", row
    counts = [load(tmp_path / f"out/a.lod{k}.off").n_points for k in (0, 1)]
    assert counts == [level["vertices"] for level in row["report"]["levels"]]
    assert counts[0] == row["report"]["vertices"] > counts[1]
    assert run([job], tmp_path / "out", settings=HERE) == [row]
    (tmp_path / "out/a.lod1.off").unlink()
    assert run([job], tmp_path / "out", settings=HERE) != [row]
    assert (tmp_path / "out/a.lod1.off").exists()
    taken = Job(input=other.input, output="a.lod1.off", options=TARGET)
    with pytest.raises(OptionError, match=r"both be written to a\.lod1\.off"):
        checked([job, taken], str(tmp_path))
    with pytest.raises(OptionError, match="give one of"):
        checked([Job(input=job.input, output="a.off", options={**TARGET, "ratios": [0.5]})], str(tmp_path))


def test_in_this_process_errors_are_outcomes():
    outcomes = list(WorkerPool(count=0).run(Work(do=lambda task, attempt: 1 / task), [2, 0, 4]))
    assert outcomes == [Outcome(0, 0.5), Outcome(1, error="ZeroDivisionError: division by zero"), Outcome(2, 0.25)]


def test_workers_without_dask_are_refused_with_the_remedy(monkeypatch):
    monkeypatch.setattr("anisomesh.execution.engine.has_dask", lambda: False)
    assert WorkerPool().in_this_process
    assert WorkerPool(count=1).in_this_process
    for words in ({"count": 2}, {"scheduler": "tcp://host:8786"}):
        with pytest.raises(AnisomeshError, match=r"anisomesh\[batch\]"):
            WorkerPool(**words)


def test_addresses_are_read_and_written(meshes, tmp_path):
    fsspec = pytest.importorskip("fsspec")
    memory = fsspec.filesystem("memory")
    for name in ("a.obj", "sub/a.obj"):
        memory.pipe(f"/batch-in/{name}", (meshes / name).read_bytes())
    found = jobs_of(["memory://batch-in"], FAST, output_format="off")
    assert [job.output for job in found] == ["a.off", "sub/a.off"]
    assert [job.output for job in jobs_of(["memory://batch-in/*.obj"], FAST)] == ["a.obj"]
    settings = Settings(workers=WorkerPool(count=0), outputs="memory://batch-out/deep")
    rows = run(found, tmp_path, settings=settings)
    assert [row["status"] for row in rows] == 2 * ["done"]
    assert memory.cat("/batch-out/deep/sub/a.off").startswith(b"OFF\n30 ")
    assert run(found, tmp_path, settings=settings) == rows
    missing = run([Job(input="memory://batch-in/no.obj", output="no.ply", options=FAST)], tmp_path, settings=settings)
    assert missing[0]["status"] == "refused"


# --- reports


def test_the_page_needs_nothing_else_and_shows_every_job(meshes, tmp_path):
    Recorder(failing=["b.obj"]).run(jobs(meshes), tmp_path / "out")
    page = (tmp_path / "out/index.html").read_text()
    assert page.count("<tr>") == 1 + 3
    assert "ValueError: no luck" in page
    assert not re.search(r"""(src|href)=["'](https?:)?//""", page)
    assert 'href="sub/a.obj"' in page
    assert "2 done, 1 failed" in page


def test_the_parquet_file_has_the_figures(meshes, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    one = jobs(meshes, FAST)[:1]
    (row,) = run(one, tmp_path / "out", settings=HERE)
    (found,) = parquet.read_table(tmp_path / "out/results.parquet").to_pylist()
    assert found["output"] == "a.obj"
    assert found["report.vertices"] == row["report"]["vertices"] == 30
    assert found["report.validity.closed"] is True
    assert json.loads(found["options"]) == row["options"]


# --- the command


def test_command_does_what_is_left_and_says_if_some_failed(run_cli, meshes, tmp_path):
    words = ["batch", meshes, "-o", tmp_path / "out", *QUICK_WORDS]
    done = run_cli(*words)
    assert done.returncode == 0, done.stderr
    assert "3 done; 3 of them now" in done.stdout
    assert load(tmp_path / "out/sub/a.obj").n_points == 30
    (meshes / "bad.off").write_text("OFF\n1 1 0\n")
    again = run_cli(*words)
    assert again.returncode == 3
    assert "3 done, 1 refused; 1 of them now" in again.stdout
    assert "refused: bad.off:" in again.stderr
    assert run_cli(*words, "--quiet").stdout == ""


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["-n", 30], 2, "name meshes"),
        (["IN", "--workers", 0], 2, "give one of -n"),
        (["IN", "-n", 30, "--shard", "3/2"], 2, "--shard 3/2"),
        (["IN", "--max-error", "1mm"], 2, "expected a length"),
        (["IN", "-n", 30, "--output-format", "docx"], 2, "docx"),
        (["IN", "-n", 30, "--ratio", 0.5], 2, "-n and --ratio are given; give one of -n"),
        (["IN/no.obj", "-n", 30], 1, "no such file"),
    ],
)
def test_wrong_words_are_one_line(run_cli, meshes, tmp_path, words, code, message):
    given = [str(word).replace("IN", str(meshes)) for word in words]
    done = run_cli("batch", *given, "-o", tmp_path / "out")
    assert (done.returncode, done.stdout) == (code, "")
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_has_dask_tells_whether_it_can_be_imported():
    try:
        import distributed  # noqa: F401
    except ImportError:
        assert not has_dask()
    else:
        assert has_dask()
