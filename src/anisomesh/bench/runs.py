"""Running a suite: one row a run in a JSON-lines file, which a later call goes on with."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from anisomesh.bench.disturb import CLEAN, disturbed
from anisomesh.bench.inputs import Input, inputs_of
from anisomesh.bench.methods import METHODS, Produced
from anisomesh.bench.suite import Method, Suite
from anisomesh.bench.training import trained
from anisomesh.errors import AnisomeshError
from anisomesh.evaluation.report import evaluate
from anisomesh.io.atomic import append_line, drop_cut_line
from anisomesh.isolation import isolated
from anisomesh.mesh.surface import Surface
from anisomesh.repair.prepare import prepare

RunRow = dict[str, Any]
KEYS = ("mesh", "input", "ratio", "method", "seed")


@dataclass(frozen=True)
class SuiteProgress:
    """What has just been done: its row, which of how many it was, and the seconds left if the rest is alike."""

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
    on_row: Callable[[SuiteProgress], None] = lambda progress: None,
    on_epoch: Callable[[str], None] = lambda text: None,
) -> list[RunRow]:
    """Run what is not yet in a file of rows and return all rows of the suite.

    Parameters
    ----------
    suite
        What to run.
    out
        The file of rows, one JSON object a line; it is made if it is not there. A row is written in full as soon as its
        run has ended, so a call that was killed loses no more than one run.
    data
        The folder that the mesh patterns of the suite refer to.
    items
        The data set that networks are trained on, if the suite has some. They are written beside the rows.
    on_row
        Called after every run.
    on_epoch
        Called with a line of text after every epoch of a training.

    Returns
    -------
    rows
        With the keys ``mesh, input, ratio, method, seed``; ``options`` of the method; ``status``, one of ``done``,
        ``failed`` with ``error``, and ``absent`` where a package of the method is missing; ``asked`` vertices, wall
        ``seconds``, the ``facts`` of the method and the ``evaluation``. Failed runs are not tried again, absent ones
        are.

    Raises
    ------
    OptionError
        If a mesh of the suite cannot be found, or there are networks to train and no data set.
    """
    inputs = inputs_of(suite, data)
    drop_cut_line(out)
    known = {_key(row): row for row in read_rows(out)}
    jobs = [job for job in _jobs(suite, inputs) if not _is_done(known.get(job.key), job)]
    weights = trained(suite, out.with_suffix(""), items, on_epoch) if jobs else {}
    start = time.monotonic()
    loaded: _Loaded | None = None
    for number, job in enumerate(jobs, 1):
        try:
            loaded = _loaded(job, loaded)
            row = _run(job, loaded, suite, weights.get(job.method.name))
        except AnisomeshError as error:
            loaded = None
            row = {**job.start, "status": "failed", "error": str(error)}
        if row["status"] != "absent":
            append_line(out, json.dumps(row, default=_plain, allow_nan=False))
        known[job.key] = row
        left = (time.monotonic() - start) / number * (len(jobs) - number)
        on_row(SuiteProgress(row, number, len(jobs), left))
    return [known[job.key] for job in _jobs(suite, inputs)]


def read_rows(path: Path) -> list[RunRow]:
    """Return the rows of a file, none if it is not there.

    Raises
    ------
    AnisomeshError
        If a line is no row.
    """
    rows = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines() if path.exists() else [], 1):
        try:
            row = json.loads(line)
            _key(row)
        except (json.JSONDecodeError, KeyError, TypeError) as error:
            raise AnisomeshError(f"{path}, line {number}: this is no row of a benchmark; move the file away") from error
        rows.append(row)
    return rows


def chosen(rows: Sequence[RunRow], given: str, ratio: float, method: str) -> list[RunRow]:
    """Return the rows of a method for an input at a ratio."""
    return [row for row in rows if (row.get("input", CLEAN), row["ratio"], row["method"]) == (given, ratio, method)]


@dataclass(frozen=True)
class _Job:
    mesh: Input
    given: str
    ratio: float
    method: Method
    seed: int

    @property
    def start(self) -> RunRow:
        """The part of the row that is known beforehand."""
        names = {"mesh": self.mesh.name, "input": self.given, "ratio": self.ratio, "method": self.method.name}
        training = {} if self.method.training is None else {"training": self.method.training}
        options = {"method": self.method.method, **self.method.options, **training}
        return {**names, "seed": self.seed, "options": options}

    @property
    def key(self) -> tuple[Any, ...]:
        return _key(self.start)


@dataclass(frozen=True)
class _Loaded:
    """A mesh and what is made of it for the methods."""

    name: str
    clean: Surface
    given: str
    input: Surface


def _loaded(job: _Job, before: _Loaded | None) -> _Loaded:
    """Return the mesh of a job and its input, those from before where they are the same."""
    same = before is not None and before.name == job.mesh.name
    if before is not None and same and before.given == job.given:
        return before
    clean = before.clean if before is not None and same else prepare(job.mesh.make()).surface
    return _Loaded(job.mesh.name, clean, job.given, disturbed(clean, job.given, job.mesh.name))


def _jobs(suite: Suite, meshes: list[Input]) -> Iterator[_Job]:
    for mesh, given, ratio, method, seed in product(meshes, suite.inputs, suite.ratios, suite.methods, suite.seeds):
        yield _Job(mesh, given, ratio, method, seed)


def _key(row: RunRow) -> tuple[Any, ...]:
    return tuple(row.get(key, CLEAN) if key == "input" else row[key] for key in KEYS)  # older rows have no input


def _is_done(row: RunRow | None, job: _Job) -> bool:
    return row is not None and row["options"] == job.start["options"]


def _run(job: _Job, loaded: _Loaded, suite: Suite, weights: Path | None) -> RunRow:
    remesher = METHODS[job.method.method]
    if suite.closed and (loaded.clean.edge_face_count == 1).any():
        return {**job.start, "status": "skipped", "error": "the mesh is open"}
    if remesher.missing:
        return {**job.start, "status": "absent", "error": f"{', '.join(remesher.missing)} not installed"}
    n = max(4, round(job.ratio * loaded.clean.n_points))
    start = time.perf_counter()
    try:
        run = isolated(remesher.run) if remesher.isolated else remesher.run
        options = job.method.options if weights is None else {**job.method.options, "weights": str(weights)}
        produced: Produced = run(loaded.input, n, job.seed, options)
        seconds = time.perf_counter() - start
        evaluation = evaluate(loaded.clean, produced.surface, samples=suite.samples).as_dict()
    except Exception as error:  # whatever a library does wrong is its result here
        return {**job.start, "status": "failed", "error": f"{type(error).__name__}: {error}", "asked": n}
    return {
        **job.start,
        "status": "done",
        "asked": n,
        "seconds": seconds,
        "facts": produced.facts,
        "evaluation": evaluation,
    }


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} has no JSON form")
