"""A page of panels with captions, frames and colour bars, written as PNG or PDF."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

from anisomesh.errors import OptionError
from anisomesh.io.atomic import atomic_path
from anisomesh.viz.colouring import Colouring
from anisomesh.viz.draw import INK, Pixels

PICTURE_FORMATS = (".png", ".pdf")
ACCENT, PALE = "#c8321e", "#5b626e"
_PIXELS_PER_INCH = 128  # a power of two, so that sizes in inches are exact and panels keep their pixels
_MIN_TEXT_LENGTH = 8  # characters that a shortened line keeps; heuristic

Box = tuple[float, float, float, float]


def check_format(path: str | Path) -> None:
    """Check that the suffix of a file name is one of :data:`PICTURE_FORMATS`.

    Raises
    ------
    OptionError
        If the suffix is not supported.
    """
    if Path(path).suffix.lower() not in PICTURE_FORMATS:
        raise OptionError(f"{path}: expected a file name ending in {' or '.join(PICTURE_FORMATS)}")


class Page:
    """A white page; positions are in pixels of normal size from its upper left corner.

    Parameters
    ----------
    width, height
        Size in pixels of normal size.
    scale
        Pixels per pixel of normal size, along both sides.
    """

    def __init__(self, width: int, height: int, scale: int = 1) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.width, self.height, self.scale = width, height, scale
        size = (width / _PIXELS_PER_INCH, height / _PIXELS_PER_INCH)
        self._figure: Any = Figure(figsize=size, dpi=_PIXELS_PER_INCH * scale, facecolor="white")
        FigureCanvasAgg(self._figure)

    def picture(self, pixels: Pixels, box: Box) -> None:
        """Draw a panel in a box: left, top, width, height."""
        axes = self._axes(box)
        axes.set_axis_off()
        axes.imshow(pixels, interpolation="none", aspect="auto")

    def frame(self, box: Box) -> None:
        """Draw a frame around a box."""
        from matplotlib.patches import Rectangle

        left, top, width, height = box
        corner = (left / self.width, 1.0 - (top + height) / self.height)
        patch = Rectangle(corner, width / self.width, height / self.height, fill=False, edgecolor=ACCENT, linewidth=1.1)
        patch.set_transform(self._figure.transFigure)
        patch.set_zorder(10.0)
        self._figure.add_artist(patch)

    def text(self, text: str, middle: float, top: float, *, size: float, room: float, colour: str = INK) -> None:
        """Write one line centred below a position, shortened in the middle if it is wider than ``room``."""
        place = (middle / self.width, 1.0 - top / self.height)
        style = {"fontsize": size, "color": colour, "ha": "center", "va": "top", "parse_math": False}
        item = self._figure.text(*place, text, **style)
        kept = len(text)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a character that the font lacks is drawn as a box
            while kept > _MIN_TEXT_LENGTH and item.get_window_extent().width > room * self.scale:
                kept -= 1
                item.set_text(f"{text[: (kept + 1) // 2]}…{text[len(text) - kept // 2 :]}")

    def colour_bar(self, colouring: Colouring, box: Box) -> None:
        """Draw a horizontal colour bar in a box, with numbers and the name of the values below it."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        below, above = colouring.beyond
        bar = self._figure.colorbar(
            ScalarMappable(Normalize(*colouring.limits), colouring.colour_map()),
            cax=self._axes(box),
            orientation="horizontal",
            extend={(False, False): "neither", (True, False): "min", (False, True): "max"}.get((below, above), "both"),
        )
        bar.outline.set_linewidth(0.5)
        bar.ax.tick_params(labelsize=9.0, labelcolor=INK, width=0.5, length=3.0)
        bar.set_label(colouring.name, fontsize=10.0, color=INK)

    def save(self, path: str | Path) -> None:
        """Write the page, in full or not at all; the same page gives the same bytes.

        Raises
        ------
        OptionError
            If the suffix is not one of :data:`PICTURE_FORMATS`.
        MeshFileError
            If the file cannot be written.
        """
        import matplotlib

        check_format(path)
        kind = Path(path).suffix.lower()[1:]
        undated: dict[str, None] = {"Software": None} if kind == "png" else {"CreationDate": None}
        with atomic_path(path) as temporary, matplotlib.rc_context({"pdf.fonttype": 42}), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._figure.savefig(temporary, format=kind, dpi=_PIXELS_PER_INCH * self.scale, metadata=undated)

    def _axes(self, box: Box) -> Any:
        left, top, width, height = box
        return self._figure.add_axes(
            (left / self.width, 1.0 - (top + height) / self.height, width / self.width, height / self.height)
        )
