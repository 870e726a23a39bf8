"""How commands with worker processes end when the system asks them to."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

ENDED_BY_SIGTERM = 128 + signal.SIGTERM
"""Exit code of a process that is ended by this signal."""


@contextmanager
def exit_at_sigterm() -> Iterator[None]:
    """Let SIGTERM raise SystemExit in the meantime, so that workers and what they share end with the command.

    The exit code is the one of a process that is ended by the signal, 143.
    """
    before = signal.signal(signal.SIGTERM, _exit)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL if before is None else before)


def _exit(_number: int, _frame: FrameType | None) -> None:
    sys.exit(ENDED_BY_SIGTERM)
