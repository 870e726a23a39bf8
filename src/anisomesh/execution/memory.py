"""Check that a run fits into the memory of this machine."""

from __future__ import annotations

import math
import os

from anisomesh.errors import OptionError

_BYTES_PER_VERTEX = 6_000  # peak memory per vertex of the result; measured with benchmarks/speed.py
_BYTES_PER_FACE = 1_500  # peak memory per face of the working surface; measured with benchmarks/speed.py


def most_vertices() -> float:
    """Return the number of vertices of a result above which no remesh fits into the memory of this machine."""
    return _physical() / _BYTES_PER_VERTEX


def _physical() -> float:
    """Return the physical memory in bytes, infinite if it is unknown on this system."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return math.inf


def check_memory(n_vertices: int, n_faces: int) -> None:
    """Check that a remesh fits into the physical memory of this machine.

    Parameters
    ----------
    n_vertices, n_faces
        Vertices of the result, and faces of the working surface that is embedded.

    Raises
    ------
    OptionError
        If the estimated memory exceeds the physical memory.
    """
    physical, needed = _physical(), _BYTES_PER_VERTEX * n_vertices + _BYTES_PER_FACE * n_faces
    if needed > physical:
        sizes = f"about {needed / 2**30:,.0f} GiB of memory, and this machine has {physical / 2**30:,.0f}"
        raise OptionError(f"{n_vertices:,} vertices need {sizes}; ask for fewer")
