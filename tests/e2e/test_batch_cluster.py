"""Batches on worker processes: workers that are killed, hang or lose their parent cost one job at most."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from batch_tasks import MEMORY, act, kill_every_tenth, limit

from anisomesh.batch.jobs import Job
from anisomesh.batch.rows import Results
from anisomesh.batch.running import Batch, Settings
from anisomesh.errors import AnisomeshError
from anisomesh.execution.cluster import _LOCAL_CONFIG
from anisomesh.execution.engine import MAX_TRIES, Work, WorkerPool
from conftest import torus_arrays, write_obj

pytest.importorskip("distributed")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="signals")]


def test_a_worker_that_ends_costs_its_task_a_try_and_nothing_else(monkeypatch):
    monkeypatch.setattr("distributed.system.MEMORY_LIMIT", 2 * MEMORY)
    kinds = [("kill", MAX_TRIES), ("hang", 1), ("raise", 0), ("fill", 1), *[("plain", 0)] * 4]
    tasks = [{"kind": kind, "times": times, "limit": 2.0 if kind == "hang" else None} for kind, times in kinds]
    found = sorted(WorkerPool(count=2).run(Work(do=act, limit=limit), tasks), key=lambda outcome: outcome.number)
    assert [outcome.number for outcome in found] == list(range(len(tasks)))
    assert [outcome.tries for outcome in found] == [MAX_TRIES, 2, 1, 2, *[1] * 4]
    failed = [outcome.error for outcome in found if outcome.error is not None]
    assert [outcome.error is None for outcome in found] == [False, True, False, *[True] * 5]
    assert "its worker ended in each of 3 tries" in failed[0]
    assert failed[1] == "ValueError: not today"
    assert os.getpid() not in {outcome.result for outcome in found}


def test_a_worker_that_is_killed_as_soon_as_it_has_started_is_started_again():
    """Regression: it began a task before its parent knew it, and no worker was left when it ended."""
    tasks = [{"kind": "kill", "times": 2}, {"kind": "plain", "times": 0}]
    assert [outcome.tries for outcome in WorkerPool(count=1).run(Work(do=act), tasks)] == [3, 1]


def test_a_worker_that_ends_in_its_own_start_is_replaced(monkeypatch, tmp_path):
    """Regression: nothing was started in its place, and the batch gave up after 300 s."""
    end_starts(monkeypatch, tmp_path, "1 3")  # at first, and after the kill
    tasks = [{"kind": "kill", "times": 1}, {"kind": "plain", "times": 0}]
    assert [outcome.tries for outcome in WorkerPool(count=1).run(Work(do=act), tasks)] == [2, 1]
    assert len(list(tmp_path.iterdir())) == 4


def test_a_batch_ends_if_no_worker_can_start(monkeypatch, tmp_path):
    end_starts(monkeypatch, tmp_path, "1 2")
    monkeypatch.setattr("anisomesh.execution.cluster._MAX_LOST_STARTS", 2)
    with pytest.raises(AnisomeshError, match="workers ended in their start"):
        list(WorkerPool(count=1).run(Work(do=act), [{"kind": "plain", "times": 0}]))


def end_starts(monkeypatch, folder, numbers):
    monkeypatch.setenv("BATCH_TEST_STARTS", str(folder))
    monkeypatch.setenv("BATCH_TEST_ENDED_STARTS", numbers)
    preloads = [*_LOCAL_CONFIG["distributed.worker.preload"], "batch_tasks"]
    monkeypatch.setitem(_LOCAL_CONFIG, "distributed.worker.preload", preloads)


def jobs_in(folder, n):
    write_obj(folder / "0.obj", *torus_arrays(6, 4))
    for k in range(1, n):
        (folder / f"{k}.obj").write_bytes((folder / "0.obj").read_bytes())
    return [Job(input=str(folder / f"{k}.obj"), output=f"{k}.ply", options={"n_vertices": 20}) for k in range(n)]


def test_every_job_is_done_if_a_worker_is_killed_every_ten(tmp_path):
    jobs = jobs_in(tmp_path, 20)
    rows = Batch(jobs, tmp_path / "out", Settings(workers=WorkerPool(count=2))).run(work=Work(do=kill_every_tenth))
    assert [row["status"] for row in rows] == 20 * ["done"]
    assert [row["tries"] for row in rows] == 2 * (9 * [1] + [2])
    assert all((tmp_path / "out" / f"{k}.ply").is_file() for k in range(20))
    lines = (tmp_path / "out/results.jsonl").read_text().splitlines()
    assert sorted(json.loads(line)["output"] for line in lines) == sorted(job.output for job in jobs)


def test_a_running_cluster_is_used_and_left_running(monkeypatch):
    from distributed import LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        workers, work = WorkerPool(scheduler=cluster.scheduler_address), Work(do=act)
        tasks = [{"kind": "plain", "times": 0}, {"kind": "kill", "times": 1}, {"kind": "plain", "times": 0}]
        assert sorted((o.number, o.tries) for o in workers.run(work, tasks)) == [(0, 1), (1, 2), (2, 1)]
        assert len({outcome.result for outcome in workers.run(work, tasks[:1])}) == 1
    monkeypatch.setattr("anisomesh.execution.cluster._SECONDS_TO_CONNECT", 0.5)
    with pytest.raises(AnisomeshError, match="no scheduler answers"):
        list(WorkerPool(scheduler="tcp://127.0.0.1:9").run(work, tasks))


SCRIPT = """
import os, signal, sys, time
from pathlib import Path
from anisomesh.execution.engine import Work, WorkerPool
from batch_tasks import note_and_wait
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # it may be ignored where the tests were started
    list(WorkerPool(count=1).run(Work(do=note_and_wait), [sys.argv[1]]))
"""


def is_alive(pid):
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, 0)
        return Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z" if Path("/proc").is_dir() else True
    return False


def until(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()


@pytest.mark.parametrize("signum", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT], ids=lambda signum: signum.name)
def test_workers_end_with_their_parent(tmp_path, signum):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    pids = tmp_path / "pids"
    pids.mkdir()
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    process = subprocess.Popen([sys.executable, script, pids], env=env, stderr=subprocess.DEVNULL)
    try:
        assert until(lambda: len(list(pids.iterdir())) == 1)
        process.send_signal(signum)
        process.wait(timeout=30)
        workers = [int(path.name) for path in pids.iterdir()]
        assert until(lambda: not any(map(is_alive, workers)), 20.0)
    finally:
        process.kill()


def test_results_can_be_read_while_another_process_writes_a_row(tmp_path):
    results = Results(tmp_path)
    results.append({"output": "a.ply", "status": "done", "finished": "1", "key": None, "files": {}})
    with results.path.open("a") as file:
        file.write('{"output": "b.p')
    assert list(results.rows()) == ["a.ply"]
    Results(tmp_path).append({"output": "b.ply", "status": "done", "finished": "2", "key": None, "files": {}})
    assert list(results.rows()) == ["a.ply", "b.ply"]
