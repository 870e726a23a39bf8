"""Graphs in compressed rows, and their coarsening by maximal independent sets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from anisomesh._kernels.graph_hierarchy import IN_SET, maximal_independent_set
from anisomesh.mesh.surface import Surface

if TYPE_CHECKING:
    from torch import Tensor

Floats = npt.NDArray[np.float32]
Ints = npt.NDArray[np.int32]

_PRIORITY_FACTOR = 7_919.0  # a large prime, heuristic: the fractional parts of its multiples are spread evenly


class EdgeTensors(NamedTuple):
    """Node (E,), neighbour (E,) and features (E, K) of the edges as tensors."""

    node: Tensor
    neighbour: Tensor
    features: Tensor


@dataclass(frozen=True, eq=False)
class Graph:
    """V nodes with E directed edges to their neighbours, in compressed rows; every edge is stored in both directions.

    Attributes
    ----------
    first
        First edge of each node (V + 1,).
    neighbour
        Node at the other end of each edge (E,).
    features
        Features of the edges (E, K).
    """

    first: Ints
    neighbour: Ints
    features: Floats
    _on_device: dict[str, Any] = field(default_factory=dict, repr=False)

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.first) - 1

    @property
    def node(self) -> Ints:
        """Node that each edge starts at (E,)."""
        return np.repeat(np.arange(self.n_nodes, dtype=np.int32), np.diff(self.first))

    def edges_on(self, device: Any) -> EdgeTensors:
        """Return the edges as tensors on a torch device; they are kept for further calls."""
        import torch

        key = str(device)
        if key not in self._on_device:
            node, neighbour = (torch.from_numpy(values.astype(np.int64)) for values in (self.node, self.neighbour))
            features = torch.from_numpy(self.features)
            self._on_device[key] = EdgeTensors(node.to(device), neighbour.to(device), features.to(device))
        edges: EdgeTensors = self._on_device[key]
        return edges


@dataclass(frozen=True, eq=False)
class CoarseningLevel:
    """A graph and, for each of its nodes, the node of the next coarser graph (V,); None on the coarsest level."""

    graph: Graph
    cluster: npt.NDArray[np.int64] | None


def graph_from_edges(n_nodes: int, start: Ints, end: Ints, features: Floats) -> Graph:
    """Return the graph of directed edges from ``start`` (E,) to ``end`` (E,) with features (E, K)."""
    order = np.lexsort((end, start))
    first = np.zeros(n_nodes + 1, dtype=np.int32)
    np.cumsum(np.bincount(start, minlength=n_nodes), out=first[1:])
    return Graph(first=first, neighbour=end[order].astype(np.int32), features=np.ascontiguousarray(features[order]))


def mesh_graph(surface: Surface) -> Graph:
    """Return the graph of the points and edges of a surface, with one feature per edge, zero."""
    start, end = np.concatenate([surface.edges, surface.edges[:, ::-1]]).T
    return graph_from_edges(surface.n_points, start, end, np.zeros((len(start), 1), dtype=np.float32))


def disjoint_union(graphs: Sequence[Graph]) -> Graph:
    """Return the graphs as one without edges between them; nodes are numbered in the order of the graphs."""
    starts = np.cumsum([0, *(graph.n_nodes for graph in graphs)])
    edges = np.cumsum([0, *(len(graph.neighbour) for graph in graphs)])
    first = [graph.first[:-1] + start for graph, start in zip(graphs, edges, strict=False)]
    neighbour = [graph.neighbour + start for graph, start in zip(graphs, starts, strict=False)]
    return Graph(
        first=np.concatenate([*first, edges[-1:]]).astype(np.int32),
        neighbour=np.concatenate(neighbour).astype(np.int32),
        features=np.concatenate([graph.features for graph in graphs]),
    )


def coarsen(graph: Graph, positions: npt.NDArray[np.float64], n_levels: int) -> list[CoarseningLevel]:
    """Return a graph followed by coarser graphs, each with about a quarter of the nodes of the previous one.

    Parameters
    ----------
    graph
        The finest graph.
    positions
        Positions of its nodes (V, 3).
    n_levels
        Number of graphs, at least 1.

    Notes
    -----
    The nodes of the next graph are a maximal independent set; every other node joins the cluster of a neighbour in the
    set. Two clusters are adjacent where some of their nodes are. The set depends only on the lengths of edges, so it is
    independent of the order of nodes and edges and of rigid motions, except where lengths are equal, as on a regular
    grid. The only feature of a coarser edge is its length over the mean length.
    """
    levels = []
    for _ in range(n_levels - 1):
        chosen, cluster = _independent_set(graph, _priority(graph, positions))
        levels.append(CoarseningLevel(graph, cluster))
        positions = positions[chosen]
        ends = cluster[np.stack([graph.node, graph.neighbour])]
        n = len(chosen)
        keys = np.unique(ends[0][ends[0] != ends[1]] * n + ends[1][ends[0] != ends[1]])
        start, end = keys // n, keys % n
        length = np.linalg.norm(positions[end] - positions[start], axis=1)
        features = (length / max(float(length.mean()) if len(length) else 1.0, 1e-30)).astype(np.float32)[:, None]
        graph = graph_from_edges(n, start.astype(np.int32), end.astype(np.int32), features)
    return [*levels, CoarseningLevel(graph, None)]


def _priority(graph: Graph, positions: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return a pseudo-random number for each node (V,) that depends only on the lengths of its edges."""
    length = np.linalg.norm(positions[graph.neighbour] - positions[graph.node], axis=1)
    total = np.bincount(graph.node, length, minlength=graph.n_nodes)
    return np.asarray(np.modf(_PRIORITY_FACTOR * total / max(float(total.mean()), 1e-30))[0])


def _independent_set(
    graph: Graph, priority: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return a maximal independent set (n,), and the index in it of the cluster of each node (V,).

    Nodes are chosen greedily by decreasing priority; every other node joins its neighbour of highest priority in the
    set. Among equal priorities the lower index goes first.
    """
    n = graph.n_nodes
    state, cluster = np.zeros(n, dtype=np.int8), np.zeros(n, dtype=np.int64)
    maximal_independent_set(graph.first, graph.neighbour, np.argsort(-priority, kind="stable"), state, cluster)
    return np.flatnonzero(state == IN_SET), cluster
