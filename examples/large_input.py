"""Remesh a dense knot to few vertices, with and without the reduction of the input.

Usage: python examples/large_input.py
"""

from __future__ import annotations

import time

import anisomesh
from anisomesh.shapes.analytic import trefoil_knot


def main(n_along: int = 1_200, n_around: int = 80, n_vertices: int = 600) -> list[anisomesh.RemeshResult]:
    surface = trefoil_knot(n_along=n_along, n_around=n_around)
    results = []
    for reduce in (True, False):
        start = time.perf_counter()
        result = anisomesh.remesh(surface, n_vertices=n_vertices, reduce=reduce)
        measured = anisomesh.evaluate(surface, result.surface, samples=20_000)
        print(
            f"{surface.n_points:,} points, {result.working.n_points:,} worked on: {time.perf_counter() - start:.1f} s, "
            f"RMS distance {1e4 * measured.distance.rms:.2f}e-4"
        )
        results.append(result)
    return results


if __name__ == "__main__":
    main()
