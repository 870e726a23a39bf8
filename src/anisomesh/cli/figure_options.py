"""Arguments and output that all figures have: the file, its size in pixels, the camera, what is said at the end."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from anisomesh.cli.job import check_picture, check_place
from anisomesh.cli.report import counted, table

if TYPE_CHECKING:
    from anisomesh.mesh.surface import Surface


class Axis(StrEnum):
    """A coordinate axis."""

    x = "x"
    y = "y"
    z = "z"


Out = Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="Figure to write: .png or .pdf.")]
Scale = Annotated[int, typer.Option("--scale", min=1, max=4, help="Resolution: 1 for the screen, 2 to 4 for print.")]
Direction = Annotated[
    tuple[float, float, float] | None,
    typer.Option("--from", metavar="X Y Z", help="Look from this direction; else at the broad side, turned a little."),
]
Up = Annotated[Axis | None, typer.Option("--up", help="Axis that points up; else z, or y where z is looked along.")]


def check_file(out: Path) -> None:
    """Find out before any work that a figure cannot be drawn here or written there."""
    check_place(out)
    check_picture(out, "-o")


def camera(direction: tuple[float, float, float] | None, up: Axis | None) -> dict[str, Any]:
    """Return the keyword arguments of the pictures for these options.

    Raises
    ------
    typer.BadParameter
        If there is no such view.
    """
    number = None if up is None else list(Axis).index(up)
    if direction is not None:
        import numpy as np

        from anisomesh.errors import OptionError
        from anisomesh.viz.camera import camera_axes

        try:
            camera_axes(np.zeros((1, 3)), direction, number)
        except OptionError as error:
            raise typer.BadParameter(f"--from: {error}") from None
    return {"direction": direction, "up": number}


def size(surface: Surface) -> str:
    """Return the size of a surface in words."""
    return f"{counted(surface.n_points, 'vertex', 'vertices')}, {counted(surface.n_faces, 'triangle')}"


def conclude(rows: Sequence[tuple[str, str]], out: Path, quiet: bool) -> None:
    """Say what was drawn and where it is, unless quiet."""
    if not quiet:
        typer.echo(table([*rows, ("wrote", str(out))]))
