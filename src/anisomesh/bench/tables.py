"""Tables of the rows of a suite, in Markdown and HTML."""

from __future__ import annotations

import html
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from anisomesh.bench.disturb import CLEAN
from anisomesh.bench.runs import RunRow, chosen
from anisomesh.bench.suite import Suite


@dataclass(frozen=True)
class Column:
    """A figure of a row: its heading, how to find it, how many digits to show, and how to average it."""

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
    Column("V", _figure("vertices"), 0),
    Column("CD x1e-5", _figure("sampled", "chamfer", factor=1e5), 3),
    Column("(floor)", _figure("floor", "chamfer", factor=1e5), 3),
    Column("F1", _figure("sampled", "f1"), 3),
    Column("(floor)", _figure("floor", "f1"), 3),
    Column("NC", _figure("sampled", "normal_consistency"), 3),
    Column("HD x1e-2", _figure("sampled", "hausdorff", factor=1e2), 3),
    Column("ECD x1e-2", _figure("sampled", "edge_chamfer", factor=1e2), 3),
    Column("EF1", _figure("sampled", "edge_f1"), 3),
    Column("RMS x1e-4", _figure("distance", "rms", factor=1e4), 3, geometric=True),
    Column("max x1e-3", _figure("distance", "hausdorff", factor=1e3), 2, geometric=True),
    Column("G", _figure("shape", "g_mean"), 3),
    Column("G 5 %", _figure("shape", "g_low"), 3),
    Column("creases", _figure("features", "crease_covered"), 3),
    Column("boundary, mean", _boundary("mean"), 3),
    Column("boundary, max", _boundary("max"), 3),
    Column("seconds", lambda row: float(row["seconds"]), 2),
)


def faults(row: RunRow) -> list[str]:
    """Return what is not valid about the result of a row, in words."""
    validity = row["evaluation"]["validity"]
    found = [name for name in ("nonmanifold_edges", "nonmanifold_vertices", "flat", "inverted") if validity.get(name)]
    if not validity["oriented"]:
        found.append("not oriented")
    if validity["euler"] != validity["euler_input"]:
        found.append(f"Euler {validity['euler']} for {validity['euler_input']}")
    if validity["self_intersections"] > validity["self_intersections_input"]:
        found.append("new self-intersections")
    return found


def mean_table(suite: Suite, rows: Sequence[RunRow]) -> tuple[list[str], list[list[str]]]:
    """Return heading and lines of the means over meshes and seeds, by input, ratio and method.

    Distances are averaged geometrically, everything else arithmetically; figures that are not defined for a mesh (ECD
    without creases) are left out of the mean. Runs that failed, and results that are not valid, are counted.
    """
    heading = ["vertices", "method", "runs", *(column.heading for column in COLUMNS), "failed", "not valid"]
    lines = []
    for given, ratio, method in product(suite.inputs, suite.ratios, suite.methods):
        group = chosen(rows, given, ratio, method.name)
        done = [row for row in group if row["status"] == "done"]
        if not any(row["status"] in ("done", "failed") for row in group):
            continue
        figures = [_mean(column, done) for column in COLUMNS]
        failed = sum(row["status"] == "failed" for row in group)
        invalid = sum(bool(faults(row)) for row in done)
        lines.append([_vertices(given, ratio), method.name, str(len(done)), *figures, str(failed), str(invalid)])
    return heading, lines


def _vertices(given: str, ratio: float) -> str:
    """Return the ratio of a row, and its input where that is not the clean mesh."""
    return f"{ratio:.0%}" if given == CLEAN else f"{ratio:.0%} of {given}"


def run_table(rows: Sequence[RunRow]) -> tuple[list[str], list[list[str]]]:
    """Return heading and lines of the single runs."""
    heading = ["mesh", "vertices", "method", "seed", *(column.heading for column in COLUMNS), "remarks"]
    lines = []
    for row in rows:
        names = [row["mesh"], _vertices(row.get("input", CLEAN), row["ratio"]), row["method"], str(row["seed"])]
        if row["status"] == "done":
            figures, remark = [_shown(column.value(row), column.digits) for column in COLUMNS], ", ".join(faults(row))
        else:
            figures, remark = ["-"] * len(COLUMNS), f"{row['status']}: {row['error']}"
        lines.append([*names, *figures, remark])
    return heading, lines


def time_table(rows: Sequence[RunRow]) -> tuple[list[str], list[list[str]]]:
    """Return heading and lines of the seconds of each stage against the number of vertices wanted.

    For methods that tell the seconds of their stages; below them the exponent of a power law fitted to the runs, where
    there are at least three sizes. Without such methods there are no lines.
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
    return ["method", "mesh", "ratio", "vertices wanted", *stages], lines


def _sections(suite: Suite, rows: Sequence[RunRow]) -> list[tuple[str, tuple[list[str], list[list[str]]]]]:
    sections = [("Means", mean_table(suite, rows)), ("Runs", run_table(rows)), ("Seconds", time_table(rows))]
    return [section for section in sections if section[1][1]]


def markdown(suite: Suite, rows: Sequence[RunRow], chart: str = "") -> str:
    """Return the report of a suite as Markdown; ``chart`` is the name of a picture to show."""
    parts = [f"# {suite.name}", suite.description.strip(), _remarks(rows)]
    parts.append(f"![Distance against quality]({chart})" if chart else "")
    for title, (heading, lines) in _sections(suite, rows):
        cells = [heading, ["---"] * len(heading), *lines]
        table = "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in cells)
        parts += [f"## {title}", table]
    return "\n\n".join(part for part in parts if part) + "\n"


def web_page(suite: Suite, rows: Sequence[RunRow], chart: str = "") -> str:
    """Return the report of a suite as a page of HTML that needs nothing else; ``chart`` is SVG to show in it."""
    parts = [f"<h1>{html.escape(suite.name)}</h1>", f"<p>{html.escape(suite.description.strip())}</p>"]
    parts.append(f"<p>{html.escape(_remarks(rows))}</p>")
    parts.append(chart[chart.find("<svg") :] if chart else "")
    for title, (heading, lines) in _sections(suite, rows):
        head = "".join(f"<th>{html.escape(cell)}</th>" for cell in heading)
        body = "\n".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in line) + "</tr>" for line in lines)
        parts.append(f"<h2>{title}</h2>\n<table>\n<tr>{head}</tr>\n{body}\n</table>")
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{html.escape(suite.name)}</title>\n'
        f"<style>{_STYLE}</style></head><body>\n" + "\n".join(parts) + "\n</body></html>\n"
    )


_STYLE = (
    "body{font:15px/1.5 system-ui,sans-serif;margin:2em}table{border-collapse:collapse}"
    "th,td{padding:.2em .7em;border-bottom:1px solid #ddd;text-align:right;white-space:nowrap}"
    "th{position:sticky;top:0;background:#fff}td:nth-child(-n+3),th:nth-child(-n+3){text-align:left}"
)


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
