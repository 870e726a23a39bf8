"""Calls in a separate process, for libraries that can crash the process."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import connection, get_context, parent_process
from typing import ParamSpec, TypeVar

from anisomesh.errors import AnisomeshError

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


def isolated(work: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Return a function that runs ``work`` in a new process.

    Parameters
    ----------
    work
        A module-level function; its arguments and its result are pickled.

    Notes
    -----
    The output of the process, including output of C code, is discarded. The function raises the exceptions of ``work``,
    and :class:`AnisomeshError` if the process ends without a result. The process ends with the one that called it, also
    if that is killed.
    """

    def call(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
        with ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=_begin) as pool:
            try:
                return pool.submit(work, *args, **kwargs).result()
            except BrokenProcessPool as error:
                raise AnisomeshError("the process of the method ended without a result") from error

    return call


def _begin() -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)
