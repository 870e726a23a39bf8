"""Shared fixtures: the command line, small meshes, the folder of real meshes; Hypothesis profiles."""

import contextlib
import io
import itertools
import json
import os
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from subprocess import CompletedProcess
from unittest import mock

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before torch is imported: several test workers share the cores

import hypothesis
import numpy as np
import pytest

hypothesis.settings.register_profile("ci", deadline=None, print_blob=True)
hypothesis.settings.register_profile("dev", deadline=None, max_examples=15)
hypothesis.settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE") or ("ci" if os.environ.get("CI") else "dev"))

CLI = [sys.executable, "-m", "anisomesh"]
MOST_SECONDS = 8.0  # of processor time, with subprocesses; the summary names tests above it, see CONTRIBUTING.md


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile the kernels before several workers start, which would compile the same ones at the same time."""
    if session.config.getoption("numprocesses", None) and not hasattr(session.config, "workerinput"):
        from anisomesh._kernels.warmup import kernels_cached

        if not all(map(kernels_cached, ("remesh", "fit", "decimate", "evaluate"))):
            command = [sys.executable, str(Path(__file__).with_name("compile_kernels.py"))]
            programs = [subprocess.Popen([*command, part]) for part in ("first", "second")]
            for program in programs:
                program.wait()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Record the processor time of a test, which depends less on what else runs than the time on the clock."""
    start = _processor_seconds()
    try:
        return (yield)
    finally:
        item.user_properties.append(("processor seconds", _processor_seconds() - start))


def _processor_seconds() -> float:
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Name the tests that take more processor time than a test should."""
    seconds = {
        report.nodeid: dict(report.user_properties).get("processor seconds", 0.0)
        for report in terminalreporter.getreports("passed")
        if report.when == "call"
    }
    dear = sorted((name for name in seconds if seconds[name] > MOST_SECONDS), key=lambda name: -seconds[name])
    if dear:
        terminalreporter.section(f"tests that took more than {MOST_SECONDS:g} s of processor time")
        for name in dear:
            terminalreporter.line(f"{seconds[name]:6.1f} s  {name}")


def examples(number: int) -> hypothesis.settings:
    """Return settings with this number of examples in the profile ``ci``, and at most 15 in ``dev``."""
    full = hypothesis.settings.get_current_profile_name() == "ci"
    return hypothesis.settings(max_examples=number if full else min(number, hypothesis.settings().max_examples))


def pairwise(*values: Iterable[object]) -> list[tuple[object, ...]]:
    """Return combinations of one value each, such that every two values of two parameters meet in one of them."""
    combinations = list(itertools.product(*map(list, values)))
    indices = itertools.product(*(range(len(list(options))) for options in values))
    pairs = [set(itertools.combinations(enumerate(row), 2)) for row in indices]
    missing, chosen = set().union(*pairs), []
    while missing:
        chosen.append(max(range(len(pairs)), key=lambda k: len(pairs[k] & missing)))
        missing -= pairs[chosen[-1]]
    return [combinations[k] for k in sorted(chosen)]


@pytest.fixture(scope="session")
def run_cli() -> Callable[..., CompletedProcess[str]]:
    """Run ``anisomesh`` with the given arguments in this process and return its exit code and output."""

    def run(*words: object, cwd: Path | None = None, **environment: str) -> CompletedProcess[str]:
        from anisomesh.cli.main import main

        arguments = [str(word) for word in words]
        with (
            contextlib.chdir(cwd or Path.cwd()),
            mock.patch.dict(os.environ, environment),
            contextlib.redirect_stdout(io.StringIO()) as out,
            contextlib.redirect_stderr(io.StringIO()) as err,
            _warnings_on_stderr(),
        ):
            code = main(arguments)
        return CompletedProcess(arguments, code, out.getvalue(), err.getvalue())

    return run


@pytest.fixture(scope="session")
def run_process() -> Callable[..., CompletedProcess[str]]:
    """Run ``anisomesh`` with the given arguments in a new process and return the finished process."""

    def run(*words: object, cwd: Path | None = None) -> CompletedProcess[str]:
        command = [*CLI, *map(str, words)]
        return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=300, check=False)

    return run


@contextlib.contextmanager
def _warnings_on_stderr() -> Iterator[None]:
    """Show warnings as the interpreter does by default, and not as pytest does."""

    def show(message: Warning | str, category: type[Warning], filename: str, lineno: int, *_: object) -> None:
        sys.stderr.write(warnings.formatwarning(message, category, filename, lineno))

    with warnings.catch_warnings():
        warnings.resetwarnings()
        for category in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
            warnings.simplefilter("ignore", category)
        warnings.showwarning = show
        yield


def torus_arrays(around: int, across: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points and faces of a torus: ``around * across`` points, twice as many faces."""
    u, v = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    a, b = 2 * np.pi * u.ravel() / around, 2 * np.pi * v.ravel() / across
    ring = 1.0 + 0.35 * np.cos(b)
    points = np.stack([ring * np.cos(a), ring * np.sin(a), 0.35 * np.sin(b)], axis=1)

    def at(i: np.ndarray, j: np.ndarray) -> np.ndarray:
        return ((i % around) * across + j % across).ravel()

    lower = np.stack([at(u, v), at(u + 1, v), at(u + 1, v + 1)], axis=1)
    upper = np.stack([at(u, v), at(u + 1, v + 1), at(u, v + 1)], axis=1)
    return points, np.concatenate([lower, upper])


def write_obj(path: Path, points: np.ndarray, faces: np.ndarray) -> Path:
    """Write an OBJ file without the help of the package."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces.tolist()]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="session")
def torus_obj(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An OBJ file with a torus of 1,152 points and 2,304 faces."""
    return write_obj(tmp_path_factory.mktemp("input") / "torus.obj", *torus_arrays(48, 24))


@pytest.fixture(scope="session")
def large_torus_obj(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An OBJ file with a torus of 20,000 points, enough to keep the optimiser busy for many seconds."""
    return write_obj(tmp_path_factory.mktemp("input") / "large.obj", *torus_arrays(200, 100))


@pytest.fixture(scope="session")
def item_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small data set of two implicit shapes, one for training and one for validation."""
    from anisomesh.learn.data.items import save_item
    from anisomesh.learn.data.make import items_of_blobs
    from anisomesh.learn.data.recipe import Recipe
    from anisomesh.pipeline import remesh
    from anisomesh.shapes.implicit import Blobs

    folder, rows = tmp_path_factory.mktemp("items"), []
    for seed, split in enumerate(("training", "validation")):
        name, items = f"blobs-{seed}", []
        shape = Blobs.random(np.random.default_rng(seed))
        for entry in items_of_blobs(shape, Recipe(target=150), np.random.default_rng(seed), remesh):
            items.append({"file": f"{name}.{entry.kind}.npz", "kind": entry.kind})
            save_item(entry.item, folder / items[-1]["file"])
        row = {"name": name, "family": str(seed), "split": split, "fingerprint": "", "status": "kept", "items": items}
        rows.append(json.dumps(row) + "\n")
    (folder / "manifest.jsonl").write_text("".join(rows))
    return folder


@pytest.fixture(scope="session")
def data_folder() -> Path:
    """The folder of real meshes, named by ANISOMESH_DATA."""
    name = os.environ.get("ANISOMESH_DATA")
    if not name or not Path(name).is_dir():
        pytest.skip("the environment variable ANISOMESH_DATA names no folder of real meshes")
    return Path(name)
