"""Reports of a suite: tables of its rows, in Markdown and HTML."""

from __future__ import annotations

import html
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from anisomesh.bench.disturb import CLEAN
from anisomesh.bench.runs import RunRow, select_rows
from anisomesh.bench.suite import Suite
from anisomesh.io.results.web_page import table as html_table
from anisomesh.io.results.web_page import web_page as html_page


@dataclass(frozen=True)
class Column:
    """A figure of a row: heading with unit, value, digits to show, and whether means are geometric."""

    heading: str
    value: Callable[[RunRow], float | None]
    digits: int
    geometric: bool = False


def _figure(*path: str, factor: float = 1.0) -> Callable[[RunRow], float | None]:
    def value(row: RunRow) -> float | None:
        found: Any = row["evaluation"]
        for key in path:
            found = found[key]
        return None if found is None else factor * float(found)

    return value


def _boundary(which: str) -> Callable[[RunRow], float | None]:
    """Return the larger of the two distances between boundaries, in mean edge lengths of the result."""

    def value(row: RunRow) -> float | None:
        found = row["evaluation"].get("boundary")
        if found is None:
            return None
        return float(max(found[f"{which}_ab"], found[f"{which}_ba"]) / row["evaluation"]["shape"]["edge_mean"])

    return value


COLUMNS = (
    Column("vertices", _figure("vertices"), 0),
    Column("CD [1e-5 D²]", _figure("sampled", "chamfer", factor=1e5), 3),
    Column("CD floor [1e-5 D²]", _figure("floor", "chamfer", factor=1e5), 3),
    Column("F1", _figure("sampled", "f1"), 3),
    Column("F1 floor", _figure("floor", "f1"), 3),
    Column("NC", _figure("sampled", "normal_consistency"), 3),
    Column("HD [1e-2 D]", _figure("sampled", "hausdorff", factor=1e2), 3),
    Column("ECD [1e-2 D²]", _figure("sampled", "edge_chamfer", factor=1e2), 3),
    Column("EF1", _figure("sampled", "edge_f1"), 3),
    Column("RMS [1e-4 D]", _figure("distance", "rms", factor=1e4), 3, geometric=True),
    Column("max [1e-3 D]", _figure("distance", "hausdorff", factor=1e3), 2, geometric=True),
    Column("G", _figure("shape", "g_mean"), 3),
    Column("G 5 %", _figure("shape", "g_low"), 3),
    Column("creases covered", _figure("features", "crease_covered"), 3),
    Column("boundary mean [edges]", _boundary("mean"), 3),
    Column("boundary max [edges]", _boundary("max"), 3),
    Column("time [s]", lambda row: float(row["seconds"]), 2),
)
_LEGEND = (
    "ratio: vertices of the result per vertex of the mesh. D: bounding-box diagonal of the mesh. CD, F1, NC, HD, ECD, "
    "EF1: the measures of the paper between samples; floor: the same between two samples of the mesh itself. RMS, max: "
    "distance between the surfaces. G: quality of the triangles in the metric, 5 %: quantile. boundary: distance "
    "between the boundaries, in mean edge lengths of the result."
)


def faults(row: RunRow) -> list[str]:
    """Return the faults of the result of a row in words."""
    validity = row["evaluation"]["validity"]
    names = ("nonmanifold_edges", "nonmanifold_vertices", "flat", "inverted")
    joined = validity.get("nonmanifold_edges_input")  # whose edges and vertices are the ones of the input
    found = [name for name in names if validity.get(name) and not (joined and name.startswith("nonmanifold"))]
    if not validity["oriented"]:
        found.append("not oriented")
    if validity["euler"] != validity["euler_input"]:
        found.append(f"Euler {validity['euler']} for {validity['euler_input']}")
    if validity["self_intersections"] > validity["self_intersections_input"]:
        found.append("new self-intersections")
    return found


def mean_table(suite: Suite, rows: Sequence[RunRow]) -> tuple[list[str], list[list[str]]]:
    """Return heading and lines of the means over meshes and seeds, by input, ratio and method.

    Means of RMS and max are geometric, all others arithmetic. Undefined figures (ECD without creases) are left out.
    """
    heading = ["ratio", "method", "runs", *(column.heading for column in COLUMNS), "failed", "invalid"]
    lines = []
    for input_name, ratio, method in product(suite.inputs, suite.ratios, suite.methods):
        group = select_rows(rows, input_name, ratio, method.name)
        done = [row for row in group if row["status"] == "done"]
        if not any(row["status"] in ("done", "failed") for row in group):
            continue
        figures = [_mean(column, done) for column in COLUMNS]
        failed = sum(row["status"] == "failed" for row in group)
        invalid = sum(bool(faults(row)) for row in done)
        lines.append([_ratio(input_name, ratio), method.name, str(len(done)), *figures, str(failed), str(invalid)])
    return heading, lines


def _ratio(input_name: str, ratio: float) -> str:
    """Return the ratio of a row, with the input unless it is the clean mesh."""
    return f"{ratio:.0%}" if input_name == CLEAN else f"{ratio:.0%} of {input_name}"


def run_table(rows: Sequence[RunRow]) -> tuple[list[str], list[list[str]]]:
    """Return heading and lines of the single runs."""
    heading = ["mesh", "ratio", "method", "seed", *(column.heading for column in COLUMNS), "remarks"]
    lines = []
    for row in rows:
        names = [row["mesh"], _ratio(row["input"], row["ratio"]), row["method"], str(row["seed"])]
        if row["status"] == "done":
            figures, remark = [_shown(column.value(row), column.digits) for column in COLUMNS], ", ".join(faults(row))
        else:
            figures, remark = ["-"] * len(COLUMNS), f"{row['status']}: {row['error']}"
        lines.append([*names, *figures, remark])
    return heading, lines


def time_table(rows: Sequence[RunRow]) -> tuple[list[str], list[list[str]]]:
    """Return heading and lines of the time per stage, for methods that report it.

    With at least three numbers of vertices, the last line of a method has the exponents of power laws fitted to the
    times.
    """
    done = [row for row in rows if row["status"] == "done" and "seconds" in row["facts"]]
    stages = list(dict.fromkeys(stage for row in done for stage in row["facts"]["seconds"] if stage != "load"))
    lines = []
    for method in dict.fromkeys(row["method"] for row in done):
        group = sorted((row for row in done if row["method"] == method), key=lambda row: (row["asked"], row["mesh"]))
        seconds = np.array([[row["facts"]["seconds"].get(stage, np.nan) for stage in stages] for row in group])
        for row, values in zip(group, seconds, strict=True):
            shown = [_shown(float(value), 3) for value in values]
            lines.append([method, row["mesh"], f"{row['ratio']:.0%}", f"{row['asked']:,}", *shown])
        sizes = np.array([row["asked"] for row in group])
        if len(np.unique(sizes)) >= 3:
            growth = np.polyfit(np.log(sizes), np.log(np.maximum(seconds, 1e-9)), 1)[0]
            lines.append([method, "exponent of n", "", "", *(f"{value:.2f}" for value in growth)])
    return ["method", "mesh", "ratio", "vertices requested", *(f"{stage} [s]" for stage in stages)], lines


def _sections(suite: Suite, rows: Sequence[RunRow]) -> list[tuple[str, tuple[list[str], list[list[str]]]]]:
    sections = [("Means", mean_table(suite, rows)), ("Runs", run_table(rows)), ("Time per stage", time_table(rows))]
    return [section for section in sections if section[1][1]]


def markdown(suite: Suite, rows: Sequence[RunRow], chart: str = "") -> str:
    """Return the report of a suite as Markdown, with a chart by file name."""
    parts = [f"# {suite.name}", suite.description.strip(), _remarks(rows), _LEGEND]
    parts.append(f"![Distance against quality]({chart})" if chart else "")
    for title, (heading, lines) in _sections(suite, rows):
        cells = [heading, ["---"] * len(heading), *lines]
        table = "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in cells)
        parts += [f"## {title}", table]
    return "\n\n".join(part for part in parts if part) + "\n"


def web_page(suite: Suite, rows: Sequence[RunRow], chart: str = "") -> str:
    """Return the report of a suite as a self-contained HTML page, with a chart as SVG text."""
    parts = [f"<h1>{html.escape(suite.name)}</h1>", f"<p>{html.escape(suite.description.strip())}</p>"]
    parts += [f"<p>{html.escape(text)}</p>" for text in (_remarks(rows), _LEGEND) if text]
    parts.append(chart[chart.find("<svg") :] if chart else "")
    for title, (heading, lines) in _sections(suite, rows):
        parts += [f"<h2>{title}</h2>", html_table(heading, lines)]
    return html_page(suite.name, parts)


def _remarks(rows: Sequence[RunRow]) -> str:
    absent = sorted({f"{row['method']} ({row['error']})" for row in rows if row["status"] == "absent"})
    skipped = len({row["mesh"] for row in rows if row["status"] == "skipped"})
    parts = [f"Left out: {', '.join(absent)}." if absent else "", f"Open meshes skipped: {skipped}." if skipped else ""]
    return " ".join(part for part in parts if part)


def _mean(column: Column, rows: Sequence[RunRow]) -> str:
    values = [value for row in rows if (value := column.value(row)) is not None]
    if not values:
        return "-"
    if column.geometric and min(values) > 0.0:
        return _shown(float(np.exp(np.mean(np.log(values)))), column.digits)
    return _shown(float(np.mean(values)), column.digits)


def _shown(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:,.{digits}f}"
