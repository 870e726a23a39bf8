"""What Dask calls when a worker process of this machine starts."""

from __future__ import annotations

import signal
from typing import Any


def dask_setup(worker: Any) -> None:
    """Leave Ctrl-C, which reaches every process of a terminal, to the parent, which ends its workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
