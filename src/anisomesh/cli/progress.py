"""Progress on stderr: a live bar on a terminal, a few plain lines elsewhere."""

from __future__ import annotations

import sys
import time
from contextlib import AbstractContextManager
from types import TracebackType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from anisomesh.execution.progress import StepInfo

_STAGE_LABELS = {
    "prepare": "preparing the mesh",
    "metric": "computing the metric",
    "embed": "embedding",
    "cvt": "moving the sites",
    "dual": "building the triangles",
    "fit": "fitting them to the input",
    "attributes": "carrying attributes over",
    "search": "searching the number of vertices",
    "level": "level of detail",
    "batch": "remeshing",
}
_SECONDS_BETWEEN_LINES = 5.0  # heuristic


class Display(AbstractContextManager["Display"]):
    """Progress display that shows nothing; the base class of the others."""

    def __call__(self, step: StepInfo) -> None:
        """Ignore the step."""

    def note(self, text: str) -> None:
        """Ignore the remark."""

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Do nothing."""


class _LineDisplay(Display):
    """A line at the start of each stage and every few seconds after it."""

    def __init__(self) -> None:
        self._stage = ""
        self._last = 0.0

    def __call__(self, step: StepInfo) -> None:
        """Print the step if it starts a stage or the last line is 5 s old."""
        now = time.monotonic()
        if step.stage == self._stage and now - self._last < _SECONDS_BETWEEN_LINES:
            return
        self._stage, self._last = step.stage, now
        self.note(f"{_STAGE_LABELS.get(step.stage, step.stage)}{_details(step)}")

    def note(self, text: str) -> None:
        """Print a remark."""
        print(text, file=sys.stderr, flush=True)


class _BarDisplay(Display):
    """Live progress bar that disappears at the end."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        self._progress = Progress(
            TextColumn("{task.description:<22}"),
            BarColumn(bar_width=30),
            TextColumn("{task.fields[details]}"),
            TimeElapsedColumn(),
            console=Console(stderr=True),
            transient=True,
        )
        self._task = self._progress.add_task("starting", total=None, details="")

    def __enter__(self) -> _BarDisplay:
        """Show the bar."""
        self._progress.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Remove the bar."""
        self._progress.stop()

    def __call__(self, step: StepInfo) -> None:
        """Update the bar."""
        self._progress.update(
            self._task,
            description=_STAGE_LABELS.get(step.stage, step.stage),
            completed=step.iteration,
            total=step.total or None,
            details=_details(step).lstrip(),
        )

    def note(self, text: str) -> None:
        """Print a remark above the bar."""
        self._progress.console.print(text, style="dim", markup=False, highlight=False)


def _details(step: StepInfo) -> str:
    parts = [f"{step.iteration}/{step.total}"] if step.total > 1 else []
    if step.energy is not None:
        parts.append(f"energy {step.energy:.4g}")
    if step.message:
        parts.append(step.message)
    return "  " + "  ".join(parts) if parts else ""


def progress(quiet: bool) -> Display:
    """Return a progress display for stderr: a live bar on a terminal, plain lines elsewhere.

    Parameters
    ----------
    quiet
        Show no progress at all.

    Returns
    -------
    context manager
        Call it with a :class:`~anisomesh.execution.progress.StepInfo` for every step; ``note(text)`` prints a remark.
    """
    if quiet:
        return Display()
    return _BarDisplay() if sys.stderr.isatty() else _LineDisplay()


def announce_compilation(display: Display, *works: str) -> None:
    """Announce the compilation of numeric kernels unless the kernels of these kinds of work are cached."""
    from anisomesh._kernels.warmup import kernels_cached

    if not all(map(kernels_cached, works)):
        display.note("compiling the numeric kernels (once per installation, one to two minutes) ...")


def announce_remesh(display: Display, options: dict[str, Any]) -> None:
    """Announce the compilation of the kernels that a remesh with some options needs, unless they are cached."""
    from anisomesh.options import RemeshOptions
    from anisomesh.resolve import embedding_name

    source = RemeshOptions(
        **{name: options[name] for name in ("metric", "embedding", "weights", "fit") if name in options}
    )
    named = isinstance(source.metric, str) and source.metric == "approximation"
    nearest = named or options.get("max_error") is not None
    works = [
        "remesh",
        *(["fit"] if source.fit else []),
        *(["decimate"] if source.fit and nearest else []),
        *(["network"] if embedding_name(source) in ("neural", "hybrid") else []),
    ]
    announce_compilation(display, *works)
