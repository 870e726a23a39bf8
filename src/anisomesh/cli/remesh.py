"""``anisomesh remesh``: one mesh file in, one anisotropic mesh file out."""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from anisomesh.cli.job import Outputs, read, run_remesh
from anisomesh.cli.progress import progress
from anisomesh.cli.report import as_json, summary


class Metric(StrEnum):
    """What decides the shape of the triangles."""

    curvature = "curvature"
    approximation = "approximation"
    uniform = "uniform"


class Embedding(StrEnum):
    """How the surface is embedded."""

    direct = "direct"


def _positive(value: float | None) -> float | None:
    if value is not None and not (math.isfinite(value) and value > 0):
        raise typer.BadParameter(f"{value} is not a positive finite number")
    return value


def command(
    source: Annotated[Path, typer.Argument(metavar="IN", help="Mesh to remesh: OBJ, OFF, PLY, STL, GLB, VTU, ...")],
    out: Annotated[Path, typer.Option("--out", "-o", metavar="OUT", help="Mesh to write; the suffix is the format.")],
    n_vertices: Annotated[
        int | None, typer.Option("--vertices", "-n", min=4, help="Number of vertices of the result (this or --ratio).")
    ] = None,
    ratio: Annotated[
        float | None,
        typer.Option("--ratio", callback=_positive, help="Vertices of the result per vertex of the input."),
    ] = None,
    metric: Annotated[
        Metric, typer.Option(help="curvature: the paper's; approximation: least error; uniform: no stretch.")
    ] = Metric.curvature,
    sharpness: Annotated[
        float, typer.Option(callback=_positive, help="Pull towards creases: 1 none, 7 as in the paper.")
    ] = 7.0,
    final_sharpness: Annotated[
        float | None,
        typer.Option(callback=_positive, help="Raise the sharpness to this value late, for example 30."),
    ] = None,
    embedding: Annotated[Embedding, typer.Option(help="How the surface is embedded.")] = Embedding.direct,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random start; same seed, same result.")] = 0,
    threads: Annotated[int, typer.Option(min=1, help="Worker threads; the result does not depend on it.")] = 2,
    report: Annotated[Path | None, typer.Option(metavar="JSON", help="Write the report to this file.")] = None,
    rvd: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the Voronoi cells on the surface: .vtu or .obj.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="PNG", help="Draw input and result side by side (extra: picture).")
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="Print the report as JSON and nothing else.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress and no summary.")] = False,
) -> None:
    """Remesh IN with anisotropic triangles and write the result to OUT."""
    if (n_vertices is None) == (ratio is None):
        raise typer.BadParameter("give either -n (number of vertices) or --ratio, and not both")
    outputs = Outputs(mesh=out, report=report, rvd=rvd, picture=picture)
    outputs.check()
    options: dict[str, Any] = {
        "metric": metric.value,
        "sharpness": sharpness,
        "final_sharpness": final_sharpness,
        "embedding": embedding.value,
        "seed": seed,
        "threads": threads,
    }
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
