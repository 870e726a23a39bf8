"""The work of one job, as a worker does it: read, remesh, write, and say in a row what became of it."""

from __future__ import annotations

import logging
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from anisomesh.batch.jobs import Job
from anisomesh.batch.keys import facts_of_files, key_of
from anisomesh.batch.options import for_mesh, prescribed_by
from anisomesh.batch.places import local_copy, local_output
from anisomesh.errors import AnisomeshError

if TYPE_CHECKING:
    from anisomesh.mesh.surface import Surface

THUMBNAIL_SIZE = (160, 120)  # pixels
_VIEW_ASPECT = THUMBNAIL_SIZE[0] / THUMBNAIL_SIZE[1]
_PICTURE_SCALE = 0.5  # thinner lines than in a picture of normal size


@dataclass(frozen=True, kw_only=True)
class BatchTask:
    """A job for a worker: where the result goes, its picture, None for none, and the seconds after which it hangs."""

    job: Job
    target: str
    picture: Path | None = None
    limit: float | None = None


def do(task: BatchTask, attempt: int = 1) -> dict[str, Any]:
    """Remesh and return the row of a job; errors become rows too.

    Parameters
    ----------
    task
        The job.
    attempt
        How often the job has been begun; from the second time on nothing is drawn, in case that ended the process.

    Returns
    -------
    row
        With ``status``: ``done``, ``refused`` if anisomesh said why it cannot be done, ``failed`` for other errors.
        Then the ``key``, the facts of ``files``, ``seconds``, the ``report``, and ``log``, what readers and writers
        warned of.
    """
    start = time.perf_counter()
    row: dict[str, Any] = {"key": None, "files": {}}
    with _warnings() as log:
        try:
            row["files"] = facts_of_files(task.job)
            row["key"] = key_of(task.job, row["files"])
            row |= {"status": "done", "report": _remesh(task, draw=attempt == 1)}
        except AnisomeshError as error:
            row |= {"status": "refused", "error": str(error)}
        except Exception as error:  # one bad mesh must not end a batch of thousands
            row |= {
                "status": "failed",
                "error": f"{type(error).__name__}: {error}",
                "traceback": traceback.format_exc(),
            }
    return row | {"seconds": time.perf_counter() - start, "log": log}


def prepare_process() -> None:
    """Import what a remesh needs, and load its kernels or compile them, in a remesh of almost nothing.

    So that a limit on the time of a job is one on its own work.
    """
    from anisomesh.pipeline import remesh
    from anisomesh.shapes.analytic import sphere

    remesh(sphere(1), n_vertices=20, max_iterations=1, embedding="direct", threads=1)


def _remesh(task: BatchTask, *, draw: bool) -> dict[str, Any]:
    from anisomesh.io.meshes import load_mesh, save
    from anisomesh.levels.files import save_meshes
    from anisomesh.levels.remesh import remesh_levels
    from anisomesh.pipeline import remesh

    with local_copy(task.job.input) as path:
        mesh = load_mesh(path)
    keywords, prescribed = for_mesh(task.job.options, mesh.surface.diagonal), prescribed_by(task.job.options)
    if prescribed is not None:
        keywords |= prescribed.options_for(mesh, task.job.input)
    is_one = "ratios" not in keywords
    with nullcontext() if prescribed is None else prescribed.named_in_errors():
        levels = [remesh(mesh, **keywords)] if is_one else remesh_levels(mesh, **keywords)
    first = levels[0]
    with local_output(task.target) as path:
        if is_one:
            save(first.mesh, path)
        else:
            save_meshes([level.mesh for level in levels], path)
    if draw and task.picture is not None:
        _draw(first.surface, task.picture)
    each = {} if is_one else {"levels": [level.report() for level in levels]}
    return first.report() | {"prepared": first.prepare_report.lines()} | each


def _draw(surface: Surface, picture: Path) -> None:
    from matplotlib.image import imsave

    from anisomesh.io.atomic import atomic_path
    from anisomesh.viz.draw import render
    from anisomesh.viz.view import whole_view

    pixels = render(surface, whole_view(surface.points, _VIEW_ASPECT), THUMBNAIL_SIZE, scale=_PICTURE_SCALE)
    picture.parent.mkdir(parents=True, exist_ok=True)
    with atomic_path(picture) as temporary:
        imsave(temporary, pixels)


class _List(logging.Handler):
    """Keeps the warnings of the package, each once."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a record."""
        if (line := record.getMessage()) not in self.lines:
            self.lines.append(line)


@contextmanager
def _warnings() -> Iterator[list[str]]:
    """Yield a list of what the package warns of in the meantime, and let no other handler have it."""
    logger, handler = logging.getLogger("anisomesh"), _List()
    handlers, propagate = logger.handlers, logger.propagate
    logger.handlers, logger.propagate = [handler], False
    try:
        yield handler.lines
    finally:
        logger.handlers, logger.propagate = handlers, propagate
