"""Time message passing, the networks, and the whole way from a mesh to its embedding, on one core.

Usage: python benchmarks/network.py [--points 6000]

The paper's network is also timed in PyTorch Geometric, if that is installed (extra: peers).
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
from anisomesh.learn.architecture import NetworkOptions, PaperOptions
from anisomesh.learn.graphs.hierarchy import N_EDGE_FEATURES, graph_hierarchy
from anisomesh.learn.inference.predict import predict
from anisomesh.learn.models.messages import (
    max_aggregation,
    max_by_scatter,
    mean_aggregation,
    mean_by_scatter,
)
from anisomesh.learn.models.paper import PaperNetwork, paper_input
from anisomesh.learn.models.stretch import StretchNetwork
from anisomesh.mesh.surface import Surface
from anisomesh.metric.tensors import compute_metric
from anisomesh.shapes.analytic import torus

RUNS = 10
CHANNELS = 64
PAPER_CHANNELS = 256
EMBEDDING_ITERATIONS = (10, 3)  # the default, and few that give most of the quality


def best(work: Callable[[], object]) -> float:
    """Return the least time of the work over ``RUNS`` runs, in milliseconds, after a warm-up run."""
    work()
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times)


def ring(n: int) -> Surface:
    """Return a torus of about n points with noise too small to be removed."""
    around = round(np.sqrt(2.4 * n))
    surface = torus(1.0, 0.35, around, round(n / around))
    shaken = np.random.default_rng(0).normal(0.0, 0.02 * surface.edge_lengths.mean(), surface.points.shape)
    return surface.with_points((surface.points + shaken) / surface.diagonal)


def kernels(surface: Surface) -> list[tuple[str, float]]:
    graph = graph_hierarchy(surface, NetworkOptions().scales).levels[0].graph
    own, sent = (torch.randn(surface.n_points, CHANNELS) for _ in range(2))
    weight = torch.randn(N_EDGE_FEATURES, CHANNELS)
    return [
        ("mean aggregation, kernel", best(lambda: mean_aggregation(own, sent, weight, graph, 0.1))),
        ("mean aggregation, scatter", best(lambda: mean_by_scatter(own, sent, weight, graph, 0.1))),
        ("maximum aggregation, kernel", best(lambda: max_aggregation(sent, weight, graph))),
        ("maximum aggregation, scatter", best(lambda: max_by_scatter(sent, weight, graph))),
    ]


def networks(surface: Surface) -> list[tuple[str, float]]:
    options = NetworkOptions()
    hierarchy, inputs = graph_hierarchy(surface, options.scales), paper_input(surface)
    network = StretchNetwork(options).eval()
    paper = PaperNetwork(PaperOptions(channels=PAPER_CHANNELS)).eval()
    count = sum(value.numel() for value in network.parameters())
    rows = [
        ("graph hierarchy", best(lambda: graph_hierarchy(surface, options.scales))),
        (f"default network, {count:,} parameters", best(lambda: network(hierarchy))),
        (f"paper's network, ours, {PAPER_CHANNELS} channels", best(lambda: paper(inputs))),
    ]
    if importlib.util.find_spec("torch_geometric") is None:
        return rows
    from pyg_network import Network

    theirs = Network(PAPER_CHANNELS).eval()
    ends = np.concatenate([surface.edges, surface.edges[:, ::-1]]).T
    edges, positions = torch.from_numpy(ends.astype(np.int64)), torch.from_numpy(np.array(surface.points))
    count = sum(value.numel() for value in theirs.parameters())
    milliseconds = best(lambda: theirs(inputs.values, edges, positions))
    return [*rows, (f"paper's network, PyTorch Geometric, {count:,} parameters", milliseconds)]


def embeddings(surface: Surface) -> list[tuple[str, float]]:
    tensors = compute_metric(surface)
    found = predict(surface)
    assert found.noise == 0.0
    rows = [("curvature metric", best(lambda: compute_metric(surface)))]
    for iterations in EMBEDDING_ITERATIONS:
        made = best(lambda n=iterations: embed(surface, tensors, max_iterations=n))
        whole = best(lambda n=iterations: embed(surface, predict(surface).tensors, max_iterations=n))
        rows += [
            (f"direct embedding, {iterations} iterations, metric precomputed", made),
            (f"direct embedding, {iterations} iterations, with the curvature metric", rows[0][1] + made),
            (f"neural embedding: hierarchy, network, {iterations} iterations", whole),
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
