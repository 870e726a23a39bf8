"""Two surfaces side by side in one picture, each with a close-up."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.errors import OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.viz.camera import View, camera_axes, framed, height_for
from anisomesh.viz.cells import Cells
from anisomesh.viz.colouring import Colouring
from anisomesh.viz.draw import render
from anisomesh.viz.page import Box, Page, check_format
from anisomesh.viz.renderer import require_renderer
from anisomesh.viz.view import closeup

_COLUMN = 800
_TITLE = 48
_WHOLE = (360, 672)
_NEAR = 418
_GAP = 6
_BAR = 84


def side_by_side(
    reference: Surface,
    result: Surface,
    path: str | Path,
    *,
    values: npt.NDArray[Any] | Colouring | None = None,
    value_name: str = "stretch",
    cells: Cells | None = None,
    titles: tuple[str, str, str] = ("input", "result", "Voronoi cells"),
    direction: Sequence[float] | None = None,
    up: int | None = None,
    scale: int = 1,
) -> None:
    """Draw two surfaces from the same side, each with a close-up below it, into a PNG or PDF file.

    Parameters
    ----------
    reference
        Drawn on the left.
    result
        Drawn on the right. The close-up shows the visible place where its triangles are most stretched.
    path
        The file to write, in full or not at all; the suffix is the format.
    values
        One number per face of ``result``, for example :func:`~anisomesh.viz.triangle_stretch`, or a
        :class:`~anisomesh.viz.Colouring`; drawn in colour with a bar.
    value_name
        What the values are; written at the bar.
    cells
        Polygons for a third panel, such as the restricted Voronoi cells.
    titles
        Written above the panels.
    direction, up
        Where the viewer is, see :func:`~anisomesh.viz.camera.camera_axes`.
    scale
        Pixels per pixel of a picture of normal size (800 per column): more for print.

    Raises
    ------
    AnisomeshError
        If pyvista is missing or nothing can be drawn on this machine.
    OptionError
        If ``values`` does not have one number per face of ``result``, the suffix is another one, or there is no such
        view.
    """
    require_renderer()
    check_format(path)
    colouring = _checked(values, value_name, result)
    shown: list[Surface | Cells] = [reference, result, *([] if cells is None else [cells])]
    points = np.vstack([reference.points, result.points])
    axes = camera_axes(points, direction, up)
    width = _COLUMN - 2 * _GAP
    height = height_for(points, axes, width, _WHOLE)
    whole = framed(points, axes, width / height)
    near = closeup(result, whole, width / _NEAR)
    page = Page(_COLUMN * len(shown), _TITLE + height + _GAP + _NEAR + _GAP + (_BAR if colouring else 0), scale)
    for column, (title, item) in enumerate(zip(titles, shown, strict=False)):
        left = _COLUMN * column + _GAP
        upper: Box = (left, _TITLE, width, height)
        lower: Box = (left, _TITLE + height + _GAP, width, _NEAR)
        for view, box in ((whole, upper), (near, lower)):
            size = (int(box[2]) * scale, int(box[3]) * scale)
            colours = colouring if column == 1 else None
            page.picture(render(item, view, size, colouring=colours, scale=scale), box)
        page.text(f"{title}: {_size(item)}", left + 0.5 * width, 12, size=13.0, room=width)
        page.frame(_seen(near, whole, upper, lower))
        page.frame(lower)
    if colouring is not None:
        page.colour_bar(colouring, (_COLUMN + 0.2 * _COLUMN, page.height - _BAR + 8, 0.6 * _COLUMN, 14))
    page.save(path)


def _checked(values: npt.NDArray[Any] | Colouring | None, name: str, result: Surface) -> Colouring | None:
    if values is None:
        return None
    colouring = values if isinstance(values, Colouring) else Colouring(values=np.asarray(values), name=name)
    shape = np.shape(colouring.values)
    if shape != (result.n_faces,):
        raise OptionError(f"values has shape {shape}; expected ({result.n_faces},), one per face of result")
    return colouring


def _seen(near: View, whole: View, panel: Box, closeup_panel: Box) -> Box:
    """Return the box on a panel that the close-up shows."""
    left, top, width, height = panel
    pixels = 0.5 * height / whole.half_height
    right, up, _ = whole.project(near.centre)
    tall = 2.0 * near.half_height * pixels
    wide = tall * closeup_panel[2] / closeup_panel[3]
    return (left + 0.5 * width + pixels * right - 0.5 * wide, top + 0.5 * height - pixels * up - 0.5 * tall, wide, tall)


def _size(shown: Surface | Cells) -> str:
    if isinstance(shown, Surface):
        return f"{shown.n_points:,} vertices, {shown.n_faces:,} triangles"
    return f"{shown.n_cells:,}"
