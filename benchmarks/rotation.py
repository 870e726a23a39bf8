"""How much the answer of a network changes when the mesh is turned: the default network and the paper's.

Usage: python benchmarks/rotation.py [--data DIR] [--meshes 12] [WEIGHTS ...]

Every mesh of DIR/test (ANISOMESH_DATA; without it shapes made by code) is turned at random, and the metric that the
network finds on it is turned back. Its logarithm is compared with that of the mesh as it was: mean over the points of
the Frobenius norm of the difference, over the mean norm. 0 is an answer that turns with the mesh; two answers that have
nothing to do with each other are about 1.4 apart.
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
from anisomesh.learn.inference.pretrained import shipped_weights
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.repair.prepare import prepare

SHAPES = ("ring:3000", "part:3000")
MOST = 60_000  # points of a mesh
TURNS = {"a quarter about z": [0.0, 0.0, 0.5 * np.pi], "30 degrees about x": [np.pi / 6.0, 0.0, 0.0], "any": None}


def logarithm(tensors: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    values, vectors = np.linalg.eigh(tensors)
    return np.asarray((vectors * np.log(values)[:, None, :]) @ vectors.transpose(0, 2, 1))


def change(surface: Surface, weights: str, rotation: Rotation) -> float:
    """Return the relative change of the logarithm of the metric."""
    turn = rotation.as_matrix()
    before = logarithm(predict(surface, weights, denoise=False).tensors)
    turned = logarithm(predict(surface.with_points(surface.points @ turn.T), weights, denoise=False).tensors)
    difference = np.linalg.norm(turn.T @ turned @ turn - before, axis=(1, 2)).mean()
    return float(difference / np.linalg.norm(before, axis=(1, 2)).mean())


def surfaces(data: Path | None, count: int) -> list[Surface]:
    if data is None:
        found = [make_shape(name) for name in SHAPES]
    else:
        found = [prepare(load(path)).surface for path in sorted(data.glob("test/*.ply"))]
        found = [surface for surface in found if surface.n_points <= MOST][:count]
    return [surface.with_points(unit_frame(surface.points).to_unit(surface.points)) for surface in found]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("weights", nargs="*", default=list(shipped_weights()))
    parser.add_argument("--data", type=Path, default=os.environ.get("ANISOMESH_DATA"))
    parser.add_argument("--meshes", type=int, default=12)
    asked = parser.parse_args()
    meshes = surfaces(asked.data, asked.meshes)
    print(f"{len(meshes)} meshes\n| network | {' | '.join(TURNS)} |\n|---|{'---|' * len(TURNS)}")
    for weights in asked.weights:
        rng = np.random.default_rng(0)
        cells = []
        for vector in TURNS.values():
            turns = [Rotation.random(rng=rng) if vector is None else Rotation.from_rotvec(vector) for _ in meshes]
            cells.append(np.mean([change(*each) for each in zip(meshes, [weights] * len(meshes), turns, strict=True)]))
        print(f"| {weights} | {' | '.join(f'{value:.4f}' for value in cells)} |", flush=True)


if __name__ == "__main__":
    main()
