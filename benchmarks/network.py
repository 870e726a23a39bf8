"""Time of the neighbour kernels, of the networks, and of all that takes a mesh to its embedding, on one core.

Usage: python benchmarks/network.py [--points 6000]

The paper's network is also timed as written with PyTorch Geometric, if that is installed (extra: peers).
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import time
from collections.abc import Callable

import numpy as np
import torch

from anisomesh.embedding.direct import embed
from anisomesh.learn.inference.predict import predict
from anisomesh.learn.models.hierarchy import N_EDGE, pyramid
from anisomesh.learn.models.messages import (
    largest_by_scatter,
    largest_of_neighbours,
    mean_by_scatter,
    mean_of_neighbours,
)
from anisomesh.learn.models.paper import PaperNetwork, PaperOptions, seen_of
from anisomesh.learn.models.stretch import NetworkOptions, StretchNetwork
from anisomesh.mesh.surface import Surface
from anisomesh.metric.tensors import compute_metric
from anisomesh.shapes.analytic import torus

RUNS = 10
CHANNELS = 64
PAPER_CHANNELS = 256
STEPS = (10, 3)  # of the direct embedding: the default, and as few as give most of it


def best(work: Callable[[], object]) -> float:
    """Return the least of some times of this work, in milliseconds, after one that does not count."""
    work()
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times)


def ring(n: int) -> Surface:
    """Return a torus of about n points with a little noise, too little to be taken away."""
    around = round(np.sqrt(2.4 * n))
    surface = torus(1.0, 0.35, around, round(n / around))
    shaken = np.random.default_rng(0).normal(0.0, 0.02 * surface.edge_lengths.mean(), surface.points.shape)
    return surface.with_points((surface.points + shaken) / surface.diagonal)


def kernels(surface: Surface) -> list[tuple[str, float]]:
    graph = pyramid(surface, NetworkOptions().scales).scales[0].graph
    own, sent = (torch.randn(surface.n_points, CHANNELS) for _ in range(2))
    weight = torch.randn(N_EDGE, CHANNELS)
    return [
        ("mean of neighbours, kernel", best(lambda: mean_of_neighbours(own, sent, weight, graph, 0.1))),
        ("mean of neighbours, scatter", best(lambda: mean_by_scatter(own, sent, weight, graph, 0.1))),
        ("largest of neighbours, kernel", best(lambda: largest_of_neighbours(sent, weight, graph))),
        ("largest of neighbours, scatter", best(lambda: largest_by_scatter(sent, weight, graph))),
    ]


def networks(surface: Surface) -> list[tuple[str, float]]:
    options = NetworkOptions()
    seen, paper_sees = pyramid(surface, options.scales), seen_of(surface)
    network = StretchNetwork(options).eval()
    paper = PaperNetwork(PaperOptions(channels=PAPER_CHANNELS)).eval()
    count = sum(value.numel() for value in network.parameters())
    rows = [
        ("graphs of all scales", best(lambda: pyramid(surface, options.scales))),
        (f"default network, {count:,} parameters", best(lambda: network(seen))),
        (f"paper's network, ours, {PAPER_CHANNELS} channels", best(lambda: paper(paper_sees))),
    ]
    if importlib.util.find_spec("torch_geometric") is None:
        return rows
    from pyg_network import Network

    theirs = Network(PAPER_CHANNELS).eval()
    ends = np.concatenate([surface.edges, surface.edges[:, ::-1]]).T
    edges, positions = torch.from_numpy(ends.astype(np.int64)), torch.from_numpy(np.array(surface.points))
    count = sum(value.numel() for value in theirs.parameters())
    milliseconds = best(lambda: theirs(paper_sees.values, edges, positions))
    return [*rows, (f"paper's network, PyTorch Geometric, {count:,} parameters", milliseconds)]


def embeddings(surface: Surface) -> list[tuple[str, float]]:
    tensors = compute_metric(surface)
    found = predict(surface)
    assert found.noise == 0.0
    rows = [("curvature metric", best(lambda: compute_metric(surface)))]
    for steps in STEPS:
        made = best(lambda steps=steps: embed(surface, tensors, max_iterations=steps))
        whole = best(lambda steps=steps: embed(surface, predict(surface).tensors, max_iterations=steps))
        rows += [
            (f"direct embedding, {steps} steps, metric given", made),
            (f"direct embedding, {steps} steps, with its curvature metric", rows[0][1] + made),
            (f"neural embedding: graphs, network, {steps} steps", whole),
        ]
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=6_000)
    torch.set_num_threads(1)
    torch.manual_seed(0)
    surface = ring(parser.parse_args().points)
    with torch.inference_mode():
        rows = [*kernels(surface), *networks(surface), *embeddings(surface)]
    print(f"load {os.getloadavg()[0]:.2f}; {surface.n_points:,} points; milliseconds")
    for name, milliseconds in rows:
        print(f"{name}: {milliseconds:.1f}")


if __name__ == "__main__":
    main()
