"""``anisomesh demo``: remesh a procedural shape, so that nothing has to be downloaded."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from anisomesh.cli.job import Outputs, run_remesh
from anisomesh.cli.progress import progress
from anisomesh.cli.report import summary
from anisomesh.errors import AnisomeshError
from anisomesh.options import MAX_THREADS

DEMO_SAMPLE = "knot"  # strongly stretched triangles, no flat part
DEMO_VERTICES = 800


def command(
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="DIR", help="Folder for the results; created if it does not exist.")
    ] = Path("anisomesh-demo"),
    n_vertices: Annotated[
        int, typer.Option("--vertices", "-n", min=4, help="Number of vertices of the result.")
    ] = DEMO_VERTICES,
    threads: Annotated[int, typer.Option(min=1, max=MAX_THREADS, help="Worker threads.")] = 2,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress and no summary.")] = False,
) -> None:
    """Remesh a knotted tube: writes the input, the result, a report and a picture coloured by stretch."""
    from anisomesh.io.meshes import save
    from anisomesh.shapes.analytic import sample
    from anisomesh.viz import require_renderer, side_by_side, stretch_colouring

    if out.exists() and not out.is_dir():
        raise typer.BadParameter(f"{out} is a file; give the name of a folder")
    out.mkdir(parents=True, exist_ok=True)
    picture: Path | None = out / "side_by_side.png"
    try:
        require_renderer()
    except AnisomeshError as error:
        picture = None
        typer.echo(f"anisomesh: no picture: {error}", err=True)
    outputs = Outputs(mesh=out / "remeshed.ply", report=out / "report.json")
    outputs.check()
    surface = sample(DEMO_SAMPLE)
    save(surface, out / "input.ply")
    with progress(quiet) as display:
        result, facts = run_remesh(
            surface,
            display,
            name=f"sample {DEMO_SAMPLE!r}",
            load_seconds=0.0,
            n_vertices=n_vertices,
            threads=threads,
        )
        outputs.write(result, facts, display)
        if picture is not None:
            side_by_side(surface, result.surface, picture, values=stretch_colouring(result.surface))
    if not quiet:
        paths = [out / "input.ply", *outputs.paths, *([] if picture is None else [picture])]
        typer.echo(f"sample {DEMO_SAMPLE!r}: {surface.n_points:,} vertices, {surface.n_faces:,} faces")
        typer.echo(summary(facts, paths, result.prepare_report.lines()))
