"""``anisomesh evaluate``: measure a remesh against its input."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from anisomesh.cli.inputs import check_present
from anisomesh.cli.job import read
from anisomesh.cli.progress import announce_compilation, progress
from anisomesh.cli.report import as_json, counted, describe_validity, table

if TYPE_CHECKING:
    from anisomesh.evaluation.report import Evaluation


MAX_SAMPLES = 50_000_000  # takes some GB


def command(
    reference: Annotated[Path, typer.Argument(metavar="REFERENCE", help="The mesh that was remeshed.")],
    result: Annotated[Path, typer.Argument(metavar="RESULT", help="The remesh, in the same coordinates.")],
    samples: Annotated[int, typer.Option(min=1, max=MAX_SAMPLES, help="Random points on each surface.")] = 100_000,
    crease_angle: Annotated[
        float, typer.Option(min=0.0, max=180.0, help="Edges that bend by more than this many degrees are creases.")
    ] = 30.0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the points; the same seed gives the same figures.")] = 0,
    json_: Annotated[bool, typer.Option("--json", help="Print the figures as JSON and nothing else.")] = False,
) -> None:
    """Measure distance, triangle quality, features and validity of RESULT against REFERENCE."""
    from anisomesh.evaluation.report import evaluate

    check_present(reference, result)
    with progress(json_) as display:
        a, b = read(reference)[0], read(result)[0]
        announce_compilation(display, "evaluate")
        evaluation = evaluate(a, b, samples=samples, crease_angle=crease_angle, seed=seed)
    if json_:
        names = {"reference": str(reference), "result": str(result), "samples": samples, "crease_angle": crease_angle}
        typer.echo(as_json(names | evaluation.as_dict()))
    else:
        typer.echo(f"{result} against {reference}; lengths at bounding-box diagonal 1 of the reference")
        typer.echo(_text(evaluation))


def _text(evaluation: Evaluation) -> str:
    """Return the figures as readable lines, with the measures of the paper in the paper's units."""
    distance, shape, features = evaluation.distance, evaluation.shape, evaluation.features
    rows = [
        ("size", f"{counted(evaluation.vertices, 'vertex', 'vertices')}, {counted(evaluation.faces, 'triangle')}"),
        ("surface", describe_validity(evaluation.validity.as_dict())),
        ("crossing", _crossing(evaluation)),
        ("distance", f"RMS {distance.rms:.3g}, largest {distance.hausdorff:.3g}"),
        ("  from input", f"RMS {distance.rms_ab:.3g}, largest {distance.max_ab:.3g}"),
        ("  to input", f"RMS {distance.rms_ba:.3g}, largest {distance.max_ba:.3g}"),
        ("  of vertices", f"RMS {evaluation.vertex_rms:.3g}, largest {evaluation.vertex_max:.3g}"),
        ("quality G", f"mean {shape.g_mean:.3f}, 5 % below {shape.g_low:.3f}, smallest {shape.g_min:.3f}"),
        (
            "angles",
            f"smallest {shape.angle_min:.1f}, 5 % of triangles below {shape.angle_low:.1f}, "
            f"largest {shape.angle_max:.1f} degrees",
        ),
        (
            "edges",
            f"{shape.edge_min:.3g} to {shape.edge_max:.3g}, mean {shape.edge_mean:.3g}, "
            f"variation {shape.edge_variation:.2f}",
        ),
        ("creases", f"{features.crease_covered:.1%} of length {features.crease_length:.3g} covered"),
        ("corners", f"{features.corners_kept:,} of {features.corners:,} kept"),
        ("boundary", _boundary(evaluation)),
        ("samples", "  ".join(f"{name:>10}" for name in PAPER_MEASURES)),
        ("  measured", "  ".join(f"{_paper(evaluation.sampled.as_dict(), name):>10}" for name in PAPER_MEASURES)),
        ("  floor", "  ".join(f"{_paper(evaluation.floor.as_dict(), name):>10}" for name in PAPER_MEASURES)),
    ]
    return table(rows)


PAPER_MEASURES = {
    "CD x1e-5": ("chamfer", 1e5),
    "F1": ("f1", 1.0),
    "NC": ("normal_consistency", 1.0),
    "HD x1e-2": ("hausdorff", 1e2),
    "ECD x1e-2": ("edge_chamfer", 1e2),
    "EF1": ("edge_f1", 1.0),
}
"""Measures by their names in the paper: key in ``SampledMeasures``, factor to the unit of the paper."""


def _paper(measures: dict[str, Any], name: str) -> str:
    key, factor = PAPER_MEASURES[name]
    value = measures[key]
    return "-" if value is None else f"{factor * value:.3f}"


def _boundary(evaluation: Evaluation) -> str:
    distance = evaluation.boundary
    if distance is None:
        return "none to compare"
    mean, largest = max(distance.mean_ab, distance.mean_ba), max(distance.max_ab, distance.max_ba)
    return f"mean distance {mean:.3g}, largest {largest:.3g}"


def _crossing(evaluation: Evaluation) -> str:
    pairs = counted(evaluation.validity.self_intersections, "pair of triangles", "pairs of triangles")
    return f"{pairs} (reference {evaluation.validity.self_intersections_input:,})"
