"""Running a suite: one row a run in a JSON-lines file, which a later call goes on with."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from anisomesh.batch.inputs import Input, inputs_of
from anisomesh.batch.methods import METHODS, Produced
from anisomesh.batch.suite import Method, Suite
from anisomesh.errors import AnisomeshError
from anisomesh.evaluation.report import evaluate
from anisomesh.isolation import isolated
from anisomesh.surface.files import append_line, drop_cut_line
from anisomesh.surface.mesh import Surface
from anisomesh.surface.prepare import prepare

Row = dict[str, Any]
KEYS = ("mesh", "ratio", "method", "seed")


@dataclass(frozen=True)
class Progress:
    """What has just been done: its row, which of how many it was, and the seconds left if the rest is alike."""

    row: Row
    number: int
    total: int
    seconds_left: float


def run_suite(
    suite: Suite, out: Path, *, data: Path | None = None, on_row: Callable[[Progress], None] = lambda progress: None
) -> list[Row]:
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
    on_row
        Called after every run.

    Returns
    -------
    rows
        With the keys ``mesh, ratio, method, seed``; ``options`` of the method; ``status``, one of ``done``, ``failed``
        with ``error``, and ``absent`` where a package of the method is missing; ``asked`` vertices, wall ``seconds``,
        the ``facts`` of the method and the ``evaluation``. Failed runs are not tried again, absent ones are.

    Raises
    ------
    OptionError
        If a mesh of the suite cannot be found.
    """
    inputs = inputs_of(suite, data)
    drop_cut_line(out)
    known = {_key(row): row for row in read_rows(out)}
    jobs = [job for job in _jobs(suite, inputs) if not _is_done(known.get(job.key), job)]
    start = time.monotonic()
    loaded: tuple[str, Surface] | None = None
    for number, job in enumerate(jobs, 1):
        if loaded is None or loaded[0] != job.input.name:
            try:
                loaded = job.input.name, prepare(job.input.make()).surface
            except AnisomeshError as error:
                loaded = None
                row = {**job.start, "status": "failed", "error": str(error)}
        if loaded is not None:
            row = _run(job, loaded[1], suite)
        if row["status"] != "absent":
            append_line(out, json.dumps(row, default=_plain, allow_nan=False))
        known[job.key] = row
        left = (time.monotonic() - start) / number * (len(jobs) - number)
        on_row(Progress(row, number, len(jobs), left))
    return [known[job.key] for job in _jobs(suite, inputs)]


def read_rows(path: Path) -> list[Row]:
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


@dataclass(frozen=True)
class _Job:
    input: Input
    ratio: float
    method: Method
    seed: int

    @property
    def start(self) -> Row:
        """The part of the row that is known beforehand."""
        names = {"mesh": self.input.name, "ratio": self.ratio, "method": self.method.name, "seed": self.seed}
        return {**names, "options": {"method": self.method.method, **self.method.options}}

    @property
    def key(self) -> tuple[Any, ...]:
        return _key(self.start)


def _jobs(suite: Suite, inputs: list[Input]) -> Iterator[_Job]:
    for mesh in inputs:
        for ratio in suite.ratios:
            for method in suite.methods:
                for seed in suite.seeds:
                    yield _Job(mesh, ratio, method, seed)


def _key(row: Row) -> tuple[Any, ...]:
    return tuple(row[key] for key in KEYS)


def _is_done(row: Row | None, job: _Job) -> bool:
    return row is not None and row["options"] == job.start["options"]


def _run(job: _Job, surface: Surface, suite: Suite) -> Row:
    remesher = METHODS[job.method.method]
    if suite.closed and (surface.edge_face_count == 1).any():
        return {**job.start, "status": "skipped", "error": "the mesh is open"}
    if remesher.missing:
        return {**job.start, "status": "absent", "error": f"{', '.join(remesher.missing)} not installed"}
    n = max(4, round(job.ratio * surface.n_points))
    start = time.perf_counter()
    try:
        run = isolated(remesher.run) if remesher.isolated else remesher.run
        produced: Produced = run(surface, n, job.seed, job.method.options)
        seconds = time.perf_counter() - start
        evaluation = evaluate(surface, produced.surface, samples=suite.samples).as_dict()
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
