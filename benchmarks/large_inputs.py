"""Time, memory and error of a remesh of a large input to few vertices, with and without its reduction.

Usage: python benchmarks/large_inputs.py [--faces 1450000] [--vertices 5000] [--mesh FILE] [--whole]
Run it on an idle machine. The input is a knotted tube with waves of two lengths on it, made by code, or a file. Each
remesh is a process of its own, kernels compiled. With --whole the input is remeshed without a reduction too, which
takes minutes, and the errors are compared.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import anisomesh
from anisomesh.mesh.distance import surface_distance
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import trefoil_knot

ALONG_PER_AROUND = 10  # rows of the grid of the tube
WAVES = ((0.03, (9.0, 9.0, 9.0)), (0.004, (31.0, 29.0, 33.0)))  # amplitude and wave numbers, tube radius .3
DISTANCE_SAMPLES = 200_000


def tube(n_faces: int) -> Surface:
    """Return a closed surface with detail of two sizes, of about this many faces."""
    n_around = round((n_faces / (2 * ALONG_PER_AROUND)) ** 0.5)
    plain = trefoil_knot(n_along=ALONG_PER_AROUND * n_around, n_around=n_around)
    height = sum(size * np.prod(np.sin(plain.points * waves + 1.0), axis=1) for size, waves in WAVES)
    return Surface(plain.points + height[:, None] * plain.point_normals, plain.faces)


def run(source: Path, out: Path, n_vertices: int, *options: str) -> tuple[float, float, float]:
    """Return wall seconds, processor seconds and the peak of memory in GB of a remesh in a process of its own."""
    command = [sys.executable, "-m", "anisomesh", "remesh", source, "-n", n_vertices, "-o", out, "--quiet", *options]
    start = time.perf_counter()
    process = subprocess.Popen([str(word) for word in command])
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    if status != 0:
        raise SystemExit(f"the remesh of {source} failed")
    return wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--faces", type=int, default=1_450_000, help="of the tube")
    parser.add_argument("--vertices", type=int, default=5_000, help="of the result")
    parser.add_argument("--mesh", type=Path, help="a file in place of the tube")
    parser.add_argument("--whole", action="store_true", help="remesh without a reduction too")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        source = args.mesh or folder / "tube.ply"
        if args.mesh is None:
            anisomesh.save(tube(args.faces), source)
        surface = anisomesh.load(source)
        warm = folder / "warm.ply"
        anisomesh.save(tube(70_000), warm)
        run(warm, folder / "warm-out.ply", 300)  # compiles the kernels if need be
        print(f"{surface.n_faces:,} faces to {args.vertices:,} vertices\n")
        print("| input | wall s | processor s | peak GB | RMS | largest distance |\n|---|---|---|---|---|---|")
        for kind, options in (("reduced", ()), ("whole", ("--no-reduce",)))[: 1 + args.whole]:
            wall, processor, memory = run(source, folder / "out.ply", args.vertices, *options)
            found = surface_distance(anisomesh.load(folder / "out.ply"), surface, samples=DISTANCE_SAMPLES)
            rms, largest = found.rms / surface.diagonal, found.hausdorff / surface.diagonal
            print(f"| {kind} | {wall:.1f} | {processor:.1f} | {memory:.2f} | {rms:.3e} | {largest:.2e} |", flush=True)


if __name__ == "__main__":
    main()
