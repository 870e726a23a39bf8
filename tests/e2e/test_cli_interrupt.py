"""Ctrl-C in the middle of the computation: exit code 130, no file left."""

import os
import signal
import subprocess
import sys
import threading

import pytest

from conftest import CLI


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for a single process")
def test_interrupt_leaves_no_file(large_torus_obj, tmp_path):
    words = ["remesh", str(large_torus_obj), "-o", str(tmp_path / "out.ply"), "-n", "9000"]
    words += ["--report", str(tmp_path / "report.json")]
    with subprocess.Popen(
        [*CLI, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    ) as process:
        watchdog = threading.Timer(240, process.kill)
        watchdog.start()
        seen = []
        for line in process.stderr:
            seen.append(line)
            if line.startswith("moving the sites"):
                process.send_signal(signal.SIGINT)
                break
        rest, out = process.stderr.read(), process.stdout.read()
        code = process.wait()
        watchdog.cancel()
    assert code == 130, "".join(seen) + rest
    assert rest.splitlines()[-1] == "anisomesh: interrupted"
    assert "Traceback" not in rest
    assert out == ""
    assert list(tmp_path.iterdir()) == []
