"""Compilation of kernels: machine code cached on disk, without the GIL, without reference counts.

Numba counts references to arrays at every call, in atomic operations that its optimiser does not remove from functions
as large as the clipping; they take two thirds of the time. A kernel without reference counts cannot allocate: all its
arrays belong to the caller.
"""

from collections.abc import Callable
from typing import Any

from numba import njit
from numba.core import types

_OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
_COUNTED: dict[str, Any] = {**_OPTIONS, "_nrt": True}
_UNCOUNTED: dict[str, Any] = {**_OPTIONS, "_nrt": False}


def compiling(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles a function with these options, once for all values of its arguments.

    Where a kernel calls another one with a constant, also one in a variable that changes later, Numba compiles that one
    for the constant, too: more time for the same result.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = njit(function, **options)
        resolve = getattr(dispatcher, "get_call_template", None)  # None with NUMBA_DISABLE_JIT
        if resolve is not None:

            def without_constants(arguments: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
                plain = tuple(types.unliteral(argument) for argument in arguments)
                return resolve(plain, {name: types.unliteral(value) for name, value in keywords.items()})

            dispatcher.get_call_template = without_constants
        return dispatcher

    return decorate


kernel = compiling(**_UNCOUNTED)
inlined = compiling(**_UNCOUNTED, forceinline=True)
allocating = compiling(**_COUNTED)
summing = compiling(**_UNCOUNTED, fastmath={"reassoc"})  # terms of sums may be reordered, so vectorised
