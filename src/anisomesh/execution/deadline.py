"""A limit on the wall-clock time of a run."""

from __future__ import annotations

import time


class Deadline:
    """A moment at which long work is to end with what it has.

    Parameters
    ----------
    limit
        Seconds from the start, None for no limit.
    start
        Value of ``time.perf_counter()`` to count from; now by default.
    """

    def __init__(self, limit: float | None = None, start: float | None = None) -> None:
        self.limit = limit
        self.start = time.perf_counter() if start is None else start

    @property
    def seconds(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self.start

    def passed(self) -> bool:
        """Return whether the limit is over."""
        return self.limit is not None and self.seconds > self.limit

    def share(self, share: float) -> Deadline:
        """Return the earlier deadline at this share of the limit."""
        return Deadline(None if self.limit is None else share * self.limit, self.start)


NO_DEADLINE = Deadline()
