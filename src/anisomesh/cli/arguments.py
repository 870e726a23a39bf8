"""Arguments that several commands have: the input, how to remesh it, threads, silence."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from anisomesh.mesh.surface import Surface


class Metric(StrEnum):
    """What decides the shape of the triangles."""

    curvature = "curvature"
    approximation = "approximation"
    uniform = "uniform"


def positive(value: float | None) -> float | None:
    """Return the value of an option that is a positive number, if given.

    Raises
    ------
    typer.BadParameter
        If it is not.
    """
    if value is not None and not (math.isfinite(value) and value > 0):
        raise typer.BadParameter(f"{value} is not a positive finite number")
    return value


@dataclass(frozen=True)
class Length:
    """A length in model units, or in per cent of the diagonal of the bounding box of the mesh."""

    value: float
    relative: bool

    @classmethod
    def parse(cls, text: str, option: str) -> Length:
        """Return the length that a text such as ``0.2`` or ``0.1%`` stands for.

        Raises
        ------
        typer.BadParameter
            If it is no positive number.
        """
        try:
            value = float(text.removesuffix("%"))
        except ValueError:
            raise typer.BadParameter(
                f"{option} {text}: expected a length such as 0.2, or 0.1% of the diagonal"
            ) from None
        positive(value)
        return cls(value, text.endswith("%"))

    def on(self, surface: Surface) -> float:
        """Return the length for a mesh, in model units."""
        return self.value / 100.0 * surface.diagonal if self.relative else self.value


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
Vertices = Annotated[int | None, typer.Option("--vertices", "-n", min=4, help="Number of vertices of the result.")]
Ratio = Annotated[
    float | None,
    typer.Option("--ratio", callback=positive, help="Vertices of the result per vertex of the repaired input."),
]
MetricName = Annotated[
    Metric, typer.Option("--metric", help="curvature: the paper's; approximation: least error; uniform: no stretch.")
]
Sharpness = Annotated[
    float, typer.Option("--sharpness", callback=positive, help="Pull towards creases: 1 none, 7 as in the paper.")
]
FinalSharpness = Annotated[
    float | None,
    typer.Option(
        "--final-sharpness", callback=positive, help="Raise the sharpness to this value late, for example 30."
    ),
]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Seed of the random start; same seed, same result.")]
Threads = Annotated[int, typer.Option("--threads", min=1, help="Worker threads; the result does not depend on it.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress and no summary.")]
