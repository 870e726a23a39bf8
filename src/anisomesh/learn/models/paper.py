"""The network of the paper: a Graph U-Net with Top-K pooling, from points and normals to the extra coordinates.

Names of modules are the names in files of weights and configurations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor, nn

from anisomesh.learn.architecture import LEAKY_SLOPE, NORM_EPSILON, PAPER_INPUTS, PAPER_OUTPUTS, PaperOptions
from anisomesh.learn.graphs.graph import Graph, disjoint_union, mesh_graph
from anisomesh.learn.graphs.pooling import connected_within_two_edges, interpolation_weights
from anisomesh.learn.models.messages import max_aggregation, neighbour_distances
from anisomesh.learn.models.stretch import MeshNorm, linear_of_concatenation
from anisomesh.mesh.surface import Surface

_OUTPUT_SCALE = 0.01  # heuristic: coordinates of size 1 before training would be edges a hundred times too long
_MOMENTUM = 0.1  # share of the newest batch in running means, the default of torch

Sizes = tuple[int, ...]
"""Number of nodes of each mesh of a batch, in the order of the nodes."""


@dataclass(frozen=True, eq=False)
class PaperInput:
    """Input of the network: one mesh, or the meshes of a batch one after the other.

    Attributes
    ----------
    values
        Points and unit normals (N, 6).
    graph
        The graph of the edges.
    points
        The points (N, 3).
    sizes
        Number of points of each mesh.
    """

    values: Tensor
    graph: Graph
    points: npt.NDArray[np.float64]
    sizes: Sizes


def paper_input(surface: Surface) -> PaperInput:
    """Return the input for a surface at bounding-box diagonal 1."""
    values = np.concatenate([surface.points, surface.point_normals], axis=1).astype(np.float32)
    return PaperInput(torch.from_numpy(values), mesh_graph(surface), surface.points, (surface.n_points,))


def joined(inputs: Sequence[PaperInput]) -> PaperInput:
    """Return several inputs as one batch."""
    return PaperInput(
        values=torch.cat([one.values for one in inputs]),
        graph=disjoint_union([one.graph for one in inputs]),
        points=np.concatenate([one.points for one in inputs]),
        sizes=tuple(size for one in inputs for size in one.sizes),
    )


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


class BatchNorm(nn.Module):
    """Normalisation of each channel over all nodes of a batch in training, and by running means in inference."""

    mean: Tensor
    variance: Tensor

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.scale = nn.Parameter(torch.ones(channels))
        self.shift = nn.Parameter(torch.zeros(channels))
        self.register_buffer("mean", torch.zeros(channels))
        self.register_buffer("variance", torch.ones(channels))

    def forward(self, x: Tensor) -> Tensor:
        """Return (V, C) from (V, C)."""
        if self.training and len(x) < 2:  # batch_norm needs two nodes; a single node is its own mean
            return (x - x) * self.scale + self.shift
        running = (self.mean, self.variance)
        return nn.functional.batch_norm(x, *running, self.scale, self.shift, self.training, _MOMENTUM, NORM_EPSILON)


class PaperBlock(nn.Module):
    """Two times convolution and norm, a leaky rectifier after each, and a skip connection.

    As the paper's text reads, the input is added before the second rectifier; ``skip="after"`` adds it after that.
    """

    def __init__(self, inputs: int, options: PaperOptions) -> None:
        super().__init__()
        channels = options.channels
        self.options = options
        self.first, self.second = PaperConvolution(inputs, channels), PaperConvolution(channels, channels)
        self.norms = nn.ModuleList((BatchNorm if options.norm == "batch" else MeshNorm)(channels) for _ in range(2))
        self.skip = nn.Linear(inputs, channels) if inputs != channels else nn.Identity()

    def forward(self, x: Tensor, graph: Graph, sizes: Sizes) -> Tensor:
        """Return (V, C) from (V, inputs)."""
        inner = self._normalised(0, self.first(x, graph), sizes)
        inner = nn.functional.leaky_relu(inner, LEAKY_SLOPE, inplace=True)
        inner = self._normalised(1, self.second(inner, graph), sizes)
        if self.options.skip == "before":
            return nn.functional.leaky_relu(self.skip(x) + inner, LEAKY_SLOPE, inplace=True)
        added: Tensor = self.skip(x) + nn.functional.leaky_relu(inner, LEAKY_SLOPE, inplace=True)
        return added

    def _normalised(self, k: int, x: Tensor, sizes: Sizes) -> Tensor:
        if self.options.norm == "batch" or len(sizes) == 1:
            whole: Tensor = self.norms[k](x)
            return whole
        return torch.cat([self.norms[k](part) for part in torch.split_with_sizes(x, sizes)])


class TopKPooling(nn.Module):
    """Keep the nodes of highest score x p / |p|, times its tanh (Gao and Ji, "Graph U-Nets", ICML 2019)."""

    def __init__(self, channels: int, ratio: float) -> None:
        super().__init__()
        self.direction = nn.Parameter(torch.randn(channels))
        self.ratio = ratio

    def forward(self, x: Tensor, sizes: Sizes) -> tuple[Tensor, npt.NDArray[np.int64], Sizes]:
        """Return the features of the kept nodes (V', C), their indices (V',), ascending, and the numbers by mesh."""
        score = x @ self.direction / self.direction.norm()
        counts = tuple(max(1, int(np.ceil(self.ratio * size))) for size in sizes)
        chosen, start = [], 0
        for part, n in zip(torch.split_with_sizes(score, sizes), counts, strict=True):
            chosen.append(start + torch.sort(torch.topk(part, n).indices).values)
            start += len(part)
        kept = torch.cat(chosen)
        return x[kept] * torch.tanh(score[kept])[:, None], kept.cpu().numpy(), counts


class PaperNetwork(nn.Module):
    """Five times a block and Top-K pooling, then five times interpolation and a block.

    Shapes: N points -> extra coordinates (N, 5), for the embedding [xyz, extra].

    A dropped node takes the values of the three nearest kept nodes, weighted by inverse distance. (The authors' code
    interpolates along the index of the node.) Kept nodes are connected where they are within two edges. In a batch only
    batch norms see more than one mesh.
    """

    def __init__(self, options: PaperOptions) -> None:
        super().__init__()
        self.options = options
        channels = options.channels
        self.down = nn.ModuleList(
            PaperBlock(PAPER_INPUTS if k == 0 else channels, options) for k in range(options.levels)
        )
        self.pools = nn.ModuleList(TopKPooling(channels, options.ratio) for _ in range(options.levels))
        self.bottom = PaperBlock(channels if options.levels else PAPER_INPUTS, options)
        self.up = nn.ModuleList(PaperBlock(channels, options) for _ in range(options.levels))
        self.out = nn.Linear(channels, PAPER_OUTPUTS)
        with torch.no_grad():
            self.out.weight.mul_(_OUTPUT_SCALE)

    def forward(self, inputs: PaperInput) -> Tensor:
        """Return (N, 5)."""
        x, level = inputs.values.to(self.out.weight.device), inputs
        skipped: list[tuple[Tensor, PaperInput, npt.NDArray[np.int64], Sizes]] = []
        for block, pool in zip(self.down, self.pools, strict=True):
            x = block(x, level.graph, level.sizes)
            pooled, kept, counts = pool(x, level.sizes)
            skipped.append((x, level, kept, counts))
            x = pooled
            level = PaperInput(x, connected_within_two_edges(level.graph, kept), level.points[kept], counts)
        x = self.bottom(x, level.graph, level.sizes)
        for block, (before, level, kept, counts) in zip(self.up, reversed(skipped), strict=True):
            x = block(before + _interpolated_by_mesh(x, level, kept, counts), level.graph, level.sizes)
        extra: Tensor = self.out(x)
        return extra


def _interpolated_by_mesh(x: Tensor, level: PaperInput, kept: npt.NDArray[np.int64], counts: Sizes) -> Tensor:
    """Return values (V, C) at the points of a level from values (V', C) at the kept ones, each mesh by itself."""
    starts, ends = np.cumsum([0, *level.sizes[:-1]]), np.cumsum(counts)[:-1]
    values = torch.split_with_sizes(x, counts)
    parts = zip(values, np.split(level.points, starts[1:]), np.split(kept, ends), starts, strict=True)
    return torch.cat([interpolated(part, points, chosen - start) for part, points, chosen, start in parts])


def interpolated(x: Tensor, points: npt.NDArray[np.float64], kept: npt.NDArray[np.int64]) -> Tensor:
    """Return values (V, C) at points (V, 3) from values (V', C) at the kept points, weighted by inverse distance."""
    nearest, weights = (torch.from_numpy(table).to(x.device) for table in interpolation_weights(points, kept))
    return (weights[:, :, None] * x[nearest]).sum(dim=1)
