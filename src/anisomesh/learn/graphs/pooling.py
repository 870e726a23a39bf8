"""Pooling of graphs by kept nodes, as in the network of the paper."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from anisomesh.learn.graphs.graph import Graph, graph_from_edges

_N_INTERPOLATED = 3  # kept nodes that a dropped node is interpolated from

Ints = npt.NDArray[np.int64]


def interpolation_weights(points: npt.NDArray[np.float64], kept: Ints) -> tuple[Ints, npt.NDArray[np.float32]]:
    """Return for each point (V, 3) the nearest kept points (V, k) and their weights by inverse distance (V, k)."""
    k = min(_N_INTERPOLATED, len(kept))
    distance, nearest = cKDTree(points[kept]).query(points, k=k)
    distance, nearest = distance.reshape(len(points), k), nearest.reshape(len(points), k)
    weight = 1.0 / np.maximum(distance, 1e-12)
    weight /= weight.sum(axis=1, keepdims=True)
    return nearest.astype(np.int64), weight.astype(np.float32)


def connected_within_two_edges(graph: Graph, kept: Ints) -> Graph:
    """Return the graph of the kept nodes, with an edge where a path of one or two edges connects two of them."""
    n = graph.n_nodes
    adjacency = csr_array((np.ones(len(graph.neighbour), dtype=np.float32), graph.neighbour, graph.first), shape=(n, n))
    rows = adjacency[kept]
    near = ((rows @ adjacency) + rows)[:, kept].tocoo()
    apart = near.row != near.col
    start, end = near.row[apart].astype(np.int32), near.col[apart].astype(np.int32)
    return graph_from_edges(len(kept), start, end, np.zeros((len(start), 1), dtype=np.float32))
