"""Time of the neighbour kernel, of the graphs, and of both networks with random weights, on one core.

Usage: python benchmarks/network.py [--points 6000]
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable

import numpy as np
import torch

from anisomesh.learn.messages import largest_by_scatter, largest_of_neighbours
from anisomesh.learn.network import NetworkOptions, StretchNetwork
from anisomesh.learn.paper import PaperNetwork, PaperOptions, seen_of
from anisomesh.learn.pyramid import N_EDGE, pyramid
from anisomesh.surface.shapes import torus

RUNS = 10
CHANNELS = 64


def best(work: Callable[[], object]) -> float:
    """Return the least of some times of this work, in milliseconds, after one that does not count."""
    work()
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=6_000)
    n = parser.parse_args().points
    torch.set_num_threads(1)
    torch.manual_seed(0)
    around = round(np.sqrt(2.4 * n))
    ring = torus(1.0, 0.35, around, round(n / around))
    shaken = np.random.default_rng(0).normal(0.0, 0.1 * ring.edge_lengths.mean(), ring.points.shape)
    surface = ring.with_points((ring.points + shaken) / ring.diagonal)
    seen, options = pyramid(surface, NetworkOptions().scales), NetworkOptions()
    graph, paper_sees = seen.scales[0].graph, seen_of(surface)
    network, paper = StretchNetwork(options).eval(), PaperNetwork(PaperOptions()).eval()
    sent, weight = torch.randn(surface.n_points, CHANNELS), torch.randn(N_EDGE, CHANNELS)
    with torch.inference_mode():
        rows = [
            ("neighbour kernel", best(lambda: largest_of_neighbours(sent, weight, graph))),
            ("the same by scatter", best(lambda: largest_by_scatter(sent, weight, graph))),
            ("graphs of all scales", best(lambda: pyramid(surface, options.scales))),
            ("default network", best(lambda: network(seen))),
            ("paper's network, 64 channels", best(lambda: paper(paper_sees))),
        ]
    counts = [sum(value.numel() for value in made.parameters()) for made in (network, paper)]
    print(f"load {os.getloadavg()[0]:.2f}; {surface.n_points:,} points; parameters {counts[0]:,} and {counts[1]:,}")
    for name, milliseconds in rows:
        print(f"{name}: {milliseconds:.1f} ms")


if __name__ == "__main__":
    main()
