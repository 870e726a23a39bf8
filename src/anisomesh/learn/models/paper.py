"""The network of the paper: a Graph U-Net with Top-K pooling, from points and normals to the extra coordinates.

Names of modules are the names in files of weights and configurations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor, nn

from anisomesh.learn.architecture import LEAKY_SLOPE, PAPER_INPUTS, PAPER_OUTPUTS, PaperOptions
from anisomesh.learn.graphs.graph import Graph, mesh_graph
from anisomesh.learn.graphs.pooling import connected_within_two_edges, interpolation_weights
from anisomesh.learn.models.messages import max_aggregation, neighbour_distances
from anisomesh.learn.models.stretch import MeshNorm, linear_of_concatenation
from anisomesh.mesh.surface import Surface

_OUTPUT_SCALE = 0.01  # heuristic: coordinates of size 1 before training would be edges a hundred times too long


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
        self.down = nn.ModuleList(
            PaperBlock(PAPER_INPUTS if k == 0 else channels, channels) for k in range(options.levels)
        )
        self.pools = nn.ModuleList(TopKPooling(channels, options.ratio) for _ in range(options.levels))
        self.bottom = PaperBlock(channels, channels)
        self.up = nn.ModuleList(PaperBlock(channels, channels) for _ in range(options.levels))
        self.out = nn.Linear(channels, PAPER_OUTPUTS)
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
            x, graph, points = pooled, connected_within_two_edges(graph, kept), points[kept]
        x = self.bottom(x, graph)
        for block, (before, graph, points, kept) in zip(self.up, reversed(skipped), strict=True):
            x = block(before + interpolated(x, points, kept), graph)
        extra: Tensor = self.out(x)
        return extra


def interpolated(x: Tensor, points: npt.NDArray[np.float64], kept: npt.NDArray[np.int64]) -> Tensor:
    """Return values (V, C) at points (V, 3) from values (V', C) at the kept points, weighted by inverse distance."""
    nearest, weights = (torch.from_numpy(table).to(x.device) for table in interpolation_weights(points, kept))
    return (weights[:, :, None] * x[nearest]).sum(dim=1)
