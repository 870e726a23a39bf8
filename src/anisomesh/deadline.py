"""A limit on the wall-clock time of a run."""

from __future__ import annotations

import time
from collections.abc import Callable

Stop = Callable[[], bool]
"""Asked between steps of long work whether it is to end with what it has."""


def never() -> bool:
    """Return False: the work may take as long as it takes."""
    return False


class Clock:
    """Time since the start of a run, against a limit in seconds, None for no limit."""

    def __init__(self, limit: float | None = None) -> None:
        self.limit = limit
        self.start = time.perf_counter()

    @property
    def seconds(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self.start

    def over(self, share: float = 1.0) -> bool:
        """Return whether this share of the limit is over."""
        return self.limit is not None and self.seconds > share * self.limit
