"""Whether a run fits into the memory of this machine."""

from __future__ import annotations

import os

from anisomesh.errors import OptionError

BYTES_PER_VERTEX, BYTES_PER_FACE = 6_000, 1_500  # of memory; measured with benchmarks/speed.py


def check_memory(n: int, n_faces: int) -> None:
    """Refuse what cannot fit into the memory of this machine, before hours are spent on it.

    Parameters
    ----------
    n, n_faces
        Vertices asked for, and faces of the surface that is embedded.

    Raises
    ------
    OptionError
        If they do not fit.
    """
    try:
        there = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # not a system that tells
        return
    needed = BYTES_PER_VERTEX * n + BYTES_PER_FACE * n_faces
    if needed > there:
        sizes = f"about {needed / 2**30:,.0f} GiB of memory, and this machine has {there / 2**30:,.0f}"
        raise OptionError(f"{n:,} vertices need {sizes}; ask for fewer")
