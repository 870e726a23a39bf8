"""Tables of the rows that benchmarks/quality.py writes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np

from anisomesh.caveats import COUNT_TOLERANCE

EXACT = 1e-9  # of the diagonal: added to distances before they are compared


def key_of(row: dict[str, Any]) -> tuple[str, float, float, str]:
    """Return the key of the run of a row."""
    return row["mesh"], row["ratio"], row["sharpness"], row.get("metric", "curvature")


def faults(row: dict[str, Any]) -> list[str]:
    """Return the faults of a result in words."""
    validity = row["validity"]
    found = [] if validity["oriented"] else ["not oriented"]
    names = ("nonmanifold_edges", "nonmanifold_vertices", "inverted", "new_intersections")
    joined = validity.get("nonmanifold_edges_input")
    found += [
        f"{name} {validity[name]}"
        for name in names
        if validity[name] and not (joined and name.startswith("nonmanifold"))
    ]
    found += [
        f"{name} {validity[name]} for {validity[f'{name}_input']}"
        for name in ("euler", "components", "boundary_loops")
        if validity[name] != validity[f"{name}_input"]
    ]
    if abs(row["vertices"] - row["vertices_asked"]) > COUNT_TOLERANCE * row["vertices_asked"]:
        found.append(f"{row['vertices']} vertices for {row['vertices_asked']}")
    return found


def tables(rows: list[dict[str, Any]]) -> str:
    lines = [
        "| metric | s | ratio | meshes | G | G, working metric | G, least | flat triangles | off planes | creases "
        "| E2 [1e-7 D²] | RMS over quadric decimation | largest | HD [1e-3 D] | time [s], mean | median | faults |",
        "|" + "---|" * 17,
    ]
    for group in grouped(rows):
        flat = [row["flat_quality"] for row in group if row["flat_quality"] is not None]
        seconds = [row["seconds"]["total"] for row in group]
        at_planes, off_planes = np.sum([row["at_planes"] for row in group], axis=0)
        cells = [
            *headings(group),
            f"{mean(group, 'g_mean'):.3f}",
            f"{mean(group, 'g_working'):.3f}",
            f"{min(row['g_mean'] for row in group):.3f}",
            f"{np.mean(flat):.3f}" if flat else "",
            f"{off_planes / at_planes:.1%}" if at_planes else "",
            f"{mean(group, 'creases'):.1%}",
            f"{geometric_mean(group, 'mean_square') * 1e7:.2f}",
            f"{geometric_mean(group, 'over_quadric'):.2f}",
            f"{max(row['over_quadric'] for row in group):.2f}",
            f"{geometric_mean(group, 'hausdorff') * 1e3:.2f}",
            f"{np.mean(seconds):.2f}",
            f"{np.median(seconds):.2f}",
            f"{sum(bool(faults(row)) for row in group)}",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    faulty = [row for row in rows if faults(row)]
    lines += [
        "",
        *(f"{row['mesh']} {row['ratio']:.0%} s={row['sharpness']:g}: {', '.join(faults(row))}" for row in faulty),
    ]
    return "\n".join(lines)


def grouped(rows: list[dict[str, Any]]) -> list[list[dict[str, Any]]]:
    """Return the rows of each metric, sharpness, ratio and kind of mesh."""
    groups: dict[tuple[str, float, float, str], list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        groups[key_of(row)[3], -row["sharpness"], -row["ratio"], row["kind"]].append(row)
    return [group for _, group in sorted(groups.items())]


def headings(group: list[dict[str, Any]]) -> list[str]:
    """Return metric, sharpness, ratio, and number and kind of the meshes of a group."""
    first = group[0]
    return [
        key_of(first)[3],
        f"{first['sharpness']:g}",
        f"{first['ratio']:.0%}",
        f"{len(group)} {first['kind']}",
    ]


def comparison(before: list[dict[str, Any]], after: list[dict[str, Any]]) -> str:
    """Return a table of what two versions have on the same runs."""
    earlier = {key_of(row): row for row in before}
    lines = [
        "| metric | s | ratio | meshes | G | flat triangles | creases | RMS | HD | time | faults |",
        "|" + "---|" * 11,
    ]
    for group in grouped([row for row in after if key_of(row) in earlier]):
        pairs = [(earlier[key_of(row)], row) for row in group]
        flat = [pair for pair in pairs if None not in (pair[0]["flat_quality"], pair[1]["flat_quality"])]
        cells = [
            *headings(group),
            _means(pairs, lambda row: row["g_mean"]),
            _means(flat, lambda row: row["flat_quality"]),
            _means(pairs, lambda row: row["creases"]),
            _factor(pairs, lambda row: row["mean_square"] ** 0.5),
            _factor(pairs, lambda row: row["hausdorff"]),
            _factor(pairs, lambda row: row["seconds"]["total"]),
            " -> ".join(str(sum(bool(faults(pair[k])) for pair in pairs)) for k in range(2)),
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


Pairs = list[tuple[dict[str, Any], dict[str, Any]]]


def _means(pairs: Pairs, figure: Callable[[dict[str, Any]], float]) -> str:
    """Return the means of a figure before and after."""
    return " -> ".join(f"{np.mean([figure(pair[k]) for pair in pairs]):.3f}" for k in range(2)) if pairs else ""


def _factor(pairs: Pairs, figure: Callable[[dict[str, Any]], float]) -> str:
    """Return the geometric mean of the factors that a figure has changed by."""
    logs = [np.log((figure(after) + EXACT) / (figure(before) + EXACT)) for before, after in pairs]
    return f"x {np.exp(np.mean(logs)):.2f}"


def mean(rows: list[dict[str, Any]], name: str) -> float:
    return float(np.mean([row[name] for row in rows]))


def geometric_mean(rows: list[dict[str, Any]], name: str) -> float:
    """Return the geometric mean of figures, of which exact results (0) count as 1e-16."""
    return float(np.exp(np.mean(np.log([max(row[name], 1e-16) for row in rows]))))
