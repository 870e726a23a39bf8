"""Engines: what runs many tasks and yields what became of them, in the order in which they end."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from anisomesh.errors import AnisomeshError, OptionError

MAX_TRIES = 3
"""How often a task is begun whose worker ends."""


def _nothing() -> None:
    pass


def _no_limit(task: Any) -> None:
    pass


@dataclass(frozen=True, kw_only=True)
class Work:
    """What workers do; module-level functions, which they import.

    Attributes
    ----------
    do
        A function of a task and the number of its try, from 1. An exception that it raises is an error of this task.
    prepare
        Called once in every process before its first task, without a limit on the time.
    limit
        A function of a task: seconds after which its worker is ended, and with it this try; None for no limit. Not in
        this process.
    """

    do: Callable[[Any, int], Any]
    prepare: Callable[[], None] = _nothing
    limit: Callable[[Any], float | None] = _no_limit


@dataclass(frozen=True)
class Outcome:
    """What became of a task: its number, its result or the error that there is instead, and how often it was begun."""

    number: int
    result: Any = None
    error: str | None = None
    tries: int = 1


@dataclass(frozen=True, kw_only=True)
class WorkerPool:
    """What runs the tasks.

    Attributes
    ----------
    count
        Worker processes on this machine, one thread each; 0 for this process; None for one per core, or this process if
        Dask is not installed.
    scheduler
        Address of the scheduler of a running Dask cluster, such as ``tcp://10.0.0.1:8786``, in place of processes.
    """

    count: int | None = None
    scheduler: str | None = None

    def __post_init__(self) -> None:
        if self.count is not None and not (isinstance(self.count, int) and self.count >= 0):
            raise OptionError(f"workers = {self.count!r}; expected a whole number of at least 0")
        if self.scheduler is not None and self.count is not None:
            raise OptionError("a running cluster has workers of its own; leave out workers, or the scheduler")
        if not has_dask() and (self.scheduler is not None or (self.count or 0) > 1):
            raise AnisomeshError(
                "several workers need Dask, which is not installed; "
                'run: pip install "anisomesh[batch]", or leave out workers and scheduler'
            )

    @property
    def in_this_process(self) -> bool:
        """Whether tasks run in this process, one after the other."""
        return self.scheduler is None and (self.count == 0 or not has_dask())

    def run(self, work: Work, tasks: Sequence[Any]) -> Generator[Outcome]:
        """Yield the outcomes of tasks, begun in this order, as they end; closing the iterator ends local workers."""
        if not tasks:
            return
        if self.in_this_process:
            yield from _one_after_the_other(work, tasks)
            return
        from anisomesh.execution.cluster import run_on_cluster

        yield from run_on_cluster(work, tasks, count=self.count, scheduler=self.scheduler)


def has_dask() -> bool:
    """Return whether Dask distributed is installed."""
    return importlib.util.find_spec("distributed") is not None


def usable_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _one_after_the_other(work: Work, tasks: Sequence[Any]) -> Iterator[Outcome]:
    work.prepare()
    for number, task in enumerate(tasks):
        try:
            outcome = Outcome(number, work.do(task, 1))
        except Exception as error:  # the other tasks are not to blame
            outcome = Outcome(number, error=f"{type(error).__name__}: {error}")
        yield outcome
