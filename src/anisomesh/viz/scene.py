"""Two surfaces side by side in one picture, each with a close-up."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from anisomesh.errors import OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.viz.camera import PictureOptions, View, framed, height_for
from anisomesh.viz.cells import CellPolygons
from anisomesh.viz.colouring import Colouring
from anisomesh.viz.draw import render
from anisomesh.viz.page import Box, Page, check_format
from anisomesh.viz.renderer import require_renderer
from anisomesh.viz.view import closeup

# Pixels of a picture of normal size.
_SCENE_COLUMN_WIDTH = 800
_SCENE_GAP = 6
_SCENE_PANEL_WIDTH = _SCENE_COLUMN_WIDTH - 2 * _SCENE_GAP
_WHOLE_HEIGHTS = (360, 672)  # smallest and largest
_CLOSEUP_HEIGHT = 418
_TITLE_HEIGHT = 48
_COLOUR_BAR_HEIGHT = 84


class _Column(NamedTuple):
    """The boxes of a column on the page: the whole view and the close-up below it."""

    whole: Box
    near: Box


def side_by_side(
    reference: Surface,
    result: Surface,
    path: str | Path,
    *,
    values: npt.NDArray[Any] | Colouring | None = None,
    cells: CellPolygons | None = None,
    titles: tuple[str, str, str] = ("input", "result", "Voronoi cells"),
    options: PictureOptions | None = None,
) -> None:
    """Draw two surfaces with the same camera, each with a close-up below it, into a PNG or PDF file.

    Parameters
    ----------
    reference
        Drawn on the left.
    result
        Drawn on the right. The close-ups show the visible place where its triangles are most stretched.
    path
        The file to write, in full or not at all; the suffix is the format.
    values
        Colours of ``result``: a :class:`~anisomesh.viz.Colouring`, or one number per face (F,).
    cells
        Polygons for a third panel, see :func:`~anisomesh.viz.voronoi_cells`.
    titles
        Written above the panels, before the numbers of vertices and triangles.
    options
        Camera and resolution; at scale 1 a column is 800 pixels wide.

    Raises
    ------
    AnisomeshError
        If pyvista is missing or nothing can be drawn on this machine.
    OptionError
        If ``values`` does not have one number per face of ``result``, or the suffix is not supported.
    MeshFileError
        If the file cannot be written.
    """
    require_renderer()
    check_format(path)
    colouring = _as_colouring(values, result)
    options = options or PictureOptions()
    points = np.vstack([reference.points, result.points])
    axes = options.axes(points)
    height = height_for(points, axes, _SCENE_PANEL_WIDTH, _WHOLE_HEIGHTS)
    whole = framed(points, axes, _SCENE_PANEL_WIDTH / height)
    near = closeup(result, whole, _SCENE_PANEL_WIDTH / _CLOSEUP_HEIGHT)
    shown: list[Surface | CellPolygons] = [reference, result, *([] if cells is None else [cells])]
    page = Page(_SCENE_COLUMN_WIDTH * len(shown), _page_height(height, colouring), options.scale)
    for number, (title, item) in enumerate(zip(titles, shown, strict=False)):
        column = _column(number, height)
        for view, box in ((whole, column.whole), (near, column.near)):
            size = (int(box[2]) * options.scale, int(box[3]) * options.scale)
            colours = colouring if number == 1 else None
            page.picture(render(item, view, size, colouring=colours, scale=options.scale), box)
        middle = column.whole[0] + 0.5 * _SCENE_PANEL_WIDTH
        page.text(f"{title}: {_size(item)}", middle, 12, size=13.0, room=_SCENE_PANEL_WIDTH)
        page.frame(_closeup_box(near, whole, column))
        page.frame(column.near)
    if colouring is not None:
        page.colour_bar(colouring, (1.2 * _SCENE_COLUMN_WIDTH, page.height - 76, 0.6 * _SCENE_COLUMN_WIDTH, 14))
    page.save(path)


def _as_colouring(values: npt.NDArray[Any] | Colouring | None, result: Surface) -> Colouring | None:
    if values is None:
        return None
    colouring = values if isinstance(values, Colouring) else Colouring(values=np.asarray(values), name="value")
    shape = np.shape(colouring.values)
    if shape != (result.n_faces,):
        raise OptionError(f"values has shape {shape}; expected ({result.n_faces},), one per face of result")
    return colouring


def _page_height(whole_height: int, colouring: Colouring | None) -> int:
    bar = 0 if colouring is None else _COLOUR_BAR_HEIGHT
    return _TITLE_HEIGHT + whole_height + _SCENE_GAP + _CLOSEUP_HEIGHT + _SCENE_GAP + bar


def _column(number: int, whole_height: int) -> _Column:
    left = _SCENE_COLUMN_WIDTH * number + _SCENE_GAP
    return _Column(
        whole=(left, _TITLE_HEIGHT, _SCENE_PANEL_WIDTH, whole_height),
        near=(left, _TITLE_HEIGHT + whole_height + _SCENE_GAP, _SCENE_PANEL_WIDTH, _CLOSEUP_HEIGHT),
    )


def _closeup_box(near: View, whole: View, column: _Column) -> Box:
    """Return the part of the whole view that the close-up shows, as a box on the page."""
    left, top, width, height = column.whole
    pixels = 0.5 * height / whole.half_height
    right, up, _ = whole.project(near.centre)
    tall = 2.0 * near.half_height * pixels
    wide = tall * column.near[2] / column.near[3]
    return (left + 0.5 * width + pixels * right - 0.5 * wide, top + 0.5 * height - pixels * up - 0.5 * tall, wide, tall)


def _size(shown: Surface | CellPolygons) -> str:
    if isinstance(shown, Surface):
        return f"{shown.n_points:,} vertices, {shown.n_faces:,} triangles"
    return f"{shown.n_cells:,}"
