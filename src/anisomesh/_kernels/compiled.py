"""Compilation of kernels: machine code cached on disk, without the GIL, without reference counts.

Numba counts references to arrays at every call, in atomic operations that its optimiser does not remove from functions
as large as the clipping; they take two thirds of the time. A kernel without reference counts cannot allocate: all its
arrays belong to the caller.
"""

from typing import Any

from numba import njit

_OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
_COUNTED: dict[str, Any] = {**_OPTIONS, "_nrt": True}
_UNCOUNTED: dict[str, Any] = {**_OPTIONS, "_nrt": False}

kernel = njit(**_UNCOUNTED)
inlined = njit(**_UNCOUNTED, forceinline=True)
allocating = njit(**_COUNTED)
summing = njit(**_UNCOUNTED, fastmath={"reassoc"})  # terms of sums may be reordered, so vectorised
