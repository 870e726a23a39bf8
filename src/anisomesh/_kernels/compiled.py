"""How kernels are compiled: machine code cached on disk, without the GIL, without counting references.

Numba counts references to arrays wherever they are passed on, in atomic operations that its own pass does not remove
from functions as large as the clipping; without them that takes two thirds of the time. A kernel without them can
allocate nothing: its arrays all belong to the caller.
"""

from typing import Any

from numba import njit

_OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
_COUNTED: dict[str, Any] = {**_OPTIONS, "_nrt": True}
_UNCOUNTED: dict[str, Any] = {**_OPTIONS, "_nrt": False}

kernel = njit(**_UNCOUNTED)
inlined = njit(**_UNCOUNTED, forceinline=True)
allocating = njit(**_COUNTED)
summing = njit(**_UNCOUNTED, fastmath={"reassoc"})  # in any order, so several terms at once
