"""Creases covered and corners kept at a fifth of the vertices: ten procedural parts and the CAD meshes of a folder.

Usage: python benchmarks/crease_coverage.py [--ratio 0.2] [--embedding direct] [--folder test] [--only NAME]

The long edges of procedural parts are split first, to about 2,000 vertices. The folder is in ``ANISOMESH_DATA``. Exit
code 1 if a result misses a corner or covers less than 99 % of the creases.
"""

from __future__ import annotations

import argparse
import csv
import os
import sys
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

import anisomesh
from anisomesh.evaluation.preservation import feature_preservation
from anisomesh.features.detect import corners, sharp_edges
from anisomesh.mesh.surface import Surface
from anisomesh.options import EMBEDDINGS, RemeshOptions
from anisomesh.shapes.parts import sparse_parts
from anisomesh.working.subdivision import split_long_edges

CREASE_ANGLE = RemeshOptions().feature_angle
CREASE_TOLERANCE = 0.1  # mean edges of the result: a crease is covered this close to a bent edge; heuristic
CORNER_TOLERANCE = 1e-6  # diagonals: a corner is kept if a vertex is this close; above rounding
MIN_COVERAGE = 0.99  # of the length of the creases; the goal
PART_VERTICES = 2_000  # of the procedural parts; heuristic


def refined(part: Surface) -> Surface:
    """Return a part with long edges split, with about ``PART_VERTICES`` vertices."""
    edge = 1.5 * float(np.sqrt(2.0 * part.area / (np.sqrt(3.0) * PART_VERTICES)))
    return split_long_edges(part, edge, max_faces=20 * PART_VERTICES).surface


def measure(name: str, surface: Surface, ratio: float, embedding: str) -> tuple[str, bool]:
    """Return a row of the table, and whether the result reaches the goals."""
    result = anisomesh.remesh(surface, ratio=ratio, embedding=embedding)
    before, after = result.prepared, result.surface
    edge = float(after.edge_lengths.mean())
    kept = feature_preservation(before, after, crease_angle=CREASE_ANGLE, tolerance=CREASE_TOLERANCE * edge)
    at_corner = before.points[corners(before, sharp_edges(before, CREASE_ANGLE))]
    distance = cKDTree(after.points).query(at_corner)[0] if len(at_corner) else np.zeros(0)
    exact = int((distance < CORNER_TOLERANCE * before.diagonal).sum())
    evaluation = anisomesh.evaluate(before, after)
    row = (
        f"| {name} | {before.n_points:,} | {after.n_points:,} | {kept.crease_length / edge:.0f} "
        f"| {kept.crease_covered:.1%} | {exact} of {len(at_corner)} | {evaluation.shape.g_mean:.3f} "
        f"| {evaluation.distance.hausdorff:.1e} | {len(result.warnings)} |"
    )
    return row, kept.crease_covered >= MIN_COVERAGE and exact == len(at_corner)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ratio", type=float, default=0.2)
    parser.add_argument("--embedding", choices=EMBEDDINGS, default="direct")
    parser.add_argument("--folder", default="test")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    inputs = {name: refined(part) for name, part in sparse_parts().items()}
    if "ANISOMESH_DATA" in os.environ:
        data = Path(os.environ["ANISOMESH_DATA"])
        with (data / "manifest.csv").open() as file:
            names = [row["file"] for row in csv.DictReader(file) if row["category"] == "cad"]
        for name in names:
            if name.startswith(f"{options.folder}/"):
                inputs[Path(name).name.split("--")[0]] = anisomesh.load(data / name)
    print("| mesh | before | vertices | creases [edges] | covered | corners kept | G | max distance [D] | warnings |")
    print("|---|---|---|---|---|---|---|---|---|")
    missed = 0
    for name, surface in inputs.items():
        if options.only in name:
            row, reached = measure(name, surface, options.ratio, options.embedding)
            print(row, flush=True)
            missed += not reached
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
