"""Error of the metric predicted by a network on the validation items of a data set.

Usage: python benchmarks/validation.py ITEMS [WEIGHTS ...]

ITEMS is a folder made by ``anisomesh dataset build``; WEIGHTS are files, or names of pretrained networks. The error of
an item, without noise, is the Frobenius norm of the difference of the logarithms of the two metrics, averaged over the
surface where the curvature is reliable, over the norm for a prediction of no stretch. A row is the mean over items of
one kind of mesh, separately for designed shapes (with many flat edges, such as machine parts) and others.
"""

from __future__ import annotations

import argparse
import os
from collections import defaultdict
from pathlib import Path

import numpy as np

from anisomesh.features.detect import share_of_flat_edges
from anisomesh.learn.data.items import Item, load_item
from anisomesh.learn.data.manifest import files_of
from anisomesh.learn.inference.predict import predict
from anisomesh.learn.inference.pretrained import pretrained_networks
from anisomesh.mesh.geometry import sums_at_points
from anisomesh.resolve import DESIGNED_SHARE
from rotation import logarithm


def error(item: Item, weights: str) -> float:
    """Return the error of the predicted metric over the error of no stretch."""
    surface, target = item.surface, logarithm(item.tensors)
    found = logarithm(predict(surface, weights, denoise=False).tensors)
    area = sums_at_points(surface.face_areas, surface.faces, surface.n_points) * item.trusted
    error_sum, target_sum = (area @ np.linalg.norm(each, axis=(1, 2)) for each in (found - target, target))
    return float(error_sum / target_sum)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("items", type=Path)
    parser.add_argument("weights", nargs="*", default=pretrained_networks())
    asked = parser.parse_args()
    groups: dict[tuple[str, str], list[Item]] = defaultdict(list)
    paths = files_of(asked.items).validation
    for path in paths:
        name, kind = path.stem.rsplit(".", 1)
        even = load_item(path.with_name(f"{name}.even.npz")).surface
        designed = "designed" if share_of_flat_edges(even) >= DESIGNED_SHARE else "other"
        groups[kind, designed].append(load_item(path))
    print(f"load {os.getloadavg()[0]:.2f}; {len(paths)} items")
    print(f"| mesh | shape | items | {' | '.join(Path(each).stem for each in asked.weights)} |")
    print(f"|---|---|---|{'---|' * len(asked.weights)}")
    for (kind, designed), items in sorted(groups.items()):
        means = [np.mean([error(item, weights) for item in items]) for weights in asked.weights]
        print(f"| {kind} | {designed} | {len(items)} | {' | '.join(f'{mean:.3f}' for mean in means)} |", flush=True)


if __name__ == "__main__":
    main()
