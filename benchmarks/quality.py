"""Quality, distance and validity of remeshes of real closed meshes.

Usage: python benchmarks/quality.py [--ratios 1 0.2 0.1] [--sharpness 7 1] [--only NAME] [--fresh]
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

import anisomesh
from anisomesh.caveats import COUNT_TOLERANCE
from anisomesh.mesh.topology import connected_components

OUT = Path(__file__).parent / "out" / "quality.jsonl"


def closed_meshes(data: Path) -> list[Path]:
    with (data / "manifest.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    return [
        data / row["file"]
        for row in rows
        if row["file"].startswith("test/") and row["closed"] == "1" and row["manifold"] == "1"
    ]


def measure(path: Path, ratio: float, sharpness: float) -> dict[str, Any]:
    result = anisomesh.remesh(anisomesh.load(path), ratio=ratio, sharpness=sharpness, embedding="direct")
    evaluation = anisomesh.evaluate(result.prepared, result.surface)
    distance = evaluation.distance
    return {
        "mesh": path.stem,
        "ratio": ratio,
        "sharpness": sharpness,
        "g_mean": evaluation.shape.g_mean,
        "g_min": evaluation.shape.g_min,
        "mean_square": distance.mean_square_ab + distance.mean_square_ba,
        "hausdorff": distance.hausdorff,
        "components_input": connected_components(result.prepared.faces, result.prepared.n_points)[0],
        **result.report(),
    }


def faults(row: dict[str, Any]) -> list[str]:
    """Return the faults of a result in words."""
    validity = row["validity"]
    found = [name for name in ("closed", "oriented") if not validity[name]]
    found += [name for name in ("nonmanifold_edges", "nonmanifold_vertices", "inverted") if validity[name]]
    if validity["euler"] != validity["euler_input"]:
        found.append(f"euler {validity['euler']} for {validity['euler_input']}")
    if validity["components"] != row["components_input"]:
        found.append(f"components {validity['components']} for {row['components_input']}")
    if abs(row["vertices"] - row["vertices_asked"]) > COUNT_TOLERANCE * row["vertices_asked"]:
        found.append(f"{row['vertices']} vertices for {row['vertices_asked']}")
    return found


def tables(rows: list[dict[str, Any]]) -> str:
    groups: dict[tuple[float, float], list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        groups[row["sharpness"], row["ratio"]].append(row)
    lines = [
        "| s | ratio | meshes | G mean | G min of means | E2 [1e-7 D²] | HD [1e-3 D] | time [s] | faults |",
        "|" + "---|" * 9,
    ]
    for (sharpness, ratio), group in sorted(groups.items(), reverse=True):
        g = np.array([row["g_mean"] for row in group])
        e2 = np.exp(np.mean(np.log([row["mean_square"] for row in group]))) * 1e7
        hd = np.exp(np.mean(np.log([row["hausdorff"] for row in group]))) * 1e3
        seconds = np.mean([row["seconds"]["total"] for row in group])
        bad = sum(bool(faults(row)) for row in group)
        lines.append(
            f"| {sharpness:g} | {ratio:.0%} | {len(group)} | {g.mean():.3f} | {g.min():.3f} | {e2:.2f} | {hd:.2f} "
            f"| {seconds:.2f} | {bad} |"
        )
    lines.append("")
    lines += [
        f"{row['mesh']} {row['ratio']:.0%} s={row['sharpness']:g}: {', '.join(faults(row))}"
        for row in rows
        if faults(row)
    ]
    return "\n".join(lines)


def read_rows() -> list[dict[str, Any]]:
    """Return the rows of earlier calls; rows of versions with other names of the figures are left out."""
    rows = [json.loads(line) for line in OUT.read_text().splitlines()] if OUT.exists() else []
    return [row for row in rows if "inverted" in row["validity"]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ratios", type=float, nargs="+", default=[1.0, 0.2, 0.1])
    parser.add_argument("--sharpness", type=float, nargs="+", default=[7.0, 1.0])
    parser.add_argument("--only", default="", help="run only meshes with this in their names")
    parser.add_argument("--fresh", action="store_true", help="discard earlier rows")
    options = parser.parse_args()
    if "ANISOMESH_DATA" not in os.environ:
        sys.exit("set ANISOMESH_DATA to the folder of meshes")
    OUT.parent.mkdir(exist_ok=True)
    if options.fresh:
        OUT.unlink(missing_ok=True)
    rows = read_rows()
    done = {(row["mesh"], row["ratio"], row["sharpness"]) for row in rows}
    todo = [
        (path, ratio, sharpness)
        for ratio in options.ratios
        for sharpness in options.sharpness
        for path in closed_meshes(Path(os.environ["ANISOMESH_DATA"]))
        if options.only in path.name and (path.stem, ratio, sharpness) not in done
    ]
    for number, (path, ratio, sharpness) in enumerate(todo, 1):
        try:
            row = measure(path, ratio, sharpness)
        except Exception as error:  # a crash is a result too
            print(f"[{number}/{len(todo)}] {path.stem} {ratio:.0%} s={sharpness:g}: {error!r}", file=sys.stderr)
            continue
        rows.append(row)
        with OUT.open("a") as file:
            file.write(json.dumps(row) + "\n")
        print(
            f"[{number}/{len(todo)}] {path.stem[:28]:<28} {ratio:.0%} s={sharpness:g} G {row['g_mean']:.3f} "
            f"E2 {row['mean_square'] * 1e7:.2f}e-7 HD {row['hausdorff'] * 1e3:.2f}e-3 {row['seconds']['total']:.2f} s "
            f"{' '.join(faults(row))}",
            file=sys.stderr,
            flush=True,
        )
    print(tables(rows))


if __name__ == "__main__":
    main()
