"""``anisomesh remesh``: one mesh file in, one anisotropic mesh file out."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from anisomesh.cli.arguments import (
    FinalSharpness,
    Length,
    Metric,
    MetricName,
    Quiet,
    Ratio,
    Seed,
    Sharpness,
    Source,
    Threads,
    Vertices,
    positive,
    remesh_options,
)
from anisomesh.cli.job import Outputs, read, run_remesh
from anisomesh.cli.progress import progress
from anisomesh.cli.report import as_json, summary


class Embedding(StrEnum):
    """How the surface is embedded."""

    auto = "auto"
    direct = "direct"
    neural = "neural"
    hybrid = "hybrid"


class Device(StrEnum):
    """Where a network runs."""

    cpu = "cpu"
    cuda = "cuda"


def command(
    source: Source,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="OUT", help="Mesh to write; the suffix is the format.")],
    n_vertices: Vertices = None,
    ratio: Ratio = None,
    max_error: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH",
            help="Instead of a number: fewest vertices within this distance, in model units or % of the diagonal.",
        ),
    ] = None,
    metric: MetricName = Metric.curvature,
    sharpness: Sharpness = 7.0,
    final_sharpness: FinalSharpness = None,
    feature_angle: Annotated[
        float, typer.Option(min=0.0, max=180.0, help="Edges that bend by more degrees are creases; 180 for none.")
    ] = 40.0,
    features: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Edges to keep: a text file, two vertex numbers a line, the first is 0."),
    ] = None,
    embedding: Annotated[
        Embedding,
        typer.Option(
            help="direct: measured curvature; neural: a network; hybrid: both; auto: hybrid where torch is installed "
            "and the metric is curvature."
        ),
    ] = Embedding.auto,
    weights: Annotated[
        str | None,
        typer.Option(
            metavar="FILE", help="Weights to use: a file of anisomesh train, or the name of a network of the package."
        ),
    ] = None,
    device: Annotated[Device, typer.Option(help="Where the network runs.")] = Device.cpu,
    denoise: Annotated[
        bool, typer.Option("--denoise/--keep-noise", help="Whether the noise that the network finds is taken away.")
    ] = True,
    seed: Seed = 0,
    threads: Threads = 2,
    time_limit: Annotated[
        float | None, typer.Option(callback=positive, help="Seconds after which the work ends with what it has.")
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
) -> None:
    """Remesh IN with anisotropic triangles and write the result to OUT."""
    if (n_vertices, ratio, max_error).count(None) != 2:
        raise typer.BadParameter("give one of -n (number of vertices), --ratio and --max-error")
    error = None if max_error is None else Length.parse(max_error, "--max-error")
    outputs = Outputs(mesh=out, report=report, rvd=rvd, picture=picture)
    outputs.check()
    options = remesh_options(metric, sharpness, final_sharpness, seed, threads)
    options |= {"embedding": embedding.value, "weights": weights, "device": device.value, "denoise": denoise}
    options |= {"feature_angle": feature_angle, "time_limit": time_limit}
    with progress(quiet) as display:
        surface, seconds = read(source)
        if features is not None:
            from anisomesh.features.tagged import load_pairs

            options["features"] = load_pairs(features)
        options |= {"n_vertices": n_vertices, "ratio": ratio}
        options["max_error"] = None if error is None else error.on(surface)
        result, facts = run_remesh(surface, display, name=str(source), load_seconds=seconds, **options)
        facts["options"]["features"] = None if features is None else str(features)
        outputs.write(result, facts, display)
    if json_:
        typer.echo(as_json(facts))
    elif not quiet:
        typer.echo(summary(facts, outputs.paths, result.prepare_report.lines()))
