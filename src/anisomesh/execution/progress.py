"""How a run reports its progress."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class StepInfo:
    """One step of a run.

    Attributes
    ----------
    stage
        ``"load"``, ``"prepare"``, ``"metric"``, ``"embed"``, ``"cvt"``, ``"dual"``, ``"fit"``,
        ``"attributes"``, ``"search"`` or ``"level"``; ``"batch"`` for a job of many.
    iteration, total
        Iterations done, and an upper bound on them; 0 where a stage has none.
    energy
        Energy of the sites, if the stage has one.
    message
        A remark for the user.
    """

    stage: str
    iteration: int = 0
    total: int = 0
    energy: float | None = None
    message: str = ""


OnStep = Callable[[StepInfo], None]
"""Called with every step; an exception that it raises ends the run."""


def ignore_steps(step: StepInfo) -> None:
    """Report nothing."""
