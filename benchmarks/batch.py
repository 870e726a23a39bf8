"""Batches of small meshes: throughput by number of workers, overhead of a job, time to resume, killed workers.

Usage: python benchmarks/batch.py [--meshes 1000] [--workers 1 2]
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from anisomesh.batch.inputs import jobs_of
from anisomesh.batch.jobs import Job
from anisomesh.batch.keys import facts_of_files, key_of
from anisomesh.batch.running import REMESHING, Batch, Settings
from anisomesh.batch.work import BatchTask, do
from anisomesh.execution.engine import Work, WorkerPool
from anisomesh.io.meshes import save
from anisomesh.shapes.analytic import sphere

OPTIONS = {"n_vertices": 20, "max_iterations": 1, "embedding": "direct", "fit": False}
WORDS = ["-n", "20", "--max-iterations", "1", "--embedding", "direct", "--no-fit", "--no-thumbnails"]
KILLED_EVERY, N_WITH_KILLS = 10, 40


def do_or_die(task: BatchTask, attempt: int) -> dict:
    """Remesh, but kill the worker of every tenth job in its first try."""
    if int(Path(task.job.input).stem) % KILLED_EVERY == KILLED_EVERY - 1 and attempt == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return do(task, attempt)


def copy(task: BatchTask, attempt: int) -> dict:
    """Copy the input to the output, all that a job is without its remesh."""
    files = facts_of_files(task.job)
    Path(task.target).write_bytes(Path(task.job.input).read_bytes())
    return {"status": "done", "key": key_of(task.job, files), "files": files, "seconds": 0.0}


def measure_overhead(jobs: list[Job], folder: Path) -> None:
    """Print how long jobs take that only copy a file, and a batch of them that is done."""
    ends: list[float] = []
    batch = Batch(jobs, folder / "copies", Settings(workers=WorkerPool(count=2)))
    before = sum(os.times()[:4])
    batch.run(lambda step: ends.append(time.monotonic()), work=Work(do=copy))
    used = sum(os.times()[:4]) - before
    each = (ends[-1] - ends[0]) / (len(ends) - 1)
    print(
        f"{len(jobs):,} jobs without a remesh on 2 workers: {1e3 * each:.1f} ms between two ends; "
        f"{used:.1f} s of processor time, the start of the workers included"
    )
    command = [sys.executable, "-m", "anisomesh", "batch", folder / "in", "-o", folder / "copies", *WORDS]
    begin = time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    print(f"resumed in {time.monotonic() - begin:.2f} s, as a new process: {done.stdout.splitlines()[0]}")


def measure(jobs: list[Job], out: Path, n_workers: int) -> None:
    """Print the throughput of a batch, without the start of the workers, and the overhead of its jobs."""
    ends: list[float] = []
    begin = time.monotonic()
    batch = Batch(jobs, out, Settings(workers=WorkerPool(count=n_workers)))
    rows = batch.run(lambda step: ends.append(time.monotonic()))
    span, n = ends[-1] - ends[0], len(ends) - 1
    seconds = np.array([row["seconds"] for row in rows])
    remesh = np.array([row["report"]["seconds"]["total"] for row in rows])
    between = span / n - seconds.mean() / n_workers
    print(
        f"{n_workers} workers: {len(rows):,} jobs, {n / span:.2f} jobs/s after a start of {ends[0] - begin:.1f} s; "
        f"a remesh {1e3 * remesh.mean():.0f} ms, beside it in the worker {1e3 * (seconds - remesh).mean():.1f} ms, "
        f"between jobs {1e3 * n_workers * between:.1f} ms, reports at the end {time.monotonic() - ends[-1]:.1f} s"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--meshes", type=int, default=1000)
    parser.add_argument("--workers", type=int, nargs="*", default=[1, 2])
    arguments = parser.parse_args()
    print(f"load average {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "in").mkdir()
        for k in range(arguments.meshes):
            surface = sphere(1)
            save(surface.with_points(surface.points * (1.0 + 1e-3 * k)), folder / f"in/{k}.off")
        jobs = jobs_of([str(folder / "in")], OPTIONS)
        measure_overhead(jobs, folder)
        for n_workers in arguments.workers:
            measure(jobs, folder / f"out{n_workers}", n_workers)
        some = sorted(jobs, key=lambda job: int(Path(job.input).stem))[:N_WITH_KILLS]
        batch = Batch(some, folder / "killed", Settings(workers=WorkerPool(count=2)))
        rows = batch.run(work=replace(REMESHING, do=do_or_die))
        tried = sum(row["tries"] > 1 for row in rows)
        print(f"{sum(row['status'] == 'done' for row in rows)} of {len(rows)} jobs done, {tried} of them begun again")
    print(f"load average {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
