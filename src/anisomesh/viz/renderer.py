"""Check that pictures can be drawn on this machine."""

from __future__ import annotations

import functools
import importlib.util
import subprocess
import sys

from anisomesh.errors import AnisomeshError

_PROBE = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.AddRenderer(vtkRenderer())
window.Render()
"""


def require_renderer() -> None:
    """Check that a picture can be drawn on this machine, with or without a display.

    Raises
    ------
    AnisomeshError
        If pyvista or matplotlib is not installed, or if neither a display, EGL nor OSMesa can be used.

    Notes
    -----
    VTK ends the process if no OpenGL library works, so the check draws an empty window in another process. It takes
    about half a second, once per process.
    """
    for name in ("pyvista", "matplotlib"):
        if importlib.util.find_spec(name) is None:
            raise AnisomeshError(f'pictures need {name}, which is not installed; run: pip install "anisomesh[picture]"')
    if not _can_render():
        raise AnisomeshError(
            "pictures need OpenGL and VTK found none that works here; install EGL (Debian: libegl1) "
            "or OSMesa (Debian: libosmesa6), or leave the picture out"
        )


@functools.cache
def _can_render() -> bool:
    probe = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, check=False)
    return probe.returncode == 0
