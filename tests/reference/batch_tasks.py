"""What workers do in tests of batches; a module that is imported at once, as every worker does that."""

import os
import signal
import time
from pathlib import Path

MEMORY = 500_000_000  # bytes for each worker, more than it needs without work


def dask_setup(worker):
    """End in the start of a worker, if a test says which starts, counted from 1, end so."""
    if "BATCH_TEST_STARTS" in os.environ:
        folder = Path(os.environ["BATCH_TEST_STARTS"])
        number = len(list(folder.iterdir())) + 1
        (folder / str(number)).touch()
        if str(number) in os.environ["BATCH_TEST_ENDED_STARTS"].split():
            os._exit(1)


def act(task, attempt):
    """Do what a task says."""
    if task["kind"] == "kill" and attempt <= task["times"]:
        os.kill(os.getpid(), signal.SIGKILL)
    if task["kind"] == "hang" and attempt <= task["times"]:
        time.sleep(60)
    if task["kind"] == "fill" and attempt <= task["times"]:
        filled = b"1" * MEMORY
        time.sleep(60)
        return filled
    if task["kind"] == "raise":
        raise ValueError("not today")
    return os.getpid()


def limit(task):
    return task.get("limit")


def kill_every_tenth(task, attempt):
    """Write an output as a remesh does; the worker of every tenth job is killed in its first try."""
    if int(Path(task.job.input).stem) % 10 == 9 and attempt == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    Path(task.target).write_text(str(os.getpid()))
    return {"status": "done", "key": None, "files": {}, "seconds": 0.0}


def note_and_wait(folder, attempt):
    Path(folder, str(os.getpid())).touch()
    time.sleep(300)
