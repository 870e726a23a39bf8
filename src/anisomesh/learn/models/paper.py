"""The paper's network: a Graph U-Net with Top-K pooling, from points and normals to the five extra coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch
from scipy.sparse import csr_array
from scipy.spatial import cKDTree
from torch import Tensor, nn

from anisomesh.errors import OptionError
from anisomesh.learn.models.graph import Graph, graph_of
from anisomesh.learn.models.messages import distance_of_neighbours, largest_of_neighbours
from anisomesh.learn.models.stretch import Norm, linear_of_both
from anisomesh.mesh.surface import Surface

INPUTS, OUTPUTS = 6, 5
_SLOPE = 0.1
_SMALL = 0.01  # extra coordinates are small at first
_NEAREST = 3  # nodes that were kept, from which those that were not take their values


@dataclass(frozen=True, kw_only=True)
class PaperOptions:
    """Sizes of the paper's network.

    Attributes
    ----------
    channels
        Values of a node inside; 256 in the paper.
    levels
        Times that nodes are pooled.
    ratio
        Share of the nodes that a pooling keeps.
    """

    channels: int = 64
    levels: int = 5
    ratio: float = 0.5

    def __post_init__(self) -> None:
        if self.channels < 1 or self.levels < 0 or not 0.0 < self.ratio <= 1.0:
            raise OptionError(
                f"[paper] channels = {self.channels}, levels = {self.levels}, ratio = {self.ratio}; "
                "expected at least 1 channel, no negative number of levels, and a share of the nodes above 0"
            )


@dataclass(frozen=True, eq=False)
class Seen:
    """What the network sees: points and unit normals (N, 6) as a tensor, the graph of the edges, and points (N, 3)."""

    values: Tensor
    graph: Graph
    points: npt.NDArray[np.float64]


def seen_of(surface: Surface) -> Seen:
    """Return what the network sees of a surface at bounding-box diagonal 1."""
    start, end = np.concatenate([surface.edges, surface.edges[:, ::-1]]).T
    graph = graph_of(surface.n_points, start, end, np.zeros((len(start), 1), dtype=np.float32))
    values = np.concatenate([surface.points, surface.point_normals], axis=1).astype(np.float32)
    return Seen(values=torch.from_numpy(values), graph=graph, points=surface.points)


class PaperConvolution(nn.Module):
    """f_i' = W0 (f_i, max_j W1 (f_j, f_j - f_i, |f_j - f_i|)), section 3.2 of the paper.

    With W1 = (A, B, c) a message is (A + B) f_j - B f_i + c |f_j - f_i|, and B f_i does not depend on j.
    """

    def __init__(self, inputs: int, channels: int) -> None:
        super().__init__()
        self.sent = nn.Linear(inputs, channels, bias=False)
        self.own = nn.Linear(inputs, channels, bias=False)
        self.away = nn.Parameter(0.1 * torch.randn(1, channels))
        self.out = nn.Linear(inputs + channels, channels)

    def forward(self, x: Tensor, graph: Graph) -> Tensor:
        """Return (V, C) from (V, inputs)."""
        away = distance_of_neighbours(x, graph)
        largest = largest_of_neighbours(self.sent(x), self.away, graph, away) - self.own(x)
        return linear_of_both(self.out, x, largest)


class PaperBlock(nn.Module):
    """Twice a convolution, norm and leaky rectifier, added to what came in.

    The norm is over the nodes of a mesh: the paper's batch norm for a batch of one.
    """

    def __init__(self, inputs: int, channels: int) -> None:
        super().__init__()
        self.first, self.second = PaperConvolution(inputs, channels), PaperConvolution(channels, channels)
        self.norms = nn.ModuleList(Norm(channels) for _ in range(2))
        self.skip = nn.Linear(inputs, channels) if inputs != channels else nn.Identity()

    def forward(self, x: Tensor, graph: Graph) -> Tensor:
        """Return (V, C) from (V, inputs)."""
        inner = nn.functional.leaky_relu(self.norms[0](self.first(x, graph)), _SLOPE, inplace=True)
        inner = nn.functional.leaky_relu(self.norms[1](self.second(inner, graph)), _SLOPE, inplace=True)
        added: Tensor = self.skip(x) + inner
        return added


class TopK(nn.Module):
    """Keep the nodes of largest score x p / |p|, and multiply them by its tanh (Gao and Ji, "Graph U-Nets", 2019)."""

    def __init__(self, channels: int, ratio: float) -> None:
        super().__init__()
        self.direction = nn.Parameter(torch.randn(channels))
        self.ratio = ratio

    def forward(self, x: Tensor) -> tuple[Tensor, npt.NDArray[np.int64]]:
        """Return the nodes kept (V', C), and which these are (V',), in order."""
        score = x @ self.direction / self.direction.norm()
        n = max(1, int(np.ceil(self.ratio * len(x))))
        kept = torch.sort(torch.topk(score, n).indices).values
        return x[kept] * torch.tanh(score[kept])[:, None], kept.cpu().numpy()


class PaperNetwork(nn.Module):
    """Five times a block and Top-K pooling, then five times interpolation and a block.

    Shapes: N points -> extra coordinates (N, 5), for the embedding [xyz, extra].

    A node that was not kept takes the values of the nearest three that were, weighted by inverse distance. (The
    authors' code interpolates along the number of the node.) Nodes kept are joined where they are within two edges.
    """

    def __init__(self, options: PaperOptions) -> None:
        super().__init__()
        self.options = options
        channels = options.channels
        self.down = nn.ModuleList(PaperBlock(INPUTS if k == 0 else channels, channels) for k in range(options.levels))
        self.pools = nn.ModuleList(TopK(channels, options.ratio) for _ in range(options.levels))
        self.bottom = PaperBlock(channels, channels)
        self.up = nn.ModuleList(PaperBlock(channels, channels) for _ in range(options.levels))
        self.out = nn.Linear(channels, OUTPUTS)
        with torch.no_grad():  # coordinates of size 1 would be edges a hundred times too long
            self.out.weight.mul_(_SMALL)

    def forward(self, seen: Seen) -> Tensor:
        """Return (N, 5)."""
        x, graph, points = seen.values.to(self.out.weight.device), seen.graph, seen.points
        way: list[tuple[Tensor, Graph, npt.NDArray[np.float64], npt.NDArray[np.int64]]] = []
        for block, pool in zip(self.down, self.pools, strict=True):
            x = block(x, graph)
            kept_values, kept = pool(x)
            way.append((x, graph, points, kept))
            x, graph, points = kept_values, _within_two_edges(graph, kept), points[kept]
        x = self.bottom(x, graph)
        for block, (before, graph, points, kept) in zip(self.up, reversed(way), strict=True):
            x = block(before + interpolated(x, points, kept), graph)
        extra: Tensor = self.out(x)
        return extra


def interpolated(x: Tensor, points: npt.NDArray[np.float64], kept: npt.NDArray[np.int64]) -> Tensor:
    """Return values at all points (V, C) from those at the points kept (V', C), by inverse distance to the nearest."""
    k = min(_NEAREST, len(kept))
    distance, nearest = cKDTree(points[kept]).query(points, k=k)
    distance, nearest = distance.reshape(len(points), k), nearest.reshape(len(points), k)
    weight = 1.0 / np.maximum(distance, 1e-12)
    weight /= weight.sum(axis=1, keepdims=True)
    shares = torch.from_numpy(weight.astype(np.float32)).to(x.device)
    return (shares[:, :, None] * x[torch.from_numpy(nearest.astype(np.int64)).to(x.device)]).sum(dim=1)


def _within_two_edges(graph: Graph, kept: npt.NDArray[np.int64]) -> Graph:
    """Return the graph of the nodes kept, joined where a path of one or two edges of the graph joins them."""
    n = graph.n_nodes
    link = csr_array((np.ones(len(graph.neighbour), dtype=np.float32), graph.neighbour, graph.first), shape=(n, n))
    rows = link[kept]
    near = ((rows @ link) + rows)[:, kept].tocoo()
    apart = near.row != near.col
    start, end = near.row[apart].astype(np.int32), near.col[apart].astype(np.int32)
    return graph_of(len(kept), start, end, np.zeros((len(start), 1), dtype=np.float32))
