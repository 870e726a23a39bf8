"""Arguments that several commands have: the input, how to remesh it, threads, silence."""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer


class Metric(StrEnum):
    """What decides the shape of the triangles."""

    curvature = "curvature"
    approximation = "approximation"
    uniform = "uniform"


def _positive(value: float | None) -> float | None:
    if value is not None and not (math.isfinite(value) and value > 0):
        raise typer.BadParameter(f"{value} is not a positive finite number")
    return value


def remesh_options(
    metric: Metric, sharpness: float, final_sharpness: float | None, seed: int, threads: int
) -> dict[str, Any]:
    """Return the keyword arguments of :func:`anisomesh.pipeline.remesh` for these options."""
    return {
        "metric": metric.value,
        "sharpness": sharpness,
        "final_sharpness": final_sharpness,
        "seed": seed,
        "threads": threads,
    }


Source = Annotated[Path, typer.Argument(metavar="IN", help="Mesh to remesh: OBJ, OFF, PLY, STL, GLB, VTU, ...")]
Vertices = Annotated[
    int | None, typer.Option("--vertices", "-n", min=4, help="Number of vertices of the result (this or --ratio).")
]
Ratio = Annotated[
    float | None, typer.Option("--ratio", callback=_positive, help="Vertices of the result per vertex of the input.")
]
MetricName = Annotated[
    Metric, typer.Option("--metric", help="curvature: the paper's; approximation: least error; uniform: no stretch.")
]
Sharpness = Annotated[
    float, typer.Option("--sharpness", callback=_positive, help="Pull towards creases: 1 none, 7 as in the paper.")
]
FinalSharpness = Annotated[
    float | None,
    typer.Option(
        "--final-sharpness", callback=_positive, help="Raise the sharpness to this value late, for example 30."
    ),
]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Seed of the random start; same seed, same result.")]
Threads = Annotated[int, typer.Option("--threads", min=1, help="Worker threads; the result does not depend on it.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress and no summary.")]
