"""``anisomesh remesh``: one mesh file in, one anisotropic mesh file out."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from anisomesh.cli.arguments import (
    FinalSharpness,
    Metric,
    MetricName,
    Quiet,
    Ratio,
    Seed,
    Sharpness,
    Source,
    Threads,
    Vertices,
    remesh_options,
)
from anisomesh.cli.job import Outputs, read, run_remesh
from anisomesh.cli.progress import progress
from anisomesh.cli.report import as_json, summary


class Embedding(StrEnum):
    """How the surface is embedded."""

    direct = "direct"


def command(
    source: Source,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="OUT", help="Mesh to write; the suffix is the format.")],
    n_vertices: Vertices = None,
    ratio: Ratio = None,
    metric: MetricName = Metric.curvature,
    sharpness: Sharpness = 7.0,
    final_sharpness: FinalSharpness = None,
    embedding: Annotated[Embedding, typer.Option(help="How the surface is embedded.")] = Embedding.direct,
    seed: Seed = 0,
    threads: Threads = 2,
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
) -> None:
    """Remesh IN with anisotropic triangles and write the result to OUT."""
    if (n_vertices is None) == (ratio is None):
        raise typer.BadParameter("give either -n (number of vertices) or --ratio, and not both")
    outputs = Outputs(mesh=out, report=report, rvd=rvd, picture=picture)
    outputs.check()
    options = remesh_options(metric, sharpness, final_sharpness, seed, threads) | {"embedding": embedding.value}
    with progress(quiet) as display:
        surface, seconds = read(source)
        result, facts = run_remesh(
            surface, display, name=str(source), load_seconds=seconds, n_vertices=n_vertices, ratio=ratio, **options
        )
        outputs.write(result, facts, display)
    if json_:
        typer.echo(as_json(facts))
    elif not quiet:
        typer.echo(summary(facts, outputs.paths, result.prepare_report.lines()))
