"""Many surfaces in a grid, with captions; with the same camera, a strip of one shape at several resolutions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from anisomesh.errors import OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.viz.camera import camera_axes, framed, height_for
from anisomesh.viz.draw import render
from anisomesh.viz.page import PALE, Page, check_format
from anisomesh.viz.renderer import require_renderer

_COLUMN = 480
_GAP = 8
_WIDTH = _COLUMN - 2 * _GAP
_HEIGHTS = (240, 520)
_LINES = 64
_FULL_ROW = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Panel:
    """One surface of a gallery, its name, and what is written below that."""

    surface: Surface
    name: str
    note: str


def gallery(
    panels: Sequence[Panel],
    path: str | Path,
    *,
    columns: int | None = None,
    same_view: bool = False,
    direction: Sequence[float] | None = None,
    up: int | None = None,
    scale: int = 1,
) -> None:
    """Draw surfaces in a grid, row by row, into a PNG or PDF file.

    Parameters
    ----------
    panels
        What to draw, at least one.
    path
        The file to write, in full or not at all; the suffix is the format.
    columns
        Surfaces per row; if None, all of up to four, else three or four.
    same_view
        The same camera for all, as for one shape; otherwise each fills its panel.
    direction, up
        Where the viewer is, see :func:`~anisomesh.viz.camera.camera_axes`.
    scale
        Pixels per pixel of a picture of normal size (480 per column): more for print.

    Raises
    ------
    AnisomeshError
        If pyvista is missing or nothing can be drawn on this machine.
    OptionError
        If there is nothing to draw, the suffix is another one, or there is no such view.
    """
    require_renderer()
    check_format(path)
    if not panels:
        raise OptionError("there is no surface to draw; expected at least one")
    rows = _rows(len(panels), columns)
    every = [panel.surface.points[np.unique(panel.surface.faces)] for panel in panels]
    seen = [np.vstack(every)] * len(panels) if same_view else every
    axes = [camera_axes(points, direction, up) for points in seen]
    heights = [max(height_for(seen[k], axes[k], _WIDTH, _HEIGHTS) for k in row) for row in rows]
    page = Page(_COLUMN * len(rows[0]), sum(heights) + len(rows) * (_GAP + _LINES), scale)
    top = 0
    for row, height in zip(rows, heights, strict=True):
        top += _GAP
        for column, k in enumerate(row):
            left = _COLUMN * column + _GAP
            view = framed(seen[k], axes[k], _WIDTH / height)
            pixels = render(panels[k].surface, view, (_WIDTH * scale, height * scale), scale=scale)
            page.picture(pixels, (left, top, _WIDTH, height))
            _caption(page, panels[k], left, top + height)
        top += height + _LINES
    page.save(path)


def _rows(count: int, columns: int | None) -> list[range]:
    """Return the numbers of the panels in each row; without a number of columns, with few empty places."""
    if columns is None:
        columns = count if count <= _FULL_ROW else min((4, 3), key=lambda wide: -count % wide)
    return [range(first, min(first + columns, count)) for first in range(0, count, columns)]


def _caption(page: Page, panel: Panel, left: float, top: float) -> None:
    middle = left + 0.5 * _WIDTH
    page.text(panel.name, middle, top + 4, size=12.0, room=_WIDTH)
    page.text(panel.note, middle, top + 29, size=10.0, room=_WIDTH, colour=PALE)
