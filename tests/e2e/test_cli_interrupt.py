"""Ctrl-C in the middle of the computation: exit code 130, no file left. Killed: the old file or the whole new one."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

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


def test_until_the_whole_new_file_takes_its_place_the_old_one_is_there(run_cli, torus_obj, tmp_path, monkeypatch):
    """So a run that is killed leaves either: a file takes the place of another at once."""
    out, seen, replace = tmp_path / "out.ply", [], Path.replace
    out.write_bytes(torus_obj.read_bytes())

    def watched(new, target):
        seen.append((target, new.read_bytes()))
        assert out.read_bytes() == torus_obj.read_bytes()
        return replace(new, target)

    monkeypatch.setattr(Path, "replace", watched)
    words = ["remesh", torus_obj, "-o", out, "-n", 150, "--quiet", "--embedding", "direct"]
    assert run_cli(*words).returncode == 0
    assert seen == [(out, out.read_bytes())]
    assert load(out).n_points == 150
    assert list(tmp_path.iterdir()) == [out]
