"""``anisomesh figure result``: a result beside its input, and beside its Voronoi cells."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from anisomesh.cli.arguments import COMMON_REMESH_OPTIONS, Quiet, Ratio, Vertices, takes_remesh_options
from anisomesh.cli.figures.options import (
    Direction,
    Out,
    Scale,
    Up,
    check_figure_path,
    conclude,
    picture_options,
    size,
)
from anisomesh.cli.inputs import check_present
from anisomesh.cli.job import read, run_remesh
from anisomesh.cli.progress import Display, progress
from anisomesh.cli.spelling import warning_rows

if TYPE_CHECKING:
    from anisomesh.mesh.surface import Surface
    from anisomesh.viz import CellPolygons, Colouring


ColourName = Literal["none", "stretch", "quality", "distance"]


@takes_remesh_options(*COMMON_REMESH_OPTIONS)
def command(
    source: Annotated[Path, typer.Argument(metavar="INPUT", help="Input mesh: OBJ, OFF, PLY, STL, GLB, VTU, ...")],
    out: Out,
    remeshed: Annotated[
        Path | None, typer.Argument(metavar="RESULT", help="Remeshed mesh; if left out, INPUT is remeshed.")
    ] = None,
    colour: Annotated[
        ColourName,
        typer.Option(
            "--colour",
            "--color",
            help="Colour the result by stretch of the triangles, quality in the metric, or distance from the input.",
        ),
    ] = "none",
    cells: Annotated[bool, typer.Option("--cells", help="Draw the Voronoi cells too (not with RESULT).")] = False,
    n_vertices: Vertices = None,
    ratio: Ratio = None,
    direction: Direction = None,
    up: Up = None,
    scale: Scale = 2,
    quiet: Quiet = False,
    **options: Any,
) -> None:
    """Draw a result beside its input, with a close-up of the most stretched triangles.

    Give RESULT, or -n or --ratio to remesh INPUT now.
    """
    _check_choice(remeshed, cells, n_vertices, ratio)
    view = picture_options(direction, up, scale)
    check_figure_path(out, source, remeshed)
    check_present(source, remeshed)
    with progress(quiet) as display:
        if remeshed is None:
            options |= {"n_vertices": n_vertices, "ratio": ratio}
            before, after, polygons, warnings = _remesh_now(source, display, cells, **options)
        else:
            before, after, polygons, warnings = *_read_both(source, remeshed), None, []
        display.note(f"drawing {out}")
        colouring = _colouring(colour, after, before)
        from anisomesh.viz import side_by_side

        side_by_side(before, after, out, values=colouring, cells=polygons, options=view)
    rows = [("input", size(before)), ("result", size(after))]
    rows += [] if colouring is None else [("colour", colouring.name)]
    conclude([*rows, *warning_rows(warnings)], out, quiet)


def _check_choice(remeshed: Path | None, cells: bool, n_vertices: int | None, ratio: float | None) -> None:
    if remeshed is None:
        if (n_vertices is None) == (ratio is None):
            raise typer.BadParameter("give either RESULT, -n (number of vertices) or --ratio, and only one of them")
    elif n_vertices is not None or ratio is not None:
        raise typer.BadParameter("-n and --ratio remesh INPUT, but RESULT is given; leave out either")
    elif cells:
        raise typer.BadParameter("--cells needs a remesh, and RESULT has no cells; leave out RESULT or --cells")


def _remesh_now(
    source: Path, display: Display, cells: bool, **options: Any
) -> tuple[Surface, Surface, CellPolygons | None, list[str]]:
    """Remesh a file; return the repaired input, the result, its Voronoi cells on request, and the warnings."""
    from anisomesh.viz import voronoi_cells

    surface, seconds = read(source)
    result, facts = run_remesh(surface, display, name=str(source), load_seconds=seconds, **options)
    return result.prepared, result.surface, voronoi_cells(result.polygons()) if cells else None, facts["warnings"]


def _read_both(source: Path, remeshed: Path) -> tuple[Surface, Surface]:
    """Read input and result, and repair the input as a remesh does, so that it has a metric."""
    from anisomesh.repair.prepare import prepare

    before, after = read(source)[0], read(remeshed)[0]
    return prepare(before).surface, after


def _colouring(colour: ColourName, surface: Surface, reference: Surface) -> Colouring | None:
    from anisomesh.viz import distance_colouring, quality_colouring, stretch_colouring

    if colour == "stretch":
        return stretch_colouring(surface)
    if colour == "quality":
        return quality_colouring(surface, reference)
    return distance_colouring(surface, reference) if colour == "distance" else None
