"""Regressions of batches: what lists of jobs say, by whatever means, and what is said of them."""

import json
import os
import signal
import sys
from pathlib import Path

import pytest

from anisomesh.batch import Job, Settings, WorkerPool
from anisomesh.batch.folder_lock import locked_folder
from anisomesh.batch.inputs import jobs_of
from anisomesh.batch.jobs import checked
from anisomesh.batch.manifest import read_manifest
from anisomesh.batch.options import plain_options
from anisomesh.batch.rows import Results
from anisomesh.batch.running import Batch
from anisomesh.cli.ending import ENDED_BY_SIGTERM, exit_at_sigterm
from anisomesh.cli.main import main
from anisomesh.errors import AnisomeshError, OptionError
from anisomesh.execution.engine import Work
from conftest import torus_arrays, write_obj

TARGET = {"n_vertices": 30}


@pytest.fixture
def folder(tmp_path):
    """A folder with a torus, in another."""
    write_obj(tmp_path / "a.obj", *torus_arrays(10, 6))
    return tmp_path


def batch(jobs, out, shard=None):
    return Batch(jobs, out, Settings(workers=WorkerPool(count=0), shard=shard))


def done(task, attempt):
    """Write something in place of a mesh."""
    for name in task.job.outputs:
        Path(task.target).with_name(name).write_text("a mesh")
    return {"status": "done", "key": None, "files": {}, "seconds": 0.1, "report": {"levels": [{"vertices": 4}]}}


def lines_of(path, *lines):
    path.write_text("".join(line + "\n" for line in lines))
    return path


# --- manifests


@pytest.mark.parametrize(
    ("name", "lines", "message"),
    [
        ("j.csv", ["input,n_vertices,n_vertices", "a.obj,60,70"], "line 1: n_vertices is given twice"),
        ("j.csv", ["input,n_vertices, n_vertices ", "a.obj,60,70"], "line 1: n_vertices is given twice"),
        ("j.jsonl", ['{"input": "a.obj", "n_vertices": 60, "n_vertices": 80}'], "line 1: n_vertices is given twice"),
        ("j.jsonl", ['{"input": "a.obj"}', '{"input": "a.obj", "input": "b.obj"}'], "line 2: input is given twice"),
        ("j.csv", ["input;n_vertices", "a.obj;60"], "line 1: the columns are separated by semicolons; expected commas"),
        ("j.csv", ["input\tn_vertices", "a.obj\t60"], "line 1: the columns are separated by tabs; expected commas"),
        ("j.csv", [",input", "0,a.obj"], "line 1: column 1 has no name"),
        ("j.csv", ["input,n_vertices", "a.obj,60,70"], "line 2: expected 2 columns, as in the heading; found 3"),
        ("j.jsonl", ['{"input": "a.obj", "seed": ' + "1" * 5000 + "}"], "line 1: not JSON"),
        ("j.jsonl", ["", " "], "no rows; expected a row for each mesh"),
    ],
)
def test_what_a_manifest_says_is_not_dropped(folder, name, lines, message):
    """Regression: of a column or key that is given twice one value was dropped."""
    with pytest.raises(OptionError, match=message):
        read_manifest(lines_of(folder / name, *lines), TARGET)


@pytest.mark.parametrize(
    ("name", "lines"),
    [("j.csv", ["input,n_vertices", "a.obj,1e400"]), ("j.jsonl", ['{"input": "a.obj", "n_vertices": 1e400}'])],
)
def test_a_number_too_large_is_repeated_as_it_is_written(folder, name, lines):
    """Regression: it was repeated as inf."""
    with pytest.raises(OptionError, match="n_vertices = '1e400'"):
        checked(read_manifest(lines_of(folder / name, *lines), {}), str(folder / "out"))


def test_a_manifest_in_another_encoding_is_said_in_plain_words(folder):
    """Regression: the message was the one of the decoder."""
    (folder / "j.csv").write_bytes("input,n_vertices\ngrün.obj,60\n".encode("latin-1"))
    with pytest.raises(OptionError) as error:
        read_manifest(folder / "j.csv", {})
    assert str(error.value) == f"{folder / 'j.csv'}: cannot be read as text in UTF-8; save it in UTF-8"


@pytest.mark.parametrize("name", ["n_vertices", "seed", "threads", "lloyd_iterations", "max_iterations"])
def test_whole_numbers_may_be_written_with_a_point(folder, name):
    """Regression: 60.0, as pandas writes a column with gaps, and 1e3 were refused."""
    base = {} if name == "n_vertices" else TARGET
    csv = lines_of(folder / "j.csv", f"input,{name} ", "a.obj,60.0")
    jsonl = lines_of(folder / "j.jsonl", f'{{"input": "a.obj", "{name}": 6e1}}')
    for path in (csv, jsonl):
        (job,) = checked(read_manifest(path, base), str(folder / "out"))
        assert job.options[name] == 60
        assert type(job.options[name]) is int
    for wrong in ("60.5", "inf", "nan"):
        jobs = read_manifest(lines_of(csv, f"input,{name}", f"a.obj,{wrong}"), base)
        with pytest.raises(OptionError, match=rf"line 2: {name} = {wrong}; expected a whole number"):
            checked(jobs, str(folder / "out"))


def test_labels_of_regions_are_whole_too():
    assert plain_options({**TARGET, "lock": [3.0, "lid"]}, "x")["lock"] == [3, "lid"]
    assert plain_options({**TARGET, "lock": 3.0}, "x")["lock"] == 3


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ({"n_vertices": "abc"}, "n_vertices = 'abc'; expected a whole number of at least 4$"),
        ({"n_vertices": "60"}, "n_vertices = '60'; expected .*, written without quotes$"),
        ({"n_vertices": 60, "ratio": 0.5}, "n_vertices and ratio are given; give one of n_vertices, ratio"),
        ({"ratio": "abc"}, "ratio abc: expected a share such as 0.2, or 20%$"),
        ({"ratios": "0.5 abc"}, "ratios abc: expected a share such as 0.2, or 20%$"),
        ({"keep_points": [1, 2]}, "keep_points is of type list; expected the name of a text file"),
        ({"density": ["a.txt"]}, "density is of type list; expected the name of a text file"),
        ({"adapt_to": 3}, "adapt_to is of type int; expected the name of a file or field"),
        ({"output": "a.xyz"}, "a.xyz: expected a file name ending in"),
    ],
)
def test_wrong_values_are_named_with_their_line(folder, row, message):
    """Regression: the job was named by its input, and lists were taken for names of files."""
    path = lines_of(folder / "j.jsonl", "", json.dumps({"input": "a.obj", **row}))
    with pytest.raises(OptionError, match=rf"j\.jsonl, line 2: {message}"):
        checked(read_manifest(path, TARGET), str(folder))


def test_missing_files_and_equal_outputs_are_named_with_their_lines(folder):
    for rows, message in [
        (["a.obj,x.ply", "b.obj,y.ply"], r"no such file: \S*b\.obj \(\S*j\.csv, line 3\)"),
        (
            ["a.obj,x.ply", "a.obj,./x.ply"],
            r"\(\S*, line 2\) and \S*a\.obj \(\S*, line 3\) would both be written to \./x\.ply",
        ),
        ([f"a.obj,{folder}/a.obj"], r"line 2\) is an input"),
    ]:
        jobs = read_manifest(lines_of(folder / "j.csv", "input,output", *rows), TARGET)
        with pytest.raises(OptionError, match=message):
            checked(jobs, str(folder / "out"))


def test_a_network_beside_the_manifest_is_found(folder):
    (folder / "net.safetensors").write_text("weights")
    path = lines_of(folder / "j.csv", "input,weights", "a.obj,net.safetensors", "a.obj,default")
    assert [job.options["weights"] for job in read_manifest(path, TARGET)] == [
        str(folder / "net.safetensors"),
        "default",
    ]


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["--manifest", "j.csv"], 1, "j.csv, line 2: n_vertices = 3; expected a whole number"),
        (["a.obj", "--ratios", "0.5", "-n", 9], 2, "-n and --ratios are given; give one of -n (number of vertices)"),
        (["--manifest", "j.csv", "--ratio", "0.5", "-n", 9], 2, "-n and --ratio are given"),
        (["a.obj", "-n", 9, "--norm", 2], 1, "error: norm goes with --adapt-to"),
        (["a.obj", "-n", 9, "--adapt-to", "u", "--metric-file", "m.sol"], 1, "error: --metric-file and --adapt-to say"),
    ],
)
def test_options_are_called_as_where_they_are_given(run_cli, folder, words, code, message):
    """Regression: a manifest's were called as on the command line, whose faults were of the job for the first file."""
    lines_of(folder / "j.csv", "input,n_vertices", "a.obj,3")
    done = run_cli("batch", *words, "-o", "out", cwd=folder)
    assert (done.returncode, done.stdout) == (code, "")
    assert message in done.stderr
    assert not (folder / "out").exists()


# --- names


def test_a_mesh_that_is_named_twice_is_one_job(folder, monkeypatch):
    """Regression: patterns that overlap by different paths would have written one file twice."""
    (folder / "sub").mkdir()
    write_obj(folder / "sub/b.obj", *torus_arrays(10, 6))
    monkeypatch.chdir(folder)
    for names, outputs in [
        (["a.obj", "sub/../a.obj", "./a.obj", str(folder / "a.obj"), "*.obj", "sub/../*.obj"], ["a.obj"]),
        (["sub", "sub/../sub/b.obj", "sub/../sub/*.obj"], ["b.obj"]),
        (["sub/..", "sub/../sub"], ["a.obj", "sub/b.obj"]),
    ]:
        assert [job.output for job in checked(jobs_of(names, TARGET), "out")] == outputs


def test_a_mesh_that_is_named_through_a_link_too_is_one_job_unless_its_output_is_another(folder):
    (folder / "in").mkdir()
    write_obj(folder / "in/b.obj", *torus_arrays(10, 6))
    (folder / "link").symlink_to(folder / "in")
    assert len(jobs_of([str(folder / "in"), str(folder / "link")], TARGET)) == 1
    pattern = jobs_of([f"{folder}/*n*/*.obj"], TARGET)
    assert sorted(job.output for job in pattern) == ["in/b.obj", "link/b.obj"]


def test_outputs_at_an_address_below_the_inputs_are_not_inputs(folder):
    """Regression: only outputs in a folder of this machine were left out, so a second batch remeshed the results."""
    memory = pytest.importorskip("fsspec").filesystem("memory")
    for name in ("a.obj", "small/a.obj", "smaller/a.obj"):
        memory.pipe(f"/below/{name}", (folder / "a.obj").read_bytes())
    for out in ("memory://below/small", "memory:///below/small/"):
        for name in ("memory://below", "memory://below/**/*.obj"):
            found = jobs_of([name], TARGET, without=out)
            assert [job.output for job in found] == ["a.obj", "smaller/a.obj"], (name, out)
    assert len(jobs_of(["memory://below"], TARGET, without=str(folder / "small"))) == 3
    assert len(jobs_of([str(folder)], TARGET, without="memory://below/small")) == 1


@pytest.mark.parametrize(
    "name", ["memory://signs/a?.obj", "memory://signs/a[12].obj", "memory:///signs/", "memory:///signs/*"]
)
def test_outputs_of_addresses_have_the_paths_below_what_was_named(folder, name):
    """Regression: of patterns with ? or [, and of other spellings of an address, a job would have written its input."""
    memory = pytest.importorskip("fsspec").filesystem("memory")
    for file in ("a1.obj", "a2.obj"):
        memory.pipe(f"/signs/{file}", (folder / "a.obj").read_bytes())
    found = jobs_of([name], TARGET)
    assert [(job.input, job.output) for job in found] == [(f"memory://signs/{k}", k) for k in ("a1.obj", "a2.obj")]


def test_links_that_lead_nowhere_are_refused_rows(folder):
    """Regression: they were left out without a word."""
    (folder / "lost.obj").symlink_to(folder / "gone.obj")
    for names in ([str(folder)], [f"{folder}/*.obj"]):
        _, row = batch(jobs_of(names, {**TARGET, "max_iterations": 1}), folder / "out").run(work=Work(do=one_row))
        assert (row["output"], row["status"], row["outputs"]) == ("lost.obj", "refused", [])
        assert row["error"] == f"{folder}/lost.obj: a link to {folder}/gone.obj: no such file"


def one_row(task, attempt):
    """Do the job of a link that leads nowhere only."""
    from anisomesh.batch.work import do

    return do(task) if Path(task.job.input).is_symlink() else done(task, attempt)


# --- rows


def test_rows_and_page_name_the_files_that_were_written(folder):
    """Regression: a row of levels of detail named a file that does not exist."""
    job = Job(input=str(folder / "a.obj"), output="a.ply", options={"ratios": [0.8, 0.4]})
    one = Job(input=str(folder / "a.obj"), output="b.ply", options=TARGET)
    levels, single = batch([job, one], folder / "out").run(work=Work(do=done))
    assert levels["outputs"] == ["a.lod0.ply", "a.lod1.ply"]
    assert single["outputs"] == ["b.ply"]
    page = (folder / "out/index.html").read_text()
    assert 'href="a.lod0.ply"' in page
    assert 'href="a.lod1.ply"' in page
    assert 'href="b.ply"' in page
    assert 'href="a.ply"' not in page
    refused = batch([job], folder / "no").run(work=Work(do=lambda task, attempt: 1 / 0))[0]
    assert (refused["status"], refused["outputs"]) == ("failed", [])


# --- several at once


@pytest.mark.skipif(os.name == "nt", reason="no locks")
def test_two_batches_at_once_in_one_folder_are_refused(folder):
    """Regression: both did every job, and wrote its row twice."""
    jobs, out = jobs_of([str(folder / "a.obj")], TARGET), folder / "out"

    def second(task, attempt):
        for shard in (None, (1, 2)):
            with pytest.raises(AnisomeshError, match="at work in this folder"):
                batch(jobs, out, shard)
        return done(task, attempt)

    assert batch(jobs, out).run(work=Work(do=second))[0]["status"] == "done"
    assert len((out / "results.jsonl").read_text().splitlines()) == 1
    assert batch(jobs, out).run(work=Work(do=done))[0]["status"] == "done"


@pytest.mark.skipif(os.name == "nt", reason="no locks")
def test_shards_share_a_folder_and_the_same_one_does_not_run_twice(folder):
    with locked_folder(folder, (1, 2)), locked_folder(folder, (2, 2)):
        for shard, who in ((None, "a batch, or a shard"), ((2, 2), "shard 2 of 2")):
            with pytest.raises(AnisomeshError, match=f"{who}.* at work in this folder"), locked_folder(folder, shard):
                pass
    with locked_folder(folder, None):
        pass


@pytest.mark.skipif(os.name == "nt", reason="no locks")
def test_shards_of_another_number_of_shards_do_not_share_a_folder(folder):
    """Regression: shard 1 of 3 began beside shards of 2, and did some of their jobs again."""
    for held, other in (((2, 2), (1, 3)), ((1, 3), (1, 2))):
        message = rf"shard {held[0]} of {held[1]} is at work.* shard {other[0]} of {other[1]}"
        with locked_folder(folder, held), pytest.raises(AnisomeshError, match=message), locked_folder(folder, other):
            pass
    with locked_folder(folder, (1, 2)):
        pass


@pytest.mark.skipif(os.name == "nt", reason="no locks")
def test_a_line_that_another_batch_is_writing_is_not_cut_off(folder):
    jobs, out = jobs_of([str(folder / "a.obj")], TARGET), folder / "out"
    first = batch(jobs, out)
    (out / "results.jsonl").write_text('{"half a li')
    with pytest.raises(AnisomeshError, match="at work"):
        batch(jobs, out)
    assert (out / "results.jsonl").read_text() == '{"half a li'
    del first  # a batch that is not run leaves the folder
    assert batch(jobs, out).results.path == Results(out).path


@pytest.mark.skipif(os.name == "nt", reason="no locks")
def test_file_systems_without_locks_are_said(folder, monkeypatch, caplog):
    def refuse(file, how):
        raise OSError(95, "not supported")

    monkeypatch.setattr("fcntl.flock", refuse)
    with locked_folder(folder, None):
        assert "its file system has no locks" in caplog.text


@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_sigterm_ends_a_batch_as_an_exit_which_ends_its_workers(run_cli, folder, monkeypatch):
    """Regression: the process ended alone, and what it shared with its workers was left for others to clean up."""
    ended, before = [], signal.getsignal(signal.SIGTERM)

    def batch_of(*_):
        try:
            os.kill(os.getpid(), signal.SIGTERM)
        finally:
            ended.append(True)

    monkeypatch.setattr("anisomesh.batch.running.Batch.run", batch_of)
    with exit_at_sigterm(), pytest.raises(SystemExit) as error:  # else a fault would end the tests
        run_cli("batch", "a.obj", "-n", 30, "-o", "out", "--workers", 0, "--no-thumbnails", cwd=folder)
    assert (error.value.code, ended) == (143, [True])
    assert signal.getsignal(signal.SIGTERM) is before


def test_a_command_that_sigterm_ends_says_so(monkeypatch, capsys):
    """Regression: nothing was on the terminal."""

    def terminated(*_, **__):
        sys.exit(ENDED_BY_SIGTERM)

    monkeypatch.setattr("anisomesh.cli.main.app", terminated)
    with pytest.raises(SystemExit):
        main(["batch"])
    assert capsys.readouterr().err == "anisomesh: ended by SIGTERM\n"
