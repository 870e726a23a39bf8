"""Calls in a process of their own, for libraries that can end the process."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import ParamSpec, TypeVar

from anisomesh.errors import AnisomeshError

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


def isolated(work: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Return a function that does the same in a new process.

    Parameters
    ----------
    work
        A function of a module; its arguments and its result are pickled.

    Notes
    -----
    What the process prints, from C as well, is thrown away. An exception comes back as it is; if the process ends
    without a result the function raises :class:`AnisomeshError`.
    """

    def call(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
        with ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=_silence) as pool:
            try:
                return pool.submit(work, *args, **kwargs).result()
            except BrokenProcessPool as error:
                raise AnisomeshError("the process of the method ended without a result") from error

    return call


def _silence() -> None:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
