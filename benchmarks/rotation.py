"""Change of the metric that a network predicts when the mesh is rotated: the default network and the paper's.

Usage: python benchmarks/rotation.py [--data DIR] [--meshes 12] [WEIGHTS ...]

Each mesh of DIR/test (ANISOMESH_DATA; procedural shapes without it) is rotated, and the predicted metric is rotated
back. The figure is the mean over the points of the Frobenius norm of the difference of the logarithms, over the mean
norm: 0 for an equivariant network, about 1.4 for two unrelated metrics.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from anisomesh.bench.inputs import make_shape
from anisomesh.io.meshes import load
from anisomesh.learn.inference.predict import predict
from anisomesh.learn.inference.pretrained import pretrained_networks
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.repair.prepare import prepare

SHAPES = ("ring:3000", "part:3000")
MAX_POINTS = 60_000  # larger meshes are skipped
ROTATIONS = {"a quarter about z": [0.0, 0.0, 0.5 * np.pi], "30 degrees about x": [np.pi / 6.0, 0.0, 0.0], "any": None}


def logarithm(tensors: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the logarithms of symmetric positive definite matrices (N, 3, 3)."""
    values, vectors = np.linalg.eigh(tensors)
    return np.asarray((vectors * np.log(values)[:, None, :]) @ vectors.transpose(0, 2, 1))


def change(surface: Surface, weights: str, rotation: Rotation) -> float:
    """Return the relative change of the logarithm of the metric."""
    matrix = rotation.as_matrix()
    before = logarithm(predict(surface, weights, denoise=False).tensors)
    rotated = logarithm(predict(surface.with_points(surface.points @ matrix.T), weights, denoise=False).tensors)
    difference = np.linalg.norm(matrix.T @ rotated @ matrix - before, axis=(1, 2)).mean()
    return float(difference / np.linalg.norm(before, axis=(1, 2)).mean())


def surfaces(data: Path | None, count: int) -> list[Surface]:
    if data is None:
        found = [make_shape(name) for name in SHAPES]
    else:
        found = [prepare(load(path)).surface for path in sorted(data.glob("test/*.ply"))]
        found = [surface for surface in found if surface.n_points <= MAX_POINTS][:count]
    return [surface.with_points(unit_frame(surface.points).to_unit(surface.points)) for surface in found]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("weights", nargs="*", default=pretrained_networks())
    parser.add_argument("--data", type=Path, default=os.environ.get("ANISOMESH_DATA"))
    parser.add_argument("--meshes", type=int, default=12)
    asked = parser.parse_args()
    meshes = surfaces(asked.data, asked.meshes)
    print(f"{len(meshes)} meshes\n| network | {' | '.join(ROTATIONS)} |\n|---|{'---|' * len(ROTATIONS)}")
    for weights in asked.weights:
        rng = np.random.default_rng(0)
        cells = []
        for vector in ROTATIONS.values():
            rotations = [Rotation.random(rng=rng) if vector is None else Rotation.from_rotvec(vector) for _ in meshes]
            cells.append(
                np.mean([change(*each) for each in zip(meshes, [weights] * len(meshes), rotations, strict=True)])
            )
        print(f"| {weights} | {' | '.join(f'{value:.4f}' for value in cells)} |", flush=True)


if __name__ == "__main__":
    main()
