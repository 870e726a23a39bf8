"""Whether a prescribed size is followed: edges of remeshes with a size that varies by a factor along the x axis.

Usage: python benchmarks/sizes.py [--factor 10] [--vertices 1500] [--shapes flat sphere torus ring]

The size is h = factor^t, with t from 0 at one end of the shape to 1 at the other, and the metric I / h^2. The length of
an edge is the integral of 1 / h along it. Columns: mean length of the edges with a midpoint in each fifth of the range
of t, over the median of all edges; share of edges between 1 / sqrt(2) and sqrt(2) medians; for edges of the input the
length in the embedding over the one in the metric, in each fifth, over the same in the fifth in the middle; vertices;
inverted and intersecting triangles; seconds.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

import anisomesh
from anisomesh import Surface
from anisomesh.shapes.analytic import open_patch, sphere, torus, twisted_ring

Floats = npt.NDArray[np.float64]

SHAPES: dict[str, Callable[[], Surface]] = {
    "flat": lambda: open_patch(lambda x, y: 0.0 * x),
    "sphere": lambda: sphere(5),
    "torus": torus,
    "ring": twisted_ring,
}
FITS = {"fit": True, "no fit": False}
_QUADRATURE = np.polynomial.legendre.leggauss(8)


def lengths(points: Floats, edges: npt.NDArray[np.integer], size: Callable[[Floats], Floats]) -> tuple[Floats, Floats]:
    """Return the integrals (E,) of 1 / size along edges, and their midpoints (E, 3)."""
    start, end = points[edges[:, 0]], points[edges[:, 1]]
    total = np.zeros(len(edges))
    for place, weight in zip(*_QUADRATURE, strict=True):
        share = 0.5 * (1.0 + place)
        total += 0.5 * weight / size(start + share * (end - start))
    return total * np.linalg.norm(end - start, axis=1), 0.5 * (start + end)


def in_fifths(values: Floats, t: Floats) -> Floats:
    """Return the means (5,) of values with t in fifths of its range."""
    return np.array([values[(t >= k / 5) & (t <= (k + 1) / 5)].mean() for k in range(5)])


def measure(surface: Surface, factor: float, n_vertices: int, **options: object) -> str:
    """Return the row of a shape."""
    low, extent = surface.points[:, 0].min(), np.ptp(surface.points[:, 0])

    def place(points: Floats) -> Floats:
        return np.asarray((points[:, 0] - low) / extent)

    def size(points: Floats) -> Floats:
        return np.asarray(factor ** place(points))

    start = time.perf_counter()
    tensors = np.eye(3) / size(surface.points)[:, None, None] ** 2
    result = anisomesh.remesh(surface, n_vertices=n_vertices, metric=tensors, **options)
    seconds = time.perf_counter() - start
    length, middle = lengths(result.surface.points, result.surface.edges, size)
    length /= np.median(length)
    conforming = np.mean((length > 0.5**0.5) & (length < 2.0**0.5))
    working = result.working
    asked, middles = lengths(result.frame.to_model(working.points), working.edges, size)
    embedded = np.linalg.norm(np.diff(result.embedding.points[working.edges], axis=1)[:, 0], axis=1)
    of_embedding = in_fifths(embedded / asked, place(middles))
    cells = " ".join(f"{value:5.2f}" for value in in_fifths(length, place(middle)))
    stretch = " ".join(f"{value:5.2f}" for value in of_embedding / of_embedding[2])
    faults = result.validity.inverted + result.validity.new_intersections
    return f"{cells}   {conforming:5.1%}   {stretch}   {result.surface.n_points:6} {faults:3} {seconds:5.1f} s"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--factor", type=float, default=10.0)
    parser.add_argument("--vertices", type=int, default=1500)
    parser.add_argument("--shapes", nargs="+", choices=SHAPES, default=list(SHAPES))
    parser.add_argument("--sharpness", type=float, default=7.0)
    arguments = parser.parse_args()
    for name in arguments.shapes:
        for word, fit in FITS.items():
            row = measure(SHAPES[name](), arguments.factor, arguments.vertices, fit=fit, sharpness=arguments.sharpness)
            print(f"{name:8} {word:7} {row}", flush=True)


if __name__ == "__main__":
    main()
