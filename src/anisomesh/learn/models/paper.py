"""The network of the paper: a Graph U-Net with Top-K pooling, from points and normals to the extra coordinates.

Names of modules, and the fields of :class:`PaperOptions`, are the names in files of weights and configurations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch
from scipy.sparse import csr_array
from scipy.spatial import cKDTree
from torch import Tensor, nn

from anisomesh.errors import OptionError
from anisomesh.learn.models.graph import Graph, graph_from_edges, mesh_graph
from anisomesh.learn.models.messages import max_aggregation, neighbour_distances
from anisomesh.learn.models.stretch import LEAKY_SLOPE, MeshNorm, linear_of_concatenation
from anisomesh.mesh.surface import Surface

INPUTS, OUTPUTS = 6, 5
"""Numbers of coordinates in (points and normals) and out (of the embedding beyond the first three)."""

_OUTPUT_SCALE = 0.01  # heuristic: coordinates of size 1 before training would be edges a hundred times too long
_N_INTERPOLATED = 3  # kept nodes that a dropped node is interpolated from


@dataclass(frozen=True, kw_only=True)
class PaperOptions:
    """Sizes of the paper's network.

    Attributes
    ----------
    channels
        Channels of a node; 256 in the paper.
    levels
        Number of poolings.
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
                "expected at least 1 channel, no negative number of levels, and a ratio above 0 and at most 1"
            )


@dataclass(frozen=True, eq=False)
class PaperInput:
    """Input of the network: points and unit normals (N, 6) as a tensor, the graph of the edges, and points (N, 3)."""

    values: Tensor
    graph: Graph
    points: npt.NDArray[np.float64]


def paper_input(surface: Surface) -> PaperInput:
    """Return the input for a surface at bounding-box diagonal 1."""
    values = np.concatenate([surface.points, surface.point_normals], axis=1).astype(np.float32)
    return PaperInput(values=torch.from_numpy(values), graph=mesh_graph(surface), points=surface.points)


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
        distance = neighbour_distances(x, graph)
        maximum = max_aggregation(self.sent(x), self.away, graph, distance) - self.own(x)
        return linear_of_concatenation(self.out, x, maximum)


class PaperBlock(nn.Module):
    """Two times convolution, norm and leaky rectifier, with a skip connection.

    The norm is over the nodes of a mesh: the batch norm of the paper for a batch of one.
    """

    def __init__(self, inputs: int, channels: int) -> None:
        super().__init__()
        self.first, self.second = PaperConvolution(inputs, channels), PaperConvolution(channels, channels)
        self.norms = nn.ModuleList(MeshNorm(channels) for _ in range(2))
        self.skip = nn.Linear(inputs, channels) if inputs != channels else nn.Identity()

    def forward(self, x: Tensor, graph: Graph) -> Tensor:
        """Return (V, C) from (V, inputs)."""
        inner = nn.functional.leaky_relu(self.norms[0](self.first(x, graph)), LEAKY_SLOPE, inplace=True)
        inner = nn.functional.leaky_relu(self.norms[1](self.second(inner, graph)), LEAKY_SLOPE, inplace=True)
        added: Tensor = self.skip(x) + inner
        return added


class TopKPooling(nn.Module):
    """Keep the nodes of highest score x p / |p|, times its tanh (Gao and Ji, "Graph U-Nets", ICML 2019)."""

    def __init__(self, channels: int, ratio: float) -> None:
        super().__init__()
        self.direction = nn.Parameter(torch.randn(channels))
        self.ratio = ratio

    def forward(self, x: Tensor) -> tuple[Tensor, npt.NDArray[np.int64]]:
        """Return the features of the kept nodes (V', C), and their indices (V',), ascending."""
        score = x @ self.direction / self.direction.norm()
        n = max(1, int(np.ceil(self.ratio * len(x))))
        kept = torch.sort(torch.topk(score, n).indices).values
        return x[kept] * torch.tanh(score[kept])[:, None], kept.cpu().numpy()


class PaperNetwork(nn.Module):
    """Five times a block and Top-K pooling, then five times interpolation and a block.

    Shapes: N points -> extra coordinates (N, 5), for the embedding [xyz, extra].

    A dropped node takes the values of the three nearest kept nodes, weighted by inverse distance. (The authors' code
    interpolates along the index of the node.) Kept nodes are connected where they are within two edges.
    """

    def __init__(self, options: PaperOptions) -> None:
        super().__init__()
        self.options = options
        channels = options.channels
        self.down = nn.ModuleList(PaperBlock(INPUTS if k == 0 else channels, channels) for k in range(options.levels))
        self.pools = nn.ModuleList(TopKPooling(channels, options.ratio) for _ in range(options.levels))
        self.bottom = PaperBlock(channels, channels)
        self.up = nn.ModuleList(PaperBlock(channels, channels) for _ in range(options.levels))
        self.out = nn.Linear(channels, OUTPUTS)
        with torch.no_grad():
            self.out.weight.mul_(_OUTPUT_SCALE)

    def forward(self, inputs: PaperInput) -> Tensor:
        """Return (N, 5)."""
        x, graph, points = inputs.values.to(self.out.weight.device), inputs.graph, inputs.points
        skipped: list[tuple[Tensor, Graph, npt.NDArray[np.float64], npt.NDArray[np.int64]]] = []
        for block, pool in zip(self.down, self.pools, strict=True):
            x = block(x, graph)
            pooled, kept = pool(x)
            skipped.append((x, graph, points, kept))
            x, graph, points = pooled, _connected_within_two_edges(graph, kept), points[kept]
        x = self.bottom(x, graph)
        for block, (before, graph, points, kept) in zip(self.up, reversed(skipped), strict=True):
            x = block(before + interpolated(x, points, kept), graph)
        extra: Tensor = self.out(x)
        return extra


def interpolated(x: Tensor, points: npt.NDArray[np.float64], kept: npt.NDArray[np.int64]) -> Tensor:
    """Return values (V, C) at points (V, 3) from values (V', C) at the kept points, weighted by inverse distance."""
    k = min(_N_INTERPOLATED, len(kept))
    distance, nearest = cKDTree(points[kept]).query(points, k=k)
    distance, nearest = distance.reshape(len(points), k), nearest.reshape(len(points), k)
    weight = 1.0 / np.maximum(distance, 1e-12)
    weight /= weight.sum(axis=1, keepdims=True)
    weights = torch.from_numpy(weight.astype(np.float32)).to(x.device)
    return (weights[:, :, None] * x[torch.from_numpy(nearest.astype(np.int64)).to(x.device)]).sum(dim=1)


def _connected_within_two_edges(graph: Graph, kept: npt.NDArray[np.int64]) -> Graph:
    """Return the graph of the kept nodes, with an edge where a path of one or two edges connects two of them."""
    n = graph.n_nodes
    adjacency = csr_array((np.ones(len(graph.neighbour), dtype=np.float32), graph.neighbour, graph.first), shape=(n, n))
    rows = adjacency[kept]
    near = ((rows @ adjacency) + rows)[:, kept].tocoo()
    apart = near.row != near.col
    start, end = near.row[apart].astype(np.int32), near.col[apart].astype(np.int32)
    return graph_from_edges(len(kept), start, end, np.zeros((len(start), 1), dtype=np.float32))
