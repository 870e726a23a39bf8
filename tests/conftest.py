"""What every test may use: the command line in a process of its own, small meshes, the folder of real meshes."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import hypothesis
import numpy as np
import pytest

hypothesis.settings.register_profile("anisomesh", deadline=None)
hypothesis.settings.load_profile("anisomesh")

CLI = [sys.executable, "-c", "from anisomesh.cli.main import run; run()"]


@pytest.fixture(scope="session")
def run_cli() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Run ``anisomesh`` with the given words and return the finished process."""

    def run(*words: object, cwd: Path | None = None, **environment: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [*CLI, *map(str, words)],
            cwd=cwd,
            env={**os.environ, "OMP_NUM_THREADS": "1", **environment},
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )

    return run


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
def data_folder() -> Path:
    """The folder of real meshes, named by ANISOMESH_DATA."""
    name = os.environ.get("ANISOMESH_DATA")
    if not name or not Path(name).is_dir():
        pytest.skip("the environment variable ANISOMESH_DATA names no folder of real meshes")
    return Path(name)
