"""Tasks on a Dask cluster: one at a time on each worker, begun anew elsewhere if a worker ends."""

from __future__ import annotations

import faulthandler
import logging
import os
import queue
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from anisomesh.errors import AnisomeshError
from anisomesh.execution.engine import MAX_TRIES, Outcome, Work, usable_cores

logger = logging.getLogger(__name__)

_SECONDS_BETWEEN_LOOKS = 1.0  # at which workers there are; heuristic
_SECONDS_BETWEEN_FIRST_LOOKS = 0.1  # while there is none; heuristic
_SECONDS_WITHOUT_WORKERS = 300.0  # until a batch on a cluster gives up, time for a queue to start others; heuristic
_SECONDS_TO_CONNECT = 30.0
_MAX_LOST_STARTS = 3  # of processes, one after the other, that end before they can begin a task; heuristic
_LOCAL_CONFIG = {
    "distributed.scheduler.allowed-failures": 0,  # tries are counted here
    "distributed.worker.memory.target": False,  # results are small, nothing is worth to be spilled
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,  # a paused worker would keep its task forever
    "distributed.worker.memory.terminate": 0.95,
    "distributed.worker.preload": ["anisomesh.execution.worker"],
    "distributed.deploy.lost-worker-timeout": "1 day",  # it would end parents whose processes start slowly
    "distributed.comm.timeouts.connect": _SECONDS_TO_CONNECT,
}


@dataclass(eq=False)
class _Try:
    """A task on a worker: its number among all, which try it is, the limit on its seconds, and where it is."""

    number: int
    attempt: int
    limit: float | None
    worker: str
    future: Any


def run_on_cluster(
    work: Work, tasks: Sequence[Any], *, count: int | None = None, scheduler: str | None = None
) -> Iterator[Outcome]:
    """Yield the outcomes of tasks as they end, on processes of this machine or on a running cluster.

    Parameters
    ----------
    work, tasks
        What is done with each of the tasks.
    count
        Number of processes on this machine, by default one per core.
    scheduler
        Address of the scheduler of a running cluster, in place of processes.

    Raises
    ------
    AnisomeshError
        If the cluster cannot be reached, or has no workers for a while.

    Notes
    -----
    Each task is sent to one worker and runs there alone, however many threads the worker has: a worker that ends takes
    one task with it. Workers of this machine end with this process, however it ends.
    """
    with _cluster(scheduler, min(count or usable_cores(), len(tasks))) as (client, known):
        yield from _Dispatcher(client, work, known).outcomes(tasks)


class _Dispatcher:
    """Gives tasks to the workers of a client that are free; with ``known``, only to the ones that it returns."""

    def __init__(self, client: Any, work: Work, known: Callable[[], set[str]] | None) -> None:
        self._client = client
        self._work = work
        self._known = known
        self._ended: queue.SimpleQueue[_Try] = queue.SimpleQueue()
        self._running: dict[int, _Try] = {}
        self._workers: set[str] = set()
        self._looked = self._seen = time.monotonic()

    def outcomes(self, tasks: Sequence[Any]) -> Iterator[Outcome]:
        """Yield the outcome of every task as it ends."""
        waiting = deque((number, 1) for number in range(len(tasks)))
        self._look()
        try:
            while waiting or self._running:
                for worker in sorted(self._workers - {each.worker for each in self._running.values()}):
                    if waiting:
                        number, attempt = waiting.popleft()
                        self._begin(number, tasks[number], attempt, worker)
                for each in self._ended_tries():
                    outcome = self._outcome(each)
                    if outcome is None:
                        waiting.appendleft((each.number, each.attempt + 1))
                    else:
                        yield outcome
        finally:
            self._client.cancel([each.future for each in self._running.values()], force=True)

    def _begin(self, number: int, task: Any, attempt: int, worker: str) -> None:
        future = self._client.submit(
            _guarded, self._work, task, attempt, workers=[worker], pure=False, retries=0, allow_other_workers=False
        )
        self._running[number] = each = _Try(number, attempt, self._work.limit(task), worker, future)
        future.add_done_callback(lambda _: self._ended.put(each))

    def _ended_tries(self) -> Iterator[_Try]:
        """Yield tries that have ended, or whose worker has, after at most a second."""
        found: list[_Try] = []
        pause = _SECONDS_BETWEEN_LOOKS if self._workers else _SECONDS_BETWEEN_FIRST_LOOKS
        with suppress(queue.Empty):
            found.append(self._ended.get(timeout=pause))
            while True:
                found.append(self._ended.get_nowait())
        found = [each for each in found if self._running.get(each.number) is each]
        if time.monotonic() - self._looked >= pause or any(map(_worker_ended, found)):
            self._look()
        found += [each for each in self._running.values() if each.worker not in self._workers and each not in found]
        for each in found:
            del self._running[each.number]
        yield from found

    def _look(self) -> None:
        """Learn which workers there are."""
        from distributed.comm import CommClosedError

        try:
            self._workers = set(self._client.nthreads())
        except (OSError, CommClosedError, ValueError) as error:
            raise AnisomeshError(f"the scheduler of the cluster cannot be reached: {error}; start it again") from error
        if self._known is not None:
            self._workers &= self._known()
        self._looked = time.monotonic()
        if self._workers:
            self._seen = self._looked
        elif self._looked - self._seen > _SECONDS_WITHOUT_WORKERS:
            raise AnisomeshError(f"the cluster has had no worker for {_SECONDS_WITHOUT_WORKERS:g} s; start some")

    def _outcome(self, each: _Try) -> Outcome | None:
        """Return what became of a try, None if the task is to be tried again."""
        if each.future.status == "finished":
            try:
                return Outcome(each.number, each.future.result(timeout=_SECONDS_TO_CONNECT), tries=each.attempt)
            except Exception as loss:  # the worker ended before the result was fetched
                logger.info("the result of task %d was lost: %r", each.number, loss)
        error = each.future.exception() if each.future.status == "error" else None
        if error is not None and not isinstance(error, _killed()):
            return Outcome(each.number, error=f"{type(error).__name__}: {error}", tries=each.attempt)
        each.future.cancel()
        each.attempt += getattr(error, "allowed_failures", 0)  # a running cluster may have tried again by itself
        if each.attempt < MAX_TRIES:
            return None
        late = "" if each.limit is None else f", or took longer than {each.limit:g} s"
        reason = f"its worker ended in each of {each.attempt} tries: it crashed, ran out of memory, was killed{late}"
        return Outcome(each.number, error=reason, tries=each.attempt)


def _worker_ended(each: _Try) -> bool:
    """Return whether a try ended because its worker did."""
    status = each.future.status
    return status in ("lost", "cancelled") or (status == "error" and isinstance(each.future.exception(), _killed()))


def _killed() -> type[Exception]:
    from distributed.scheduler import KilledWorker

    found: type[Exception] = KilledWorker
    return found


def _guarded(work: Work, task: Any, attempt: int) -> Any:
    """Do the work of a task in a worker; end the process if it takes longer than the limit."""
    _prepared(work.prepare)
    limit = work.limit(task)
    if limit is None:
        return work.do(task, attempt)
    with Path(os.devnull).open("w") as nowhere:  # the watchdog is a thread of C code that needs no interpreter
        faulthandler.dump_traceback_later(limit, exit=True, file=nowhere)
        try:
            return work.do(task, attempt)
        finally:
            faulthandler.cancel_dump_traceback_later()


@cache
def _prepared(prepare: Callable[[], None]) -> None:
    prepare()


@contextmanager
def _cluster(scheduler: str | None, count: int) -> Iterator[tuple[Any, Callable[[], set[str]] | None]]:
    """Yield a client of a running cluster, or of one on this machine, which ends with the block.

    Beside it, on this machine, a function that returns the workers whose parents know that they have started: one that
    ended before would not be started again.
    """
    import dask
    from distributed import Client, LocalCluster, system

    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=_SECONDS_TO_CONNECT)
        except (OSError, ValueError) as error:
            raise AnisomeshError(
                f"no scheduler answers at {scheduler}: {error}; start one with dask scheduler"
            ) from error
        with client:
            yield client, None
        return
    how = {"threads_per_worker": 1, "dashboard_address": "127.0.0.1:0", "silence_logs": logging.CRITICAL}
    with (
        dask.config.set(_LOCAL_CONFIG),
        LocalCluster(n_workers=0, processes=True, memory_limit=system.MEMORY_LIMIT // count, **how) as cluster,
        Client(cluster) as client,
        closing(_LocalWorkers(cluster, count)) as workers,
    ):
        yield client, workers.started


class _LocalWorkers:
    """The processes of a cluster on this machine, each with a parent (nanny) that starts it, and again if it ends."""

    def __init__(self, cluster: Any, count: int) -> None:
        self._cluster = cluster
        self._count = count
        self._known: set[str] = set()
        self._lost = 0  # starts that have failed since the last that did not
        cluster.scale(count)

    def started(self) -> set[str]:
        """Return the addresses of workers that have started; a parent whose worker ended in its start is replaced.

        Raises
        ------
        AnisomeshError
            If several have ended so, one after the other.
        """
        nannies = dict(self._cluster.workers)
        found = {nanny.worker_address for nanny in nannies.values() if nanny.worker_address is not None}
        self._lost = 0 if found - self._known else self._lost
        self._known |= found
        ended = [name for name, nanny in nannies.items() if nanny.status.name in ("closed", "failed")]
        if ended:
            self._lost += len(ended)
            if self._lost >= _MAX_LOST_STARTS:
                raise AnisomeshError(
                    f"{self._lost} workers ended in their start, one after the other, for want of memory or since the "
                    "installation is damaged; give fewer --workers, or --workers 0 to see what happens without any"
                )
            for name in ended:
                self._cluster.workers.pop(name, None)
            self._cluster.scale(self._count)
        return found

    def close(self) -> None:
        """End the processes at once; a worker that is asked to end would have seconds to finish its task."""
        for nanny in list(self._cluster.workers.values()):
            nanny.close_gracefully()  # so that it does not start its process again
            if nanny.pid is not None:
                with suppress(ProcessLookupError):
                    os.kill(nanny.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
