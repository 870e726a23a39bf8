"""Quality and distance of remeshes of noisy shapes with exact curvature, for each source of the metric.

Usage: python benchmarks/noise.py [--shapes 6]

The quality G is with respect to the exact metric of the clean shape, the distance is to the clean mesh. "exact metric"
remeshes the noisy surface with the metric of the clean one, a bound for every source of the metric.
"""

from __future__ import annotations

import argparse
import os

import numpy as np

import anisomesh
from anisomesh.denoise.noise import with_noise
from anisomesh.learn.data.make import items_of_blobs
from anisomesh.learn.data.recipe import Recipe
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.distance import surface_distance
from anisomesh.metric.quality import anisotropic_quality
from anisomesh.metric.tensors import metric_root
from anisomesh.metric.transfer import transfer_metric_roots
from anisomesh.shapes.implicit import Blobs

FIRST_SEED = 1_000  # not a shape of the training sets
N_POINTS, N_VERTICES = 5_000, 1_000
SIZES = (0.0, 0.1, 0.3, 0.5)
SAMPLES = 20_000


def figures(seed: int) -> dict[tuple[float, str], tuple[float, float]]:
    """Return G and the root mean square distance by noise and method, on one shape."""
    rng = np.random.default_rng(seed)
    (even,) = items_of_blobs(Blobs.random(rng), Recipe(target=N_POINTS, variants=()), rng, anisomesh.remesh)
    clean, tensors = even.item.surface, even.item.tensors
    reference, roots = ClosestPoints(clean), metric_root(tensors)
    found = {}
    for size in SIZES:
        noisy = with_noise(clean, size, np.random.default_rng(seed))
        methods = {
            "direct": {"embedding": "direct"},
            "exact metric": {"metric": tensors},
            "filtered": {"embedding": "filtered"},
            "neural": {"embedding": "neural"},
            "hybrid": {"embedding": "hybrid"},
        }
        for name, options in methods.items():
            mesh = anisomesh.remesh(noisy, n_vertices=N_VERTICES, threads=1, **options).surface
            there = transfer_metric_roots(reference, roots, mesh.points)
            quality = float(anisotropic_quality(mesh.points, mesh.faces, there).mean())
            found[size, name] = quality, surface_distance(clean, mesh, SAMPLES).rms
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shapes", type=int, default=6)
    runs = [figures(FIRST_SEED + k) for k in range(parser.parse_args().shapes)]
    print(f"load {os.getloadavg()[0]:.2f}; {len(runs)} shapes, {N_POINTS:,} points, {N_VERTICES:,} vertices")
    print("| noise, mean edges | metric | G | RMS x1e-4 |\n|---|---|---|---|")
    for size, name in runs[0]:
        quality, distance = np.array([run[size, name] for run in runs]).T
        print(f"| {size:g} | {name} | {quality.mean():.3f} | {1e4 * np.exp(np.log(distance).mean()):.2f} |")


if __name__ == "__main__":
    main()
