"""How well edges get unit length in the analytic metrics of the Unstructured Grid Adaptation Working Group.

Usage: python benchmarks/adaptation.py [--cases linear polar-1 polar-2]

The metrics are the ones of the first benchmark of the group, https://github.com/UGAWG/adapt-benchmarks (Ibanez et al.,
2017), on the surface of their domains: sizes of .1, but .001 in a layer, across z = .5 of the unit cube (linear), or
across r = .5, where a quarter cylinder around the z axis is cut out of the cube (polar-1). polar-2 is finer along the
circle near the layer, so that it can be followed. anisomesh has the formula as a metric source and makes one mesh, with
as many vertices as unit edges take. mmgs, if mmgpy is installed, gets tensors at vertices, and starts from its last
result four times, so that these resolve the layer.

Columns: case; method; vertices; share of the edges with lengths in the metric between 1 / sqrt(2) and sqrt(2),
integrated along them; mean length; 5 and 95 % quantiles; seconds.
"""

from __future__ import annotations

import argparse
import importlib.util
import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

import anisomesh
from anisomesh import Surface
from anisomesh.mesh.geometry import unit_frame
from anisomesh.shapes.analytic import box
from anisomesh.shapes.patches import grid_faces

Floats = npt.NDArray[np.float64]
Metric = Callable[[Floats], Floats]

SIZE, LAYER_SIZE, ARC_SIZE = 0.1, 0.001, 0.025
RADIUS, ROUNDS, CELLS = 0.5, 5, 20
_QUADRATURE = np.polynomial.legendre.leggauss(16)


def outer(vectors: Floats) -> Floats:
    """Return the projectors (n, 3, 3) onto unit vectors (n, 3)."""
    return vectors[:, :, None] * vectors[:, None, :]


def layer_size(distance: Floats) -> Floats:
    """Return the size across a layer, at a distance from its middle."""
    return LAYER_SIZE + 2.0 * (SIZE - LAYER_SIZE) * np.abs(distance)


def linear(points: Floats) -> Floats:
    """Return the metric (n, 3, 3) with a layer across z = .5."""
    across = layer_size(points[:, 2] - 0.5)[:, None, None]
    return np.diag([1.0, 1.0, 0.0]) / SIZE**2 + np.diag([0.0, 0.0, 1.0]) / across**2


def polar(points: Floats, *, fine_arcs: bool) -> Floats:
    """Return the metric (n, 3, 3) with a layer across r = .5, polar-1 or, with fine arcs, polar-2."""
    x, y, _ = points.T
    r, angle = np.hypot(x, y), np.arctan2(y, x)
    radial = np.stack([np.cos(angle), np.sin(angle), 0.0 * r], axis=1)
    around = np.stack([-np.sin(angle), np.cos(angle), 0.0 * r], axis=1)
    inside = np.maximum(10.0 * (0.6 - r), 0.0) if fine_arcs else 0.0 * r
    arc = inside * ARC_SIZE + (1.0 - inside) * SIZE
    flat = outer(radial) / layer_size(r - RADIUS)[:, None, None] ** 2 + outer(around) / arc[:, None, None] ** 2
    return flat + np.diag([0.0, 0.0, 1.0]) / SIZE**2


def cube() -> Surface:
    """Return the unit cube from the origin."""
    surface = box(n=CELLS)
    return surface.with_points(surface.points - surface.points.min(axis=0))


def cube_cylinder() -> Surface:
    """Return the unit cube without a quarter cylinder around the z axis."""
    angle = np.linspace(0.0, 0.5 * np.pi, 2 * CELLS + 1)
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ray[-1, 0] = 0.0
    side = ray / ray.max(axis=1, keepdims=True)  # where rays leave the cube
    away, height = np.linspace(0.0, 1.0, CELLS + 1)[:, None], np.linspace(0.0, 1.0, 2 * CELLS + 1)
    plan = RADIUS * ray[:, None] + away * (side - RADIUS * ray)[:, None]

    def wall(line: Floats) -> Floats:
        z = np.broadcast_to(height[None, :, None], (len(line), len(height), 1))
        return np.concatenate([np.broadcast_to(line[:, None], (*z.shape[:2], 2)), z], axis=2)

    def level(z: float) -> Floats:
        return np.pad(plan, ((0, 0), (0, 0), (0, 1)), constant_values=z)

    grids = [level(0.0), level(1.0)[::-1]]
    grids += [wall(plan[::-1, 0]), wall(plan[:, -1]), wall(plan[0]), wall(plan[-1, ::-1])]
    starts = np.cumsum([0, *(grid.shape[0] * grid.shape[1] for grid in grids)])
    faces = [grid_faces(*grid.shape[:2]) + start for grid, start in zip(grids, starts, strict=False)]
    points = np.concatenate([grid.reshape(-1, 3) for grid in grids])
    return anisomesh.prepare(Surface(points, np.concatenate(faces)), weld_tolerance=1e-9).surface


CASES: dict[str, tuple[Callable[[], Surface], Metric]] = {
    "linear": (cube, linear),
    "polar-1": (cube_cylinder, lambda points: polar(points, fine_arcs=False)),
    "polar-2": (cube_cylinder, lambda points: polar(points, fine_arcs=True)),
}


def by_anisomesh(surface: Surface, metric: Metric) -> Surface:
    """Return one remesh with the metric as a source; lengths are in model units, as edge_length is."""
    frame = unit_frame(surface.points)

    def source(working: Surface) -> anisomesh.MetricField:
        return anisomesh.MetricField(tensors=metric(frame.to_model(working.points)))

    return anisomesh.remesh(surface, metric=source, edge_length=1.0).surface


def by_mmgs(surface: Surface, metric: Metric) -> Surface:
    """Return the last of several remeshes with the metric at vertices."""
    import mmgpy

    for _ in range(ROUNDS):
        mesh = mmgpy.MmgMeshS(np.array(surface.points), np.array(surface.faces))
        upper = metric(surface.points)[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]
        mesh.set_field("tensor", np.ascontiguousarray(upper))
        mesh.remesh(hgrad=-1.0, verbose=-1)  # the metric alone decides
        surface = Surface(mesh.get_vertices(), mesh.get_triangles())
    return surface


def lengths(surface: Surface, metric: Metric) -> Floats:
    """Return the lengths (E,) of edges in a metric, integrated along them."""
    start, end = surface.points[surface.edges].transpose(1, 0, 2)
    total = np.zeros(len(start))
    for place, weight in zip(*_QUADRATURE, strict=True):
        tensors = metric(start + 0.5 * (1.0 + place) * (end - start))
        total += 0.5 * weight * np.sqrt(np.einsum("ex,exy,ey->e", end - start, tensors, end - start))
    return total


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    arguments = parser.parse_args()
    methods = {"anisomesh": by_anisomesh, "mmgs": by_mmgs}
    if importlib.util.find_spec("mmgpy") is None:
        print("mmgs is left out: mmgpy is not installed (pip install mmgpy)")
        del methods["mmgs"]
    for case in arguments.cases:
        make, metric = CASES[case]
        for name, method in methods.items():
            start = time.perf_counter()
            result = method(make(), metric)
            seconds = time.perf_counter() - start
            length = lengths(result, metric)
            share = np.mean((length > 0.5**0.5) & (length < 2.0**0.5))
            low, high = np.quantile(length, [0.05, 0.95])
            spread = f"{share:6.1%} {length.mean():5.2f} {low:5.2f} {high:5.2f}"
            print(f"{case:8} {name:10} {result.n_points:6,} {spread} {seconds:6.1f} s", flush=True)


if __name__ == "__main__":
    main()
