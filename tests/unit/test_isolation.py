"""Calls in another process: results, errors and crashes are reported to the caller."""

import math
import os
import signal
import subprocess
import sys
import time

import pytest

from anisomesh.errors import AnisomeshError
from anisomesh.execution.isolation import isolated


def test_result_and_error_come_back():
    assert isolated(math.hypot)(3.0, 4.0) == 5.0
    with pytest.raises(ValueError, match="math domain error"):
        isolated(math.sqrt)(-1.0)


def test_it_is_another_process():
    assert isolated(os.getpid)() != os.getpid()


def test_a_crash_is_an_error():
    with pytest.raises(AnisomeshError, match="ended without a result"):
        isolated(os.abort)()


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX systems")
def test_the_process_ends_with_a_killed_caller(tmp_path):
    number = tmp_path / "pid"
    work = f"import os, pathlib, time; pathlib.Path({str(number)!r}).write_text(str(os.getpid())); time.sleep(600)"
    caller = f"""
from anisomesh.execution.isolation import isolated
if __name__ == "__main__":
    isolated(exec)({work!r})
"""
    script = tmp_path / "caller.py"
    script.write_text(caller)
    process = subprocess.Popen([sys.executable, str(script)])
    until = time.monotonic() + 60.0
    while not (number.exists() and number.read_text()) and time.monotonic() < until:
        time.sleep(0.05)
    pid = int(number.read_text())
    process.send_signal(signal.SIGKILL)
    process.wait()
    while is_running(pid) and time.monotonic() < until:
        time.sleep(0.05)
    assert not is_running(pid)


def is_running(pid):
    """Return whether a process exists and is not a zombie that nobody waits for."""
    status = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True, check=False).stdout
    return bool(status.strip()) and not status.startswith("Z")
