"""Arguments and output that all figures share: file, resolution, camera, summary."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, get_args

import typer

from anisomesh.cli.job import check_output_path, check_picture_path, refuse_to_overwrite
from anisomesh.cli.log import log_warnings
from anisomesh.cli.report import counted, table

if TYPE_CHECKING:
    from anisomesh.mesh.surface import Surface
    from anisomesh.viz import PictureOptions

AxisName = Literal["x", "y", "z"]

Out = Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="Figure to write: .png or .pdf.")]
Scale = Annotated[int, typer.Option("--scale", min=1, max=4, help="Resolution: 1 for the screen, 2 to 4 for print.")]
Direction = Annotated[
    tuple[float, float, float] | None,
    typer.Option("--from", metavar="X Y Z", help="Direction to look from; by default obliquely at the broadest side."),
]
Up = Annotated[AxisName | None, typer.Option("--up", help="Axis that points up; by default z, or y in a view along z.")]


def check_figure_path(out: Path, *inputs: Path | None) -> None:
    """Check before any work that a figure can be drawn on this machine and written without replacing an input.

    Raises
    ------
    typer.BadParameter
        If the folder does not exist, the name is a folder's or an input's, or the suffix is wrong.
    AnisomeshError
        If nothing can be drawn on this machine.
    """
    check_output_path(out)
    refuse_to_overwrite(out, *inputs)
    check_picture_path(out, "-o")


def picture_options(direction: tuple[float, float, float] | None, up: AxisName | None, scale: int) -> PictureOptions:
    """Return the camera and the resolution for the arguments of a figure.

    Raises
    ------
    typer.BadParameter
        If the direction is zero, not finite, or parallel to the axis that points up.
    """
    from anisomesh.errors import OptionError
    from anisomesh.viz import PictureOptions

    try:
        return PictureOptions(direction=direction, up=None if up is None else get_args(AxisName).index(up), scale=scale)
    except OptionError as error:
        raise typer.BadParameter(f"--from: {error}") from None


def size(surface: Surface) -> str:
    """Return the numbers of vertices and triangles of a surface in words."""
    return f"{counted(surface.n_points, 'vertex', 'vertices')}, {counted(surface.n_faces, 'triangle')}"


def conclude(rows: Sequence[tuple[str, str]], out: Path, quiet: bool) -> None:
    """Print what was drawn and the file it was written to, only warnings if quiet."""
    if quiet:
        log_warnings(rows)
    else:
        typer.echo(table([*rows, ("wrote", str(out))]))
