"""A few threads that share work on kernels that release the GIL."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np
import numpy.typing as npt

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")
_Number = TypeVar("_Number", bound=np.generic)


def blocks(items: npt.NDArray[_Number], size: int) -> list[npt.NDArray[_Number]]:
    """Return an array (n,) in blocks of this size, the last one shorter; an empty one is a block, too."""
    return [items[first : first + size] for first in range(0, max(len(items), 1), size)]


class Workers:
    """The calling thread and some more, kept from call to call.

    Parameters
    ----------
    threads
        Number of threads, at least 1; with 1 everything runs in the calling thread.
    """

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self._pool = ThreadPoolExecutor(threads - 1) if threads > 1 else None

    def map(self, work: Callable[[int, _Item], _Result], items: Sequence[_Item]) -> list[_Result]:
        """Return ``work(thread, item)`` for every item, in their order.

        ``thread`` is a number below ``threads``; no two calls at the same time have the same. Whichever thread is free
        takes the next item. An exception ends the thread that meets it and is raised here once all threads are done.
        """
        results: list[_Result | None] = [None] * len(items)
        turns = itertools.count()  # its next() is atomic

        def strand(thread: int) -> None:
            while (turn := next(turns)) < len(items):
                results[turn] = work(thread, items[turn])

        helpers = range(1, min(self.threads, len(items)))
        futures = [self._pool.submit(strand, thread) for thread in helpers] if self._pool is not None else []
        try:
            strand(0)
        finally:
            errors = [future.exception() for future in futures]
        for error in errors:
            if error is not None:
                raise error
        return results  # type: ignore[return-value]  # every item has had its turn
