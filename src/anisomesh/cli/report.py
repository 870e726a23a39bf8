"""Text and JSON that the commands print and write."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from anisomesh.cli.spelling import in_one_line, warning_rows

if TYPE_CHECKING:
    from collections.abc import Sequence

    from anisomesh.mesh.surface import Surface

_EMBEDDINGS = {
    "neural": "neural (metric predicted by a network)",
    "hybrid": "hybrid (mean of the measured and the predicted metric)",
    "filtered": "filtered (measured curvature after filters have removed noise)",
}
_METRICS = {
    "curvature": "metric of the measured curvature",
    "approximation": "metric of the least distance, from the measured curvature",
    "uniform": "the same lengths in all directions",
}
_STAGE_ORDER = ("load", "prepare", "metric", "embed", "cvt", "dual", "fit", "attributes")


def as_json(report: dict[str, Any]) -> str:
    """Return a report as strict JSON, with null in place of numbers that are not finite."""
    from anisomesh.io.results.json_lines import finite

    return json.dumps(finite(report), indent=2, allow_nan=False)


def write_json(report: dict[str, Any], path: Path) -> None:
    """Write a report as JSON, in full or not at all."""
    from anisomesh.io.atomic import atomic_path

    with atomic_path(path) as temporary:
        Path(temporary).write_text(as_json(report) + "\n", encoding="utf-8")


def counted(count: int, singular: str, plural: str | None = None) -> str:
    """Return a number with its noun, such as ``1 face`` or ``1,200 faces``."""
    return f"{count:,} {singular if count == 1 else plural or singular + 's'}"


def table(rows: Sequence[tuple[str, str]]) -> str:
    """Return rows as text in two aligned columns, a line each, whatever line breaks and tabs names in them have."""
    width = max(len(name) for name, _ in rows)
    return "\n".join(f"  {name:<{width}}  {in_one_line(text)}" for name, text in rows)


def hints(prepared: Surface) -> list[str]:
    """Return advice on a surface as it is before the remesh, a line each."""
    from anisomesh.repair.near_points import count_near_boundary_points

    near = count_near_boundary_points(prepared)
    advice = "boundary points lie within 1e-5 of the diagonal of others; --weld auto joins them"
    return [f"{near:,} {advice}"] if near else []


def summary(report: dict[str, Any], written: Sequence[Path], notes: Sequence[str]) -> str:
    """Return the readable summary of a remesh.

    Parameters
    ----------
    report
        The result of :meth:`anisomesh.result.RemeshResult.report`.
    written
        The files that were written, in order.
    notes
        Changes that the repair made to the input, one line each.
    """
    seconds, stretch = report["seconds"], report["stretch"]
    stages = ", ".join(f"{stage} {seconds[stage]:.2f}" for stage in _STAGE_ORDER if stage in seconds)
    energy = "" if report["energy"] is None else f", energy {report['energy']:.4g}"
    rows = [
        ("vertices", f"{report['vertices']:,} (asked for {report['vertices_asked']:,})"),
        ("faces", f"{report['faces']:,}"),
        ("surface", describe_validity(report["validity"])),
        *([("distance", f"at most {report['distance']:.4g} from the input")] if report.get("distance") else []),
        *([("edges", describe_lengths(report["conformity"]))] if report.get("conformity") else []),
        (
            "stretch",
            f"mean {stretch['mean']:.2f}, largest {stretch['max']:.2f} (of the triangles; 1 = equilateral)",
        ),
        ("embedding", _describe_embedding(report["embedding"], report.get("options", {}))),
        ("optimiser", f"{counted(report['iterations'], 'iteration')}{energy}: {report['status']}"),
        ("seconds", f"{seconds['total']:.2f} ({stages})"),
        *(("prepared", note) for note in notes),
        *warnings_in(report),
        *(("hint", text) for text in report.get("hints", [])),
        *(("wrote", str(path)) for path in written),
    ]
    return table(rows)


def warnings_in(report: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the rows of a table with the warnings in the report of a remesh, or of each level of detail."""
    levels = report.get("levels")
    if levels is None:
        return warning_rows(report["warnings"])
    return warning_rows(f"level {k}: {text}" for k, level in enumerate(levels) for text in level["warnings"])


def _describe_embedding(name: str, options: dict[str, Any]) -> str:
    """Return in words what the embedding was made of, from its name and the options in the report of a remesh."""
    if options.get("metric_file") is not None:
        return f"direct (metric of {options['metric_file']})"
    if options.get("adapt_to") is not None:
        return f"direct (metric of the field {options['adapt_to']})"
    if name == "direct":
        return f"direct ({_METRICS[options.get('metric') or 'curvature']})"
    return _EMBEDDINGS[name]


def describe_lengths(conformity: dict[str, Any]) -> str:
    """Return in words how long the edges are in the metric."""
    asked = conformity["asked"]
    target = f"{conformity['of_count']:.4g} fits the count" if asked is None else f"asked for {asked:.4g}"
    return f"median length {conformity['median']:.4g} ({target}), {conformity['share']:.0%} within a factor of 1.41"


def describe_validity(validity: dict[str, Any]) -> str:
    """Return the validity of a surface in words: boundary, components, topology, defects."""
    edges, vertices = validity["nonmanifold_edges"], validity["nonmanifold_vertices"]
    of_input = f" (input {validity['nonmanifold_edges_input']:,})" if validity.get("nonmanifold_edges_input") else ""
    euler_input = validity.get("euler_input", validity["euler"])
    parts = [
        "closed" if validity["closed"] else counted(validity["boundary_loops"], "boundary loop"),
        counted(validity["components"], "component"),
        f"Euler {validity['euler']}" + (f" (input {euler_input})" if euler_input != validity["euler"] else ""),
        "manifold" if not edges and not vertices else "",
        counted(edges, "non-manifold edge") + of_input if edges else "",
        counted(vertices, "non-manifold vertex", "non-manifold vertices") if vertices else "",
        "" if validity["oriented"] else "not consistently oriented",
        counted(validity["flat"], "flat triangle") if validity.get("flat") else "",
        counted(validity["inverted"], "inverted triangle") if validity.get("inverted") else "",
    ]
    return ", ".join(part for part in parts if part)
