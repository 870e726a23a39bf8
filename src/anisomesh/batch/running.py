"""A batch: jobs that are not done yet go to workers, and a row of each is kept."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from operator import attrgetter
from pathlib import Path

from anisomesh.batch.folder_lock import locked_folder
from anisomesh.batch.jobs import Job, checked
from anisomesh.batch.places import absolute, is_address, joined
from anisomesh.batch.reports import PAGE, write_page, write_parquet
from anisomesh.batch.rows import Results, Row, is_done, picture_of
from anisomesh.batch.work import BatchTask, do, prepare_process
from anisomesh.errors import OptionError
from anisomesh.execution.engine import Outcome, Work, WorkerPool
from anisomesh.io.atomic import remove_leftovers

REMESHING = Work(do=do, prepare=prepare_process, limit=attrgetter("limit"))
"""What workers do with the tasks of a batch."""

_LIMIT_FACTOR = 2.0  # of the time limit of a job, beside the margin; heuristic


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a batch is run.

    Attributes
    ----------
    workers
        What runs the jobs.
    shard
        ``(i, n)``: do only every n-th job, from the i-th of them, counted from 1. Others do the rest, elsewhere, with
        the same folder of results or another.
    outputs
        Folder, or address of one, that outputs are relative to; by default the folder of the results.
    thumbnails
        Whether a small picture of each result is drawn (extra: picture).
    margin
        A job with a time limit whose worker is still at it after twice the limit and this many seconds is taken to
        hang, and its worker is ended; the limit alone ends the optimisation, not what makes the mesh valid.
    """

    workers: WorkerPool = field(default_factory=WorkerPool)
    shard: tuple[int, int] | None = None
    outputs: str | None = None
    thumbnails: bool = False
    margin: float = 60.0

    def __post_init__(self) -> None:
        if self.shard is not None and not 1 <= self.shard[0] <= self.shard[1]:
            raise OptionError(f"shard = {self.shard}; expected (i, n) with i from 1 to n")


@dataclass(frozen=True)
class Progress:
    """A job that has ended: its row, how many have, how many are to be done, and the estimated seconds left."""

    row: Row
    number: int
    total: int
    seconds_left: float


class Batch:
    """Jobs that were checked, and what is left of them.

    Parameters
    ----------
    jobs
        The jobs.
    folder
        Folder of the results: ``results.jsonl`` with a row for each output, added when its job ends, so that a stopped
        batch is gone on with by the same call. Outputs are relative to it, unless the settings say otherwise.
    settings
        How they are run; by default on all cores of this machine.

    Attributes
    ----------
    jobs, left
        The jobs of this shard, and the ones that are not done. A job is done if its row says so, its output is there,
        and neither the content of its files nor its options nor the version changed since.
    results
        The rows.

    Raises
    ------
    OptionError
        See :func:`~anisomesh.batch.jobs.checked`.
    AnisomeshError
        If a row of an earlier call cannot be read, or another batch is at work in the folder, see
        :func:`~anisomesh.batch.folder_lock.locked_folder`.

    Notes
    -----
    A batch has its folder for itself, beside other shards, from here to the end of :meth:`run`.
    """

    def __init__(self, jobs: Sequence[Job], folder: str | Path, settings: Settings | None = None) -> None:
        self.settings = settings or Settings()
        self.folder = Path(folder).absolute()
        self._outputs = str(self.folder) if self.settings.outputs is None else absolute(self.settings.outputs)
        first, step = self.settings.shard or (1, 1)
        self.jobs = checked(jobs, self._outputs)[first - 1 :: step]
        with ExitStack() as held:
            held.enter_context(locked_folder(self.folder, self.settings.shard))
            self.results = Results(self.folder, self.settings.shard)
            self._rows = self.results.rows()
            self.left = [job for job in self.jobs if not is_done(job, self._rows.get(job.output), self._outputs)]
            self._held = held.pop_all()

    def run(
        self,
        on_row: Callable[[Progress], None] = lambda progress: None,
        work: Work = REMESHING,
    ) -> list[Row]:
        """Do what is left, write the reports, and return the rows of all jobs of this shard, in their order.

        Parameters
        ----------
        on_row
            Called with every job that ends.
        work
            What is done with a :class:`~anisomesh.batch.work.BatchTask`, in place of a remesh, with the results of
            :func:`~anisomesh.batch.work.do`.

        Returns
        -------
        rows
            With the keys ``input``, ``output``, ``outputs`` (the meshes that were written, several for levels of
            detail), ``key``, ``status`` (``done``; ``refused`` if anisomesh said in ``error`` why it cannot be done;
            ``failed`` for other errors, and if the worker ended in each of three tries), ``seconds``, ``tries``,
            ``options``, ``version``, ``finished``, ``report`` as of :meth:`~anisomesh.result.RemeshResult.report`, with
            one of each of the ``levels`` if there are any, and ``log``, what readers and writers warned of.

        Raises
        ------
        AnisomeshError
            If the cluster is lost.
        """
        with self._held:
            self._do_what_is_left(on_row, work)
        return [self._rows[job.output] for job in self.jobs]

    def _do_what_is_left(self, on_row: Callable[[Progress], None], work: Work) -> None:
        """Hand the jobs that are left to the workers, keep their rows, and write the reports."""
        tasks = [self._task(job) for job in self.left]
        self.results.forget([job.output for job in self.left])
        targets = [joined(self._outputs, name) for job in self.left for name in job.outputs]
        remove_leftovers(Path(target) for target in targets if not is_address(target))
        for job in self.left:
            picture_of(self.folder, job.output).unlink(missing_ok=True)
        if tasks:
            with closing(self.settings.workers.run(work, tasks)) as outcomes:
                self._keep(outcomes, on_row)
        if tasks or not (self.folder / PAGE).exists():
            rows = list(self.results.rows().values())
            write_page(rows, self.folder, self._outputs)
            write_parquet(rows, self.folder)

    def _keep(self, outcomes: Iterator[Outcome], on_row: Callable[[Progress], None]) -> None:
        """Add a row for every outcome, and tell of it."""
        start, total = time.monotonic(), len(self.left)
        for count, outcome in enumerate(outcomes, 1):
            job = self.left[outcome.number]
            self._rows[job.output] = row = self.results.append(_row(job, outcome))
            if count == 1:  # what came before was the start of the workers
                start = time.monotonic() - (row["seconds"] or 0.0)
            on_row(Progress(row, count, total, (time.monotonic() - start) / count * (total - count)))

    def _task(self, job: Job) -> BatchTask:
        limit = job.options.get("time_limit")
        return BatchTask(
            job=job,
            target=joined(self._outputs, job.output),
            picture=picture_of(self.folder, job.output) if self.settings.thumbnails else None,
            limit=None if limit is None else _LIMIT_FACTOR * limit + self.settings.margin,
        )


def run(
    jobs: Sequence[Job],
    folder: str | Path,
    *,
    settings: Settings | None = None,
    on_row: Callable[[Progress], None] = lambda progress: None,
) -> list[Row]:
    """Do the jobs of a batch that are not done yet, write the reports, and return the rows of all.

    Parameters
    ----------
    jobs, folder, settings
        As of :class:`Batch`.
    on_row
        Called with every job that ends.

    Returns
    -------
    rows
        As of :meth:`Batch.run`.

    Raises
    ------
    OptionError, AnisomeshError
        As of :class:`Batch` and :meth:`Batch.run`.

    Notes
    -----
    Processes are spawned, so a script that calls this needs ``if __name__ == "__main__"``.
    """
    return Batch(jobs, folder, settings).run(on_row)


def _row(job: Job, outcome: Outcome) -> Row:
    known = {"input": job.input, "output": job.output, "options": job.options, "version": version("anisomesh")}
    lost: Row = {"status": "failed", "error": outcome.error, "key": None, "files": {}, "seconds": None}
    finished = datetime.now(UTC).isoformat(timespec="milliseconds")
    result = outcome.result or lost
    known["outputs"] = job.outputs if result["status"] == "done" else []
    return {**known, **result, "tries": outcome.tries, "finished": finished}
