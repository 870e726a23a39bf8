"""Errors of normals and points after the removal of noise, for each way to remove it.

Usage: python benchmarks/denoising.py [--pairs FOLDER] [--items DATASET] [--filter WEIGHTS] [--limit 40]

--pairs: meshes NAME-clean.ply and NAME-noisy.SIZE.ply with the same faces, and published results for them, named
NAME-noisy.SIZE-OTHER.ply. --items: the validation items of a data set, with noise of each size and kind. "Network +
bilateral" and "network + learnt" are two filters of normals behind the network; --filter gives weights of the second.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

import anisomesh
from anisomesh.denoise.classical import classically_denoised
from anisomesh.denoise.filters import bilateral_filtered
from anisomesh.denoise.noise import NOISES, with_noise
from anisomesh.learn.data.items import load_item
from anisomesh.learn.data.manifest import files_of
from anisomesh.learn.graphs.faces import FILTER_ROUNDS, NORMAL_WIDTH
from anisomesh.learn.inference.normals import NormalFilterInference
from anisomesh.learn.inference.predict import moved_by_network
from anisomesh.learn.inference.pretrained import NORMAL_FILTER, weights_path
from anisomesh.learn.weights_file import read_weights
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.surface import Surface

SIZES = (0.1, 0.3, 0.5)
Ways = dict[str, Callable[[Surface], Surface]]


def ways(weights: Path) -> Ways:
    """Return the ways to remove noise by their names."""
    known = read_weights(weights)
    learnt = NormalFilterInference(known.options, known.arrays)

    def bilateral(noisy: Surface) -> Surface:
        moved = moved_by_network(noisy)
        return moved if moved is noisy else bilateral_filtered(moved, rounds=FILTER_ROUNDS, normal_width=NORMAL_WIDTH)

    def filtered(noisy: Surface) -> Surface:
        moved = moved_by_network(noisy)
        return moved if moved is noisy else learnt(noisy, moved)

    return {
        "noisy": lambda noisy: noisy,
        "classical": classically_denoised,
        "network + bilateral": bilateral,
        "network + learnt": filtered,
    }


def errors(denoised: Surface, clean: Surface) -> tuple[float, float]:
    """Return the mean angle between the normals of the faces, in degrees, and the RMS distance of points, in edges."""
    cosine = np.einsum("fx,fx->f", denoised.face_normals, clean.face_normals)
    angle = float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).mean())
    squared = ClosestPoints(clean).squared_distances(denoised.points)
    return angle, float(np.sqrt(squared.mean()) / clean.edge_lengths.mean())


def of_pairs(folder: Path, known: Ways) -> None:
    """Print the errors of each pair of a folder, and of published results."""
    print(f"| mesh | {' | '.join(known)} | published |\n|---|{'---|' * (len(known) + 1)}")
    for path in sorted(folder.glob("*-noisy.*.ply")):
        if path.stem.count("-") > 2:
            continue
        name, clean = path.stem, anisomesh.load(folder / f"{path.stem.partition('-noisy')[0]}-clean.ply")
        frame = unit_frame(clean.points)
        clean, noisy = (s.with_points(frame.to_unit(s.points)) for s in (clean, anisomesh.load(path)))
        cells = ["{:.2f}, {:.3f}".format(*errors(way(noisy), clean)) for way in known.values()]
        others = [anisomesh.load(other) for other in sorted(folder.glob(f"{name}-*.ply"))]
        others = [other.with_points(frame.to_unit(other.points)) for other in others]
        cells += ["{:.2f}, {:.3f}".format(*errors(other, clean)) for other in others[:1]] or [""]
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


def of_items(folder: Path, known: Ways, limit: int) -> None:
    """Print the mean errors over validation items for each size and kind of noise."""
    files = files_of(folder).validation
    chosen = [load_item(path).surface for path in files[:: max(1, len(files) // limit)]]
    print(f"{len(chosen)} items\n| noise | {' | '.join(known)} |\n|---|{'---|' * len(known)}")
    for size in SIZES:
        for kind in NOISES:
            rows = []
            for number, clean in enumerate(chosen):
                noisy = with_noise(clean, size, np.random.default_rng(number), kind)
                rows.append([errors(way(noisy), clean) for way in known.values()])
            mean = np.array(rows).mean(axis=0)
            print(f"| {size:g}, {kind} | {' | '.join(f'{a:.2f}, {r:.4f}' for a, r in mean)} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=Path)
    parser.add_argument("--items", type=Path)
    parser.add_argument("--filter", type=Path, default=weights_path(NORMAL_FILTER))
    parser.add_argument("--limit", type=int, default=40, help="of validation items")
    args = parser.parse_args()
    known = ways(args.filter)
    print(f"load {os.getloadavg()[0]:.2f}; degrees, edges")
    if args.pairs is not None:
        of_pairs(args.pairs, known)
    if args.items is not None:
        of_items(args.items, known, args.limit)


if __name__ == "__main__":
    main()
