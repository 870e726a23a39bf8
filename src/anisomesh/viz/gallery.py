"""Surfaces in a grid with captions; with one camera for all, a strip of one shape at several resolutions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from anisomesh.errors import OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.viz.camera import PictureOptions, framed, height_for
from anisomesh.viz.colouring import Colouring
from anisomesh.viz.draw import render
from anisomesh.viz.page import PALE, Page, check_format
from anisomesh.viz.renderer import require_renderer

# Pixels of a picture of normal size.
_GALLERY_COLUMN_WIDTH = 480
_GALLERY_GAP = 8
_GALLERY_PANEL_WIDTH = _GALLERY_COLUMN_WIDTH - 2 * _GALLERY_GAP
_GALLERY_PANEL_HEIGHTS = (240, 520)  # smallest and largest
_CAPTION_HEIGHT = 64
_COLOUR_BAR_SPACE = 88
_MAX_SINGLE_ROW = 4  # panels in one row by default


@dataclass(frozen=True, kw_only=True, eq=False)
class Panel:
    """A surface of a gallery, its name, a note below the name, and the colours of its faces (grey if None)."""

    surface: Surface
    name: str
    note: str
    colouring: Colouring | None = None


def gallery(
    panels: Sequence[Panel],
    path: str | Path,
    *,
    columns: int | None = None,
    same_view: bool = False,
    colour_bar: Colouring | None = None,
    options: PictureOptions | None = None,
) -> None:
    """Draw surfaces in a grid, row by row, into a PNG or PDF file.

    Parameters
    ----------
    panels
        The surfaces, at least one.
    path
        The file to write, in full or not at all; the suffix is the format.
    columns
        Surfaces per row; if None, up to four in one row, more in rows of three or four.
    same_view
        Use one camera for all surfaces, for versions of one shape; otherwise each surface fills its panel.
    colour_bar
        Colouring whose bar is drawn below the panels; give panels that it is for the same limits.
    options
        Camera and resolution; at scale 1 a column is 480 pixels wide.

    Raises
    ------
    AnisomeshError
        If pyvista is missing or nothing can be drawn on this machine.
    OptionError
        If there is no panel or the suffix is not supported.
    MeshFileError
        If the file cannot be written.
    """
    require_renderer()
    check_format(path)
    if not panels:
        raise OptionError("there is no surface to draw; expected at least one")
    options = options or PictureOptions()
    scale = options.scale
    rows = _rows(len(panels), columns)
    every = [panel.surface.points[np.unique(panel.surface.faces)] for panel in panels]
    seen = [np.vstack(every)] * len(panels) if same_view else every
    axes = [options.axes(points) for points in seen]
    heights = [
        max(height_for(seen[k], axes[k], _GALLERY_PANEL_WIDTH, _GALLERY_PANEL_HEIGHTS) for k in row) for row in rows
    ]
    width, bottom = _GALLERY_COLUMN_WIDTH * len(rows[0]), sum(heights) + len(rows) * (_GALLERY_GAP + _CAPTION_HEIGHT)
    page = Page(width, bottom + (0 if colour_bar is None else _COLOUR_BAR_SPACE), scale)
    if colour_bar is not None:
        page.colour_bar(colour_bar, (0.3 * width, bottom + 8, 0.4 * width, 14))
    top = 0
    for row, height in zip(rows, heights, strict=True):
        top += _GALLERY_GAP
        for column, k in enumerate(row):
            left = _GALLERY_COLUMN_WIDTH * column + _GALLERY_GAP
            view = framed(seen[k], axes[k], _GALLERY_PANEL_WIDTH / height)
            size = (_GALLERY_PANEL_WIDTH * scale, height * scale)
            pixels = render(panels[k].surface, view, size, colouring=panels[k].colouring, scale=scale)
            page.picture(pixels, (left, top, _GALLERY_PANEL_WIDTH, height))
            _caption(page, panels[k], left, top + height)
        top += height + _CAPTION_HEIGHT
    page.save(path)


def _rows(count: int, columns: int | None) -> list[range]:
    """Return the indices of the panels in each row; by default with few empty places in the last row."""
    if columns is None:
        columns = count if count <= _MAX_SINGLE_ROW else min((4, 3), key=lambda wide: -count % wide)
    return [range(first, min(first + columns, count)) for first in range(0, count, columns)]


def _caption(page: Page, panel: Panel, left: float, top: float) -> None:
    middle = left + 0.5 * _GALLERY_PANEL_WIDTH
    page.text(panel.name, middle, top + 4, size=12.0, room=_GALLERY_PANEL_WIDTH)
    page.text(panel.note, middle, top + 29, size=10.0, room=_GALLERY_PANEL_WIDTH, colour=PALE)
