"""Ctrl-C in the middle of the computation: exit code 130, no file left. Killed: the old file or the whole new one."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from anisomesh.io.meshes import load
from conftest import CLI

pytestmark = pytest.mark.slow


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for a single process")
def test_interrupt_leaves_no_file(large_torus_obj, tmp_path):
    words = ["remesh", str(large_torus_obj), "-o", str(tmp_path / "out.ply"), "-n", "9000", "--embedding", "direct"]
    words += ["--report", str(tmp_path / "report.json")]
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a signal ignored here the child would ignore
    with subprocess.Popen(
        [*CLI, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    ) as process:
        signal.signal(signal.SIGINT, before)
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


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for a single process")
def test_interrupt_while_modules_are_imported_is_one_line(tmp_path):
    """The signal comes from a module that the command line imports, so that no clock is involved."""
    (tmp_path / "typer.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGINT)\n")
    code = "import signal, runpy; signal.signal(signal.SIGINT, signal.default_int_handler); "
    code += "runpy.run_module('anisomesh', run_name='__main__')"
    path = os.pathsep.join([str(tmp_path), *sys.path])
    env = {**os.environ, "PYTHONPATH": path}
    done = subprocess.run(
        [sys.executable, "-c", code], check=False, capture_output=True, text=True, timeout=60, env=env
    )
    assert (done.returncode, done.stderr) == (130, "anisomesh: interrupted\n")


def test_killed_at_any_moment_the_old_file_or_the_whole_new_one_is_there(torus_obj, tmp_path):
    """Runs are killed ever later, until one is through; where it writes, the moments are close together."""
    out = tmp_path / "out.ply"
    words = [*CLI, "remesh", str(torus_obj), "-o", str(out), "-n", "150", "--embedding", "direct", "--quiet"]
    start = time.perf_counter()
    subprocess.run(words, check=True, timeout=240)
    whole, n_new = time.perf_counter() - start, load(out).n_points
    old = torus_obj.read_bytes()
    done = 0
    for share in (0.3, 0.8, 0.94, 1.0, 1.03):
        out.write_bytes(old)
        process = subprocess.Popen(words)
        time.sleep(share * whole)
        process.kill()
        process.wait()
        if out.read_bytes() != old:
            assert load(out).n_points == n_new
            done += 1
    assert done < 5
