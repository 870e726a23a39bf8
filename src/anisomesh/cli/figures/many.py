"""``anisomesh figure gallery`` and ``strip``: many meshes in a grid, one mesh at several resolutions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from anisomesh.cli.arguments import COMMON_REMESH_OPTIONS, Quiet, Source, takes_remesh_options
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
from anisomesh.cli.progress import progress
from anisomesh.cli.ratios import shares
from anisomesh.cli.report import counted
from anisomesh.cli.spelling import warning_rows

if TYPE_CHECKING:
    from anisomesh.mesh.surface import Surface

DEFAULT_STRIP_RATIOS = "1 0.6 0.2 0.1"  # some of the ratios in the paper's Table 1


def gallery(
    sources: Annotated[list[Path], typer.Argument(metavar="MESH...", help="Meshes to draw, row by row.")],
    out: Out,
    columns: Annotated[int | None, typer.Option(min=1, help="Meshes per row.")] = None,
    same_view: Annotated[
        bool, typer.Option("--same-view", help="Use one camera for all meshes, for versions of one shape.")
    ] = False,
    direction: Direction = None,
    up: Up = None,
    scale: Scale = 2,
    quiet: Quiet = False,
) -> None:
    """Draw many meshes in a grid, with their names and numbers of vertices."""
    from anisomesh.viz import Panel
    from anisomesh.viz import gallery as draw

    view = picture_options(direction, up, scale)
    check_figure_path(out, *sources)
    check_present(*sources)
    with progress(quiet) as display:
        surfaces = [read(source)[0] for source in sources]
        panels = [
            Panel(surface=surface, name=source.stem, note=_vertices(surface))
            for source, surface in zip(sources, surfaces, strict=True)
        ]
        display.note(f"drawing {out}")
        draw(panels, out, columns=columns, same_view=same_view, options=view)
    conclude([(panel.name, size(panel.surface)) for panel in panels], out, quiet)


@takes_remesh_options(*COMMON_REMESH_OPTIONS)
def strip(
    source: Source,
    out: Out,
    ratios: Annotated[
        str, typer.Option("--ratios", metavar="R [R ...]", help="Vertices of each result per vertex of the input.")
    ] = DEFAULT_STRIP_RATIOS,
    direction: Direction = None,
    up: Up = None,
    scale: Scale = 2,
    quiet: Quiet = False,
    **options: Any,
) -> None:
    """Remesh IN at several numbers of vertices and draw the results in a row, seen from the same side."""
    from anisomesh.viz import Panel
    from anisomesh.viz import gallery as draw

    wanted = shares(ratios)
    view = picture_options(direction, up, scale)
    check_figure_path(out, source)
    panels, rows = [], []
    with progress(quiet) as display:
        surface, seconds = read(source)
        for ratio in wanted:
            display.note(f"remeshing at {100 * ratio:g} % of the vertices")
            result, facts = run_remesh(surface, display, name=str(source), load_seconds=seconds, ratio=ratio, **options)
            panels.append(Panel(surface=result.surface, name=f"{100 * ratio:g} %", note=_vertices(result.surface)))
            rows.append((panels[-1].name, size(result.surface)))
            rows += warning_rows(facts["warnings"])
        display.note(f"drawing {out}")
        draw(panels, out, columns=len(panels), same_view=True, options=view)
    conclude(rows, out, quiet)


def _vertices(surface: Surface) -> str:
    return counted(surface.n_points, "vertex", "vertices")
