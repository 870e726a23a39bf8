"""``anisomesh figure result``: a result beside its input, and beside its Voronoi cells."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from anisomesh.cli.arguments import (
    FinalSharpness,
    Metric,
    MetricName,
    Quiet,
    Ratio,
    Seed,
    Sharpness,
    Threads,
    Vertices,
    remesh_options,
)
from anisomesh.cli.figure_options import Direction, Out, Scale, Up, camera, check_file, conclude, size
from anisomesh.cli.job import read, run_remesh
from anisomesh.cli.progress import Display, progress

if TYPE_CHECKING:
    from anisomesh.mesh.surface import Surface
    from anisomesh.viz import Cells, Colouring


class Colour(StrEnum):
    """What the colour of a triangle of the result says."""

    none = "none"
    stretch = "stretch"
    quality = "quality"
    distance = "distance"


def command(
    source: Annotated[Path, typer.Argument(metavar="INPUT", help="Mesh before: OBJ, OFF, PLY, STL, GLB, VTU, ...")],
    out: Out,
    remeshed: Annotated[
        Path | None, typer.Argument(metavar="RESULT", help="Mesh after; if left out, INPUT is remeshed.")
    ] = None,
    colour: Annotated[
        Colour,
        typer.Option("--colour", "--color", help="Colour of the result: its stretch, quality in the metric, distance."),
    ] = Colour.none,
    cells: Annotated[bool, typer.Option("--cells", help="Draw the Voronoi cells as well (without RESULT).")] = False,
    n_vertices: Vertices = None,
    ratio: Ratio = None,
    metric: MetricName = Metric.curvature,
    sharpness: Sharpness = 7.0,
    final_sharpness: FinalSharpness = None,
    seed: Seed = 0,
    threads: Threads = 2,
    direction: Direction = None,
    up: Up = None,
    scale: Scale = 2,
    quiet: Quiet = False,
) -> None:
    """Draw a result beside its input, with a close-up of the most stretched triangles.

    Give RESULT, or -n or --ratio to remesh INPUT now.
    """
    _check_choice(remeshed, cells, n_vertices, ratio)
    view = camera(direction, up)
    check_file(out)
    options = remesh_options(metric, sharpness, final_sharpness, seed, threads)
    with progress(quiet) as display:
        if remeshed is None:
            count = {"n_vertices": n_vertices, "ratio": ratio}
            before, after, polygons, warnings = _remesh_now(source, display, cells, **count, **options)
        else:
            before, after, polygons, warnings = *_read_both(source, remeshed), None, []
        display.note(f"drawing {out}")
        colouring = _colouring(colour, after, before)
        from anisomesh.viz import side_by_side

        side_by_side(before, after, out, values=colouring, cells=polygons, scale=scale, **view)
    rows = [("input", size(before)), ("result", size(after))]
    rows += [] if colouring is None else [("colour", colouring.name)]
    conclude([*rows, *(("warning", text) for text in warnings)], out, quiet)


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
) -> tuple[Surface, Surface, Cells | None, list[str]]:
    """Remesh a file; return input and result, the cells if they are wanted, and the warnings."""
    from anisomesh.viz import voronoi_cells

    surface, seconds = read(source)
    result, facts = run_remesh(surface, display, name=str(source), load_seconds=seconds, **options)
    return result.prepared, result.surface, voronoi_cells(result.polygons()) if cells else None, facts["warnings"]


def _read_both(source: Path, remeshed: Path) -> tuple[Surface, Surface]:
    """Read input and result; the input repaired as before a remesh, so that it has a metric."""
    from anisomesh.repair.prepare import prepare

    before, after = read(source)[0], read(remeshed)[0]
    return prepare(before).surface, after


def _colouring(colour: Colour, surface: Surface, reference: Surface) -> Colouring | None:
    from anisomesh.viz import distance_colouring, quality_colouring, stretch_colouring

    if colour is Colour.stretch:
        return stretch_colouring(surface)
    if colour is Colour.quality:
        return quality_colouring(surface, reference)
    return distance_colouring(surface, reference) if colour is Colour.distance else None
