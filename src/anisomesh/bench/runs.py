"""Running a suite: one row per run in a JSON-lines file, from which a later call resumes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from pathlib import Path
from typing import Any

from anisomesh.bench.disturb import CLEAN, disturbed
from anisomesh.bench.inputs import Input, inputs_of
from anisomesh.bench.methods import METHODS, MethodResult
from anisomesh.bench.suite import Suite, SuiteMethod
from anisomesh.bench.training import train_networks
from anisomesh.errors import AnisomeshError
from anisomesh.evaluation.report import evaluate
from anisomesh.execution.engine import Work, WorkerPool
from anisomesh.io.results.json_lines import append_line, as_line, drop_cut_line, not_a_row
from anisomesh.io.results.json_lines import read_rows as read_lines
from anisomesh.mesh.surface import Surface
from anisomesh.options import MIN_VERTICES
from anisomesh.repair.prepare import prepare

RunRow = dict[str, Any]
ROW_KEY = ("mesh", "input", "ratio", "method", "seed")
_ROW = "row of a benchmark"


@dataclass(frozen=True)
class SuiteProgress:
    """A finished run: its row, its number among all runs, and the estimated seconds left."""

    row: RunRow
    number: int
    total: int
    seconds_left: float


def run_suite(
    suite: Suite,
    out: Path,
    *,
    data: Path | None = None,
    items: Path | None = None,
    workers: WorkerPool | None = None,
    on_step: Callable[[SuiteProgress | str], None] = lambda step: None,
) -> list[RunRow]:
    """Run all runs of a suite that a file of rows lacks, and return all rows.

    Parameters
    ----------
    suite
        The suite.
    out
        The file of rows, one JSON object per line; created if missing. A row is written in full at the end of its run,
        so a killed call loses at most one run.
    data
        Folder of the mesh files of the suite.
    items
        Data set for suites that train networks. The networks are written beside the rows.
    workers
        What does the runs; by default this process. A library that crashes ends a worker, and its run with it; several
        workers make each other slower.
    on_step
        Called after every run, and with a line of text after every epoch of a training.

    Returns
    -------
    rows
        With the keys ``mesh, input, ratio, method, seed``; ``options`` of the method; ``status`` (``done``,
        ``skipped``, ``failed`` with ``error``, or ``absent`` if a package of the method is missing); the requested
        number of vertices ``asked``, wall-clock ``seconds``, the ``facts`` of the method and the ``evaluation``. Only
        absent runs and runs with other options are repeated.

    Raises
    ------
    OptionError
        If a mesh of the suite cannot be found, or there are networks to train and no data set.

    Notes
    -----
    Workers are spawned, so a script that has some needs ``if __name__ == "__main__"``.
    """
    inputs = inputs_of(suite, data)
    drop_cut_line(out)
    known = {_key(row): row for row in read_rows(out)}
    jobs = [job for job in _jobs(suite, inputs) if not _is_done(known.get(job.key), job)]
    weights = train_networks(suite, out.with_suffix(""), items, on_step) if jobs else {}
    tasks = [_RunTask(job, suite, weights.get(job.method.name)) for job in jobs]
    start = time.monotonic()
    with closing((workers or WorkerPool(count=0)).run(_WORK, tasks)) as outcomes:
        for number, outcome in enumerate(outcomes, 1):
            job = jobs[outcome.number]
            row = outcome.result or {**job.start, "status": "failed", "error": outcome.error}
            if row["status"] != "absent":
                append_line(out, as_line(row))
            known[job.key] = row
            left = (time.monotonic() - start) / number * (len(jobs) - number)
            on_step(SuiteProgress(row, number, len(jobs), left))
    return [known[job.key] for job in _jobs(suite, inputs)]


def read_rows(path: Path) -> list[RunRow]:
    """Return the rows of a file, none if it does not exist.

    Rows of earlier versions are read too: without an input they are of the clean mesh, and their ``flipped`` triangles
    are the ``inverted`` ones.

    Raises
    ------
    AnisomeshError
        If a line is not a row.
    """
    rows = []
    for number, row in read_lines(path, _ROW):
        try:
            row.setdefault("input", CLEAN)
            _key(row)
        except (AttributeError, KeyError, TypeError) as error:
            raise not_a_row(path, number, _ROW) from error
        validity = row.get("evaluation", {}).get("validity", {})
        if "flipped" in validity:
            validity["inverted"] = validity.pop("flipped")
        rows.append(row)
    return rows


def select_rows(rows: Sequence[RunRow], input_name: str, ratio: float, method: str) -> list[RunRow]:
    """Return the rows of a method for an input at a ratio."""
    return [row for row in rows if (row["input"], row["ratio"], row["method"]) == (input_name, ratio, method)]


@dataclass(frozen=True)
class _Job:
    mesh: Input
    input_name: str
    ratio: float
    method: SuiteMethod
    seed: int

    @property
    def start(self) -> RunRow:
        """The part of the row that is known before the run."""
        names = {"mesh": self.mesh.name, "input": self.input_name, "ratio": self.ratio, "method": self.method.name}
        training = {} if self.method.training is None else {"training": self.method.training}
        options = {"method": self.method.method, **self.method.options, **training}
        return {**names, "seed": self.seed, "options": options}

    @property
    def key(self) -> tuple[Any, ...]:
        return _key(self.start)


@dataclass(frozen=True)
class _RunTask:
    """A job for a worker, and the weights of its network, None for none."""

    job: _Job
    suite: Suite
    weights: Path | None


@lru_cache(maxsize=1)
def _clean(mesh: Input) -> Surface:
    """Return a mesh after the repair; jobs that follow each other often have the same."""
    return prepare(mesh.make()).surface


@lru_cache(maxsize=1)
def _disturbed(mesh: Input, input_name: str) -> Surface:
    """Return the input of the methods that is made from a mesh."""
    return disturbed(_clean(mesh), input_name, mesh.name)


def _forget() -> None:
    """Forget the meshes of an earlier run: their files may have changed."""
    _clean.cache_clear()
    _disturbed.cache_clear()


def _jobs(suite: Suite, meshes: list[Input]) -> Iterator[_Job]:
    for mesh, input_name, ratio, method, seed in product(
        meshes, suite.inputs, suite.ratios, suite.methods, suite.seeds
    ):
        yield _Job(mesh, input_name, ratio, method, seed)


def _key(row: RunRow) -> tuple[Any, ...]:
    return tuple(row[key] for key in ROW_KEY)


def _is_done(row: RunRow | None, job: _Job) -> bool:
    return row is not None and row["options"] == job.start["options"]


def _do(task: _RunTask, attempt: int) -> RunRow:
    """Return the row of a run."""
    job, suite = task.job, task.suite
    remesher = METHODS[job.method.method]
    try:
        clean = _clean(job.mesh)
        if suite.closed and (clean.edge_face_count == 1).any():
            return {**job.start, "status": "skipped", "error": "the mesh is open"}
        if remesher.missing:
            return {**job.start, "status": "absent", "error": f"{', '.join(remesher.missing)} not installed"}
        given = _disturbed(job.mesh, job.input_name)
    except AnisomeshError as error:
        return {**job.start, "status": "failed", "error": str(error)}
    n = max(MIN_VERTICES, round(job.ratio * clean.n_points))
    start = time.perf_counter()
    try:
        options = job.method.options if task.weights is None else {**job.method.options, "weights": str(task.weights)}
        result: MethodResult = remesher.run(given, n, job.seed, options)
        seconds = time.perf_counter() - start
        evaluation = evaluate(clean, result.surface, samples=suite.samples).as_dict()
    except Exception as error:  # a failure of a library is a result of the benchmark
        return {**job.start, "status": "failed", "error": f"{type(error).__name__}: {error}", "asked": n}
    return {
        **job.start,
        "status": "done",
        "asked": n,
        "seconds": seconds,
        "facts": result.facts,
        "evaluation": evaluation,
    }


_WORK = Work(do=_do, prepare=_forget)
