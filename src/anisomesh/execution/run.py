"""Stage times, time limit and progress of one run."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from anisomesh.errors import TimeLimitError
from anisomesh.execution.deadline import Deadline
from anisomesh.execution.progress import OnStep, StepInfo

OPTIMISATION_SHARE = 0.6  # of the time limit, for everything up to the end of the optimisation


class Run:
    """Stage times, time limit and progress of one run."""

    def __init__(self, on_step: OnStep, deadline: Deadline) -> None:
        self.on_step = on_step
        self.deadline = deadline
        self._seconds = {"load": 0.0}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Report a stage, and add the time of the work inside to it."""
        self.on_step(StepInfo(stage=name))
        start = time.perf_counter()
        yield
        self._seconds[name] = self._seconds.get(name, 0.0) + time.perf_counter() - start

    def check_time(self) -> None:
        """Raise TimeLimitError if no time is left for the optimisation."""
        if self.deadline.share(OPTIMISATION_SHARE).passed():
            raise TimeLimitError(
                f"the time limit of {self.deadline.limit:g} s was as good as over before the optimisation began (after "
                f"{self.deadline.seconds:.1f} s); give more time, or ask for fewer vertices"
            )

    def total_seconds(self) -> dict[str, float]:
        """Return the seconds of each stage, and in all."""
        return {**self._seconds, "total": self.deadline.seconds}
