"""Whether the kernels still have to be compiled."""

from __future__ import annotations

from pathlib import Path

from anisomesh._kernels import diagram, integrate, neighbours

_ENTRY_POINTS = (
    integrate.integrate_chunk,
    integrate.gather,
    diagram.count_chunk,
    diagram.write_chunk,
    neighbours.refresh_lists,
    neighbours.age_lists,
    neighbours.displacements,
    neighbours.limit_radius,
    neighbours.walk,
)


def kernels_cached() -> bool:
    """Return whether compiled code of every kernel, newer than its source, is on disk or none is needed."""
    if not hasattr(integrate.gather, "py_func"):  # compilation is switched off
        return True
    newest = max(path.stat().st_mtime for path in Path(__file__).parent.glob("*.py"))
    for kernel in _ENTRY_POINTS:
        function = kernel.py_func
        pattern = f"{function.__module__.rsplit('.', 1)[-1]}.{function.__qualname__}-*.nbi"
        indices = list(Path(kernel.stats.cache_path or "").glob(pattern))
        if not any(index.stat().st_mtime >= newest for index in indices):
            return False
    return True
