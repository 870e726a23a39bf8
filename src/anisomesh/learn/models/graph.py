"""Meshes as graphs, and coarser and coarser graphs by maximal independent sets."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from anisomesh._kernels.pyramid import TAKEN, independent_set

if TYPE_CHECKING:
    from torch import Tensor

Floats = npt.NDArray[np.float32]
Ints = npt.NDArray[np.int32]
_MIXING = 7_919.0  # spreads numbers that differ little over their fractional parts


class Edges(NamedTuple):
    """Start (E,), end (E,) and values (E, K) of the edges as tensors."""

    node: Tensor
    neighbour: Tensor
    along: Tensor


@dataclass(frozen=True, eq=False)
class Graph:
    """Nodes with edges to their neighbours, both ways, in compressed rows.

    Attributes
    ----------
    first
        First edge of each node (V + 1,).
    neighbour
        Node at the other end of each edge (E,).
    along
        Values of each edge (E, K).
    """

    first: Ints
    neighbour: Ints
    along: Floats
    _on_device: dict[str, Any] = field(default_factory=dict, repr=False)

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.first) - 1

    @property
    def node(self) -> Ints:
        """Node that each edge begins at (E,)."""
        return np.repeat(np.arange(self.n_nodes, dtype=np.int32), np.diff(self.first))

    def edges_on(self, device: Any) -> Edges:
        """Return the edges as tensors on a device of torch."""
        import torch

        key = str(device)
        if key not in self._on_device:
            node, neighbour = (torch.from_numpy(values.astype(np.int64)) for values in (self.node, self.neighbour))
            self._on_device[key] = Edges(node.to(device), neighbour.to(device), torch.from_numpy(self.along).to(device))
        edges: Edges = self._on_device[key]
        return edges


@dataclass(frozen=True, eq=False)
class Level:
    """A graph, and which node of the next coarser one each of its nodes belongs to (V,); None on the coarsest."""

    graph: Graph
    cluster: npt.NDArray[np.int64] | None


def graph_of(n_nodes: int, start: Ints, end: Ints, along: Floats) -> Graph:
    """Return the graph of these directed edges (E,), which have values (E, K)."""
    order = np.lexsort((end, start))
    first = np.zeros(n_nodes + 1, dtype=np.int32)
    np.cumsum(np.bincount(start, minlength=n_nodes), out=first[1:])
    return Graph(first=first, neighbour=end[order].astype(np.int32), along=np.ascontiguousarray(along[order]))


def hierarchy(graph: Graph, positions: npt.NDArray[np.float64], n_levels: int) -> list[Level]:
    """Return a graph and coarser ones, each of about a quarter of the nodes of the one before.

    Parameters
    ----------
    graph
        The finest graph.
    positions
        Of its nodes in space (V, 3).
    n_levels
        Number of graphs, at least 1.

    Notes
    -----
    The nodes of the next graph are a maximal independent set; every other node belongs to a neighbour in it. Two of
    them are neighbours where nodes that belong to them are. Which node is taken depends on the lengths of its edges
    alone, so neither the order of nodes or edges nor a motion of the mesh matters, but where lengths are equal, as on a
    regular grid. The only value of an edge of a coarser graph is its length over the mean length.
    """
    levels = []
    for _ in range(n_levels - 1):
        taken, cluster = _independent(graph, _priority(graph, positions))
        levels.append(Level(graph, cluster))
        positions = positions[taken]
        ends = cluster[np.stack([graph.node, graph.neighbour])]
        n = len(taken)
        keys = np.unique(ends[0][ends[0] != ends[1]] * n + ends[1][ends[0] != ends[1]])
        start, end = keys // n, keys % n
        length = np.linalg.norm(positions[end] - positions[start], axis=1)
        along = (length / max(float(length.mean()) if len(length) else 1.0, 1e-30)).astype(np.float32)[:, None]
        graph = graph_of(n, start.astype(np.int32), end.astype(np.int32), along)
    return [*levels, Level(graph, None)]


def _priority(graph: Graph, positions: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return a number for each node (V,) that looks random and depends on the lengths of its edges alone."""
    length = np.linalg.norm(positions[graph.neighbour] - positions[graph.node], axis=1)
    total = np.bincount(graph.node, length, minlength=graph.n_nodes)
    return np.asarray(np.modf(_MIXING * total / max(float(total.mean()), 1e-30))[0])


def _independent(
    graph: Graph, priority: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return a maximal independent set (n,), and which of its nodes, by number in it, each node belongs to (V,).

    The nodes are taken by falling priority, unless a neighbour was; others belong to the neighbour of largest priority
    in the set. Of equal priorities the lower number goes first.
    """
    n = graph.n_nodes
    state, owner = np.zeros(n, dtype=np.int8), np.zeros(n, dtype=np.int64)
    independent_set(graph.first, graph.neighbour, np.argsort(-priority, kind="stable"), state, owner)
    return np.flatnonzero(state == TAKEN), owner
