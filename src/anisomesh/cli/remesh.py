"""``anisomesh remesh``: one mesh file in, one anisotropic mesh file out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from anisomesh.cli.arguments import (
    REMESH_OPTIONS,
    InputFormat,
    Length,
    Quiet,
    Ratio,
    Source,
    Vertices,
    takes_remesh_options,
)
from anisomesh.cli.job import STANDARD_STREAM, Outputs, check_input_format, read_mesh, run_remesh
from anisomesh.cli.progress import progress
from anisomesh.cli.report import as_json, hints, summary


@takes_remesh_options(*REMESH_OPTIONS)
def command(
    source: Source,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="OUT", help="Mesh to write; the suffix is the format.")],
    input_format: InputFormat = None,
    output_format: Annotated[
        str | None, typer.Option(metavar="FORMAT", help="Format of OUT, if its suffix does not name it.")
    ] = None,
    n_vertices: Vertices = None,
    ratio: Ratio = None,
    max_error: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH",
            help="Use the fewest vertices within this distance of the input, in model units or % of the diagonal.",
        ),
    ] = None,
    features: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Creases to keep: a text file, two vertex numbers per line, from 0."),
    ] = None,
    weld: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH",
            help="Join points of the input up to this distance, in model units or % of the diagonal; auto: 0.001%.",
        ),
    ] = None,
    report: Annotated[Path | None, typer.Option(metavar="JSON", help="Write the report to this file.")] = None,
    rvd: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the Voronoi cells on the surface: .vtu or .obj.")
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw input and result side by side: .png or .pdf (extra: picture)."),
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="Print the report as JSON and nothing else.")] = False,
    quiet: Quiet = False,
    **options: Any,
) -> None:
    """Remesh IN with anisotropic triangles and write the result to OUT; - is standard input or output."""
    if (n_vertices, ratio, max_error).count(None) != 2:
        raise typer.BadParameter("give one of -n (number of vertices), --ratio and --max-error")
    error = None if max_error is None else Length.parse(max_error, "--max-error")
    gap = None if weld in (None, "auto") else Length.parse(weld, "--weld")
    outputs = Outputs(mesh=out, mesh_format=output_format, report=report, rvd=rvd, picture=picture)
    to_stdout = out == STANDARD_STREAM
    if to_stdout and json_:
        raise typer.BadParameter("-o - and --json both write to standard output; use --report FILE")
    weights = options.get("weights")
    check_input_format(source, input_format)
    outputs.check(None if source == STANDARD_STREAM else source, features, None if weights is None else Path(weights))
    with progress(quiet) as display:
        mesh, seconds = read_mesh(source, input_format)
        if features is not None:
            from anisomesh.features.tagged import load_pairs

            options["features"] = load_pairs(features)
        options |= {"n_vertices": n_vertices, "ratio": ratio}
        options["max_error"] = None if error is None else error.on(mesh.surface)
        if weld is not None:
            options["weld_tolerance"] = "auto" if gap is None else gap.on(mesh.surface)
        result, facts = run_remesh(mesh, display, name=str(source), load_seconds=seconds, **options)
        facts["hints"] = hints(result.prepared)
        facts["options"]["features"] = None if features is None else str(features)
        outputs.write(result, facts, display)
    if json_:
        typer.echo(as_json(facts))
    elif not quiet:
        typer.echo(summary(facts, outputs.paths, result.prepare_report.lines()), err=to_stdout)
