"""Two surfaces side by side in one picture."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.errors import OptionError
from anisomesh.picture import draw
from anisomesh.picture.draw import Cells
from anisomesh.picture.renderer import require_renderer
from anisomesh.picture.view import View, closeup, whole_view
from anisomesh.surface.files import atomic_path
from anisomesh.surface.mesh import Surface

_WIDTH = 800
_HEIGHTS = (720, 430)


def side_by_side(
    reference: Surface,
    result: Surface,
    path: str | Path,
    *,
    values: npt.NDArray[Any] | None = None,
    value_name: str = "stretch",
    cells: Cells | None = None,
    titles: tuple[str, str, str] = ("input", "result", "Voronoi cells"),
) -> None:
    """Draw two surfaces from the same side, each with a close-up below it, into a PNG file.

    Parameters
    ----------
    reference
        Drawn on the left.
    result
        Drawn on the right. The close-up shows the visible place where its triangles are most stretched.
    path
        The file to write, in full or not at all.
    values
        One number per face of ``result``, for example :func:`~anisomesh.picture.triangle_stretch`; drawn in
        colour with a bar.
    value_name
        What the values are; written above the bar.
    cells
        Polygons for a third panel, such as the restricted Voronoi cells.
    titles
        Written above the panels.

    Raises
    ------
    AnisomeshError
        If pyvista is missing or nothing can be drawn on this machine.
    OptionError
        If ``values`` does not have one number per face of ``result``.
    """
    require_renderer()
    if values is not None and np.shape(values) != (result.n_faces,):
        raise OptionError(f"values has shape {np.shape(values)}; expected ({result.n_faces},), one per face of result")
    whole = whole_view(np.vstack([reference.points, result.points]), _WIDTH / _HEIGHTS[0])
    near = closeup(result, whole, _WIDTH / _HEIGHTS[1])
    shown: list[Surface | Cells] = [reference, result, *([] if cells is None else [cells])]
    plotter = _plotter(len(shown))
    try:
        for row, view in enumerate((whole, near)):
            for column, item in enumerate(shown):
                plotter.subplot(row, column)
                pixels = 0.5 * _HEIGHTS[row] / view.half_height
                if isinstance(item, Cells):
                    draw.draw_cells(plotter, item)
                elif column == 0 or values is None:
                    draw.draw_surface(plotter, item, pixels)
                else:
                    draw.draw_values(plotter, item, values, name=value_name, bar=row == 0, pixels=pixels)
                draw.look(plotter, view, reference.diagonal + result.diagonal)
        _annotate(plotter, [f"{title}: {_size(item)}" for title, item in zip(titles, shown, strict=False)], near, whole)
        image = io.BytesIO()
        plotter.screenshot(image)
    finally:
        plotter.close()
    with atomic_path(path) as temporary:
        Path(temporary).write_bytes(image.getvalue())


def _plotter(columns: int) -> Any:
    import pyvista
    from vtkmodules.vtkCommonCore import vtkLogger

    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    plotter: Any = pyvista.Plotter(
        off_screen=True,
        shape=(2, columns),
        row_weights=_HEIGHTS,
        border=False,
        lighting="none",
        window_size=[_WIDTH * columns, sum(_HEIGHTS)],
    )
    plotter.set_background("white", all_renderers=True)
    for renderer in plotter.renderers:
        renderer.add_light(pyvista.Light(light_type="headlight", intensity=0.6))
        renderer.add_light(pyvista.Light(light_type="camera light", position=(-1.0, 1.4, 1.0), intensity=0.55))
    plotter.enable_anti_aliasing("ssaa", all_renderers=True)
    return plotter


def _annotate(plotter: Any, titles: list[str], near: View, whole: View) -> None:
    for column, title in enumerate(titles):
        plotter.subplot(0, column)
        plotter.add_text(title, position="upper_edge", font_size=11, color=draw.INK)
        draw.draw_frame(plotter, near, _WIDTH / _HEIGHTS[1], 2 * whole.half_height)
        plotter.subplot(1, column)
        plotter.renderer.add_border(color=draw.ACCENT, width=2.0)


def _size(shown: Surface | Cells) -> str:
    if isinstance(shown, Surface):
        return f"{shown.n_points:,} vertices, {shown.n_faces:,} triangles"
    return f"{len(np.unique(shown.labels)):,}"
