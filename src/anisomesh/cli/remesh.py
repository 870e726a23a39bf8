"""``anisomesh remesh``: one mesh file in, one anisotropic mesh file out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from anisomesh.cli.arguments import (
    REMESH_OPTIONS,
    Length,
    Quiet,
    Ratio,
    Source,
    Vertices,
    takes_remesh_options,
)
from anisomesh.cli.job import Outputs, read, run_remesh
from anisomesh.cli.progress import progress
from anisomesh.cli.report import as_json, summary


@takes_remesh_options(*REMESH_OPTIONS)
def command(
    source: Source,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="OUT", help="Mesh to write; the suffix is the format.")],
    n_vertices: Vertices = None,
    ratio: Ratio = None,
    max_error: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH",
            help="Use the fewest vertices within this distance of the input, in model units or % of the diagonal.",
        ),
    ] = None,
    edge_length: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH",
            help="Use as many vertices as edges of this length take, in model units or % of the diagonal; with metric "
            "curvature along the smaller curvature.",
        ),
    ] = None,
    features: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Creases to keep: a text file, two vertex numbers per line, from 0."),
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
    """Remesh IN with anisotropic triangles and write the result to OUT."""
    if (n_vertices, ratio, max_error, edge_length).count(None) != 3:
        raise typer.BadParameter("give one of -n (number of vertices), --ratio, --max-error and --edge-length")
    length = None if edge_length is None else Length.parse(edge_length, "--edge-length")
    error = None if max_error is None else Length.parse(max_error, "--max-error")
    outputs = Outputs(mesh=out, report=report, rvd=rvd, picture=picture)
    weights = options.get("weights")
    outputs.check(source, features, None if weights is None else Path(weights))
    with progress(quiet) as display:
        surface, seconds = read(source)
        if features is not None:
            from anisomesh.features.tagged import load_pairs

            options["features"] = load_pairs(features)
        options |= {"n_vertices": n_vertices, "ratio": ratio}
        options["max_error"] = None if error is None else error.on(surface)
        options["edge_length"] = None if length is None else length.on(surface)
        result, facts = run_remesh(surface, display, name=str(source), load_seconds=seconds, **options)
        facts["options"]["features"] = None if features is None else str(features)
        outputs.write(result, facts, display)
    if json_:
        typer.echo(as_json(facts))
    elif not quiet:
        typer.echo(summary(facts, outputs.paths, result.prepare_report.lines()))
