"""Creases and corners at a fifth of the vertices: ten parts made by code and the CAD meshes of the test folder.

Usage: python benchmarks/crease_coverage.py [--ratio 0.2] [--embedding direct] [--folder test] [--only NAME]

Parts made by code have their long edges split first, to some 2,000 vertices. The meshes of the folder come from
``ANISOMESH_DATA``. Exit code 1 if a corner is missed or less than 99 % of the creases covered.
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
from anisomesh.mesh.subdivision import split_long_edges
from anisomesh.mesh.surface import Surface
from anisomesh.options import EMBEDDINGS, RemeshOptions
from anisomesh.shapes.parts import sparse_parts

ANGLE = RemeshOptions().feature_angle
REACH = 0.1  # mean edges of the result: a crease is covered where a bent edge of the result is so near
EXACT = 1e-6  # diagonals: a corner is kept if a vertex is so near
FINE = 2_000  # vertices of the parts made by code


def fine(part: Surface) -> Surface:
    """Return a part with its edges split until it has about ``FINE`` vertices."""
    edge = 1.5 * float(np.sqrt(2.0 * part.area / (np.sqrt(3.0) * FINE)))
    return split_long_edges(part, edge, max_faces=20 * FINE).surface


def measure(name: str, surface: Surface, ratio: float, embedding: str) -> tuple[str, bool]:
    """Return a row of the table, and whether the figures are reached."""
    result = anisomesh.remesh(surface, ratio=ratio, embedding=embedding)
    before, after = result.prepared, result.surface
    edge = float(after.edge_lengths.mean())
    kept = feature_preservation(before, after, crease_angle=ANGLE, tolerance=REACH * edge)
    at_corner = before.points[corners(before, sharp_edges(before, ANGLE))]
    exact = int((cKDTree(after.points).query(at_corner)[0] < EXACT * before.diagonal).sum()) if len(at_corner) else 0
    evaluation = anisomesh.evaluate(before, after)
    row = (
        f"| {name} | {before.n_points:,} | {after.n_points:,} | {kept.crease_length / edge:.0f} "
        f"| {kept.crease_covered:.1%} | {exact} of {len(at_corner)} | {evaluation.shape.g_mean:.3f} "
        f"| {evaluation.distance.hausdorff:.1e} | {len(result.warnings)} |"
    )
    return row, kept.crease_covered >= 0.99 and exact == len(at_corner)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ratio", type=float, default=0.2)
    parser.add_argument("--embedding", choices=EMBEDDINGS, default="direct")
    parser.add_argument("--folder", default="test")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    inputs = {name: fine(part) for name, part in sparse_parts().items()}
    if "ANISOMESH_DATA" in os.environ:
        data = Path(os.environ["ANISOMESH_DATA"])
        with (data / "manifest.csv").open() as file:
            names = [row["file"] for row in csv.DictReader(file) if row["category"] == "cad"]
        for name in names:
            if name.startswith(f"{options.folder}/"):
                inputs[Path(name).name.split("--")[0]] = anisomesh.load(data / name)
    print("| part | vertices before | after | creases / edge | covered | corners exact | G | distance | warnings |")
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
