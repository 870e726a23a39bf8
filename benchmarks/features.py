"""Corners and creases of the procedural machine part, and distances of rocker-arm and fertility.

Usage: python benchmarks/features.py [--resolution 24]
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

import anisomesh
from anisomesh.features.detect import points_along, sharp_edges
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.shapes.analytic import cad_features, cad_part

COVERED_DISTANCE = 0.1  # mean edges of the result: crease points this close to a bent edge are covered; heuristic
MIN_BEND_ANGLE = 5.0  # degrees between the faces of a bent edge; heuristic, below the weak creases of the part
RESULT_SPACING = 0.02  # mean edges, of points along bent edges of the result; a fifth of COVERED_DISTANCE
PART_SPACING = 0.1  # mean edges, of points along the creases of the part, whose covered share is counted


def edges_between(surface: Surface, ends: np.ndarray) -> np.ndarray:
    """Return which edges (E,) of a surface join given pairs of points (n, 2)."""
    return np.isin(edge_keys(surface.edges), edge_keys(ends))


def measure_part(resolution: int, ratio: float, final: float | None) -> str:
    part, features = cad_part(resolution), cad_features(resolution)
    result = anisomesh.remesh(part, ratio=ratio, final_sharpness=final, embedding="direct").surface
    edge = float(result.edge_lengths.mean())
    corner = cKDTree(result.points).query(part.points[features.corners])[0] / edge
    fine = cKDTree(points_along(result, sharp_edges(result, MIN_BEND_ANGLE), RESULT_SPACING * edge))
    covered = []
    for weak in (False, True):
        chosen = features.creases[features.weak == weak]
        distance = fine.query(points_along(part, edges_between(part, chosen), PART_SPACING * edge))[0]
        covered.append(float((distance < COVERED_DISTANCE * edge).mean()))
    late = "" if final is None else f", then s = {final:g}"
    return (
        f"| machine part, {part.n_points:,} points, {ratio:.0%}, s = 7{late} | {result.n_points:,} "
        f"| {corner.max():.2%} | {covered[0]:.1%} | {covered[1]:.1%} |"
    )


def measure_mesh(path: Path, ratio: float) -> str:
    surface = anisomesh.load(path)
    result = anisomesh.remesh(surface, ratio=ratio, embedding="direct").surface
    distance = anisomesh.evaluate(surface, result).distance
    both = distance.mean_square_ab + distance.mean_square_ba
    return f"| {path.stem}, {ratio:.0%} | {result.n_points:,} | {distance.hausdorff:.2e} | {both:.2e} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--resolution", type=int, default=24, help="edges of the part along a unit of length")
    options = parser.parse_args()
    print("| run | vertices | farthest corner [mean edges] | sharp creases covered | weak creases covered |")
    print("|---|---|---|---|---|")
    for final in (None, 30.0):
        print(measure_part(options.resolution, 0.2, final), flush=True)
    if "ANISOMESH_DATA" in os.environ:
        print(
            "\n| run | vertices | largest distance [D] | sum of both mean squared distances [D²] |\n|---|---|---|---|"
        )
        for name in ("rocker-arm", "fertility"):
            print(measure_mesh(Path(os.environ["ANISOMESH_DATA"]) / "test" / f"{name}.ply", 0.2), flush=True)


if __name__ == "__main__":
    main()
