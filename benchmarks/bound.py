"""Distance of remeshes of curved shapes over the least that a mesh with as many triangles can have.

Usage: python benchmarks/bound.py [--vertices 500 1000 2000]

The root mean squared distance of a continuous piecewise linear surface with triangles of area A from a patch of
Gaussian curvature K is at best A sqrt(|K| / 180) for K > 0 and A sqrt(|K| / 90) for K < 0, without being tied to the
surface at its vertices. With the best density of triangles that is sqrt(I^3 / S) / n for n triangles on a surface of
area S, where I is the integral of (c |K|)^(1/3) with c = 1/180 or 1/90. The bound is asymptotic.
"""

from __future__ import annotations

import argparse

import numpy as np

import anisomesh
from anisomesh.bench.methods import METHODS
from anisomesh.mesh.distance import surface_distance
from anisomesh.mesh.geometry import corner_angles
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import ellipsoid, sphere, torus

SHAPES = {
    "sphere": sphere(6),
    "ellipsoid 3:2:1": ellipsoid((3.0, 2.0, 1.0), subdivisions=6),
    "torus 6:1": torus(6.0, 1.0, n_major=384, n_minor=96),
}
FINE_SAMPLES = 200_000


def least_rms(shape: Surface, n_faces: int) -> float:
    """Return the bound for a number of triangles, in model units, from the angle defects of a fine mesh."""
    angles = np.bincount(shape.faces.ravel(), corner_angles(shape.points[shape.faces]).ravel())
    area = np.bincount(shape.faces.ravel(), np.repeat(shape.face_areas / 3.0, 3))
    curvature = (2.0 * np.pi - angles) / area
    factor = np.where(curvature > 0.0, 1.0 / 180.0, 1.0 / 90.0)
    integral = float((area * np.cbrt(factor * np.abs(curvature))).sum())
    return float(np.sqrt(integral**3 / shape.area) / n_faces)


def remeshes(shape: Surface, n: int) -> dict[str, Surface]:
    """Return remeshes with n vertices, by name."""
    made = {"quadric decimation (vtk)": METHODS["vtk-quadric"].run(shape, n, 0, {}).surface}
    for name, options in {
        "tessellation": {"fit": False},
        "default": {},
        "approximation, tessellation": {"metric": "approximation", "fit": False},
        "approximation": {"metric": "approximation"},
    }.items():
        made[name] = anisomesh.remesh(shape, n_vertices=n, embedding="direct", **options).surface
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vertices", type=int, nargs="+", default=[500, 1_000, 2_000])
    options = parser.parse_args()
    print("| shape | method | " + " | ".join(f"{n:,} vertices" for n in options.vertices) + " |")
    print("|" + "---|" * (2 + len(options.vertices)))
    for name, shape in SHAPES.items():
        rows: dict[str, list[str]] = {}
        for n in options.vertices:
            for method, mesh in remeshes(shape, n).items():
                rms = surface_distance(shape, mesh, samples=FINE_SAMPLES).rms
                rows.setdefault(method, []).append(f"{rms / least_rms(shape, mesh.n_faces):.2f}")
        for method, cells in rows.items():
            print(f"| {name} | {method} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
