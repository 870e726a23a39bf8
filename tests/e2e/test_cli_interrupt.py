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


def run_with(code, *words, path=()):
    """Run code, then the command in a process of its own, in which Ctrl-C works whatever it does here."""
    code = f"import atexit, os, runpy, signal; signal.signal(signal.SIGINT, signal.default_int_handler); {code}; "
    code += "runpy.run_module('anisomesh', run_name='__main__', alter_sys=True)"
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([*map(str, path), *sys.path])}
    return subprocess.run(
        [sys.executable, "-c", code, *words], check=False, capture_output=True, text=True, timeout=60, env=env
    )


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for a single process")
def test_interrupt_while_modules_are_imported_is_one_line(tmp_path):
    """The signal comes from a module that the command line imports, so that no clock is involved."""
    (tmp_path / "typer.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGINT)\n")
    done = run_with("pass", path=[tmp_path])
    assert (done.returncode, done.stderr) == (130, "anisomesh: interrupted\n")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for a single process")
def test_interrupt_while_the_interpreter_shuts_down_is_one_line():
    """The signal comes when the command is done, as if Ctrl-C were pressed milliseconds before its end."""
    done = run_with("atexit.register(os.kill, os.getpid(), signal.SIGINT)", "--version")
    assert (done.returncode, done.stderr) == (130, "anisomesh: interrupted\n")
    assert done.stdout.startswith("anisomesh ")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for a single process")
def test_a_process_that_ignores_interrupts_ignores_them_at_the_end_too():
    code = "signal.signal(signal.SIGINT, signal.SIG_IGN); atexit.register(os.kill, os.getpid(), signal.SIGINT)"
    assert run_with(code, "--version").returncode == 0


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
