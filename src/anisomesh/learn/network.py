"""The default network: from a pyramid of graphs to the line along which a remesh is to be stretched at every point."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from anisomesh.learn.graph import Graph
from anisomesh.learn.messages import largest_of_neighbours
from anisomesh.learn.pyramid import N_EDGE, N_NODE, Pyramid, Scale

_EPSILON = 1e-5
_INPUT_SCALE = 0.3  # brings what is seen to about 1; a norm over the mesh would hide how large curvatures are
_SLOPE = 0.1


@dataclass(frozen=True, kw_only=True)
class NetworkOptions:
    """Sizes of the network.

    Attributes
    ----------
    channels
        Values of a node inside.
    scales
        Graphs of the pyramid.
    blocks
        Residual blocks at each graph, on the way down and on the way up each.
    heads
        Graphs, from the finest on, whose edges give lines.
    """

    channels: int = 64
    scales: int = 5
    blocks: int = 2
    heads: int = 3


class Norm(nn.Module):
    """Each channel brought to mean 0 and deviation 1 over the nodes of a mesh, then scaled and shifted as learnt."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.scale = nn.Parameter(torch.ones(channels))
        self.shift = nn.Parameter(torch.zeros(channels))

    def forward(self, x: Tensor) -> Tensor:
        """Return (V, C) from (V, C)."""
        mean = x.mean(dim=0)
        away = x - mean
        deviation = torch.sqrt((away * away).mean(dim=0) + _EPSILON)
        return away / deviation * self.scale + self.shift


class Convolution(nn.Module):
    """f_i' = W0 (f_i, max over neighbours j of W1 (f_j - f_i, values of the edge)).

    W1 f_i does not depend on j, so it is taken out of the maximum: every node sends W1 f_j once, and what it gets is
    the largest message less its own. The paper's layer (section 3.2) has f_j besides, which adds to what is sent.
    """

    def __init__(self, inputs: int, channels: int) -> None:
        super().__init__()
        self.sent = nn.Linear(inputs, channels, bias=False)
        self.own = nn.Linear(inputs, channels, bias=False)
        self.along = nn.Parameter(torch.randn(N_EDGE, channels) / N_EDGE**0.5)
        self.out = nn.Linear(inputs + channels, channels)

    def forward(self, x: Tensor, graph: Graph) -> Tensor:
        """Return (V, C) from (V, inputs)."""
        largest = largest_of_neighbours(self.sent(x), self.along, graph) - self.own(x)
        mixed: Tensor = self.out(torch.cat([x, largest], dim=1))
        return mixed


class Block(nn.Module):
    """A convolution, norm and leaky rectifier, and a linear map, added to what came in."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.convolution = Convolution(channels, channels)
        self.norm = Norm(channels)
        self.out = nn.Linear(channels, channels)
        nn.init.zeros_(self.out.weight)

    def forward(self, x: Tensor, graph: Graph) -> Tensor:
        """Return (V, C) from (V, C)."""
        inner = nn.functional.leaky_relu(self.norm(self.convolution(x, graph)), _SLOPE)
        added: Tensor = x + self.out(inner)
        return added


class Blocks(nn.ModuleList):
    """Blocks one after the other."""

    def __init__(self, channels: int, count: int) -> None:
        super().__init__(Block(channels) for _ in range(count))

    def forward(self, x: Tensor, graph: Graph) -> Tensor:
        """Return (V, C) from (V, C)."""
        for block in self:
            x = block(x, graph)
        return x


class Head(nn.Module):
    """Lines at the nodes of a graph: sums of the directions of edges, at twice their angles, with learnt factors.

    The directions turn with the mesh and the factors do not change, so the lines turn with the mesh.
    """

    def __init__(self, channels: int, hidden: int = 32) -> None:
        super().__init__()
        self.start = nn.Linear(channels, hidden)
        self.end = nn.Linear(channels, hidden, bias=False)
        self.along = nn.Linear(N_EDGE, hidden, bias=False)
        self.out = nn.Linear(hidden, 1)

    def forward(self, x: Tensor, scale: Scale) -> Tensor:
        """Return lines (V, 2) from (V, C)."""
        edges = scale.graph.edges_on(x.device)
        inner = self.start(x)[edges.node] + self.end(x)[edges.neighbour] + self.along(edges.along)
        factor = self.out(nn.functional.leaky_relu(inner, _SLOPE))
        turns = torch.from_numpy(scale.turns).to(x.device)
        lines = torch.zeros((len(x), 2), dtype=x.dtype, device=x.device)
        return lines.index_add(0, edges.node, factor * turns)


class StretchNetwork(nn.Module):
    """A U-Net over the graphs of a pyramid that predicts lines of stretch.

    Shapes: a pyramid of N points -> lines (N, 2), the logarithm of the squared stretch at twice the angle of its
    direction in the tangent frame of the point (as in :mod:`anisomesh.metric.tangent`).
    """

    def __init__(self, options: NetworkOptions) -> None:
        super().__init__()
        self.options = options
        channels, scales = options.channels, options.scales
        self.enter = nn.ModuleList(nn.Linear(N_NODE, channels) for _ in range(scales))
        self.down = nn.ModuleList(Blocks(channels, options.blocks) for _ in range(scales))
        self.up = nn.ModuleList(Blocks(channels, options.blocks) for _ in range(scales - 1))
        self.join = nn.ModuleList(nn.Linear(2 * channels, channels) for _ in range(scales - 1))
        self.heads = nn.ModuleList(Head(channels) for _ in range(options.heads))

    def forward(self, pyramid: Pyramid) -> Tensor:
        """Return lines (N, 2)."""
        device = next(self.parameters()).device
        kept: list[Tensor] = []
        x: Tensor | None = None
        for k, scale in enumerate(pyramid.scales):
            seen = self.enter[k](_INPUT_SCALE * torch.from_numpy(scale.nodes).to(device))
            x = seen if x is None else seen + _pooled(x, pyramid.scales[k - 1])
            x = self.down[k](x, scale.graph)
            kept.append(x)
        features = kept.copy()
        for k in reversed(range(len(pyramid.scales) - 1)):
            scale = pyramid.scales[k]
            cluster = torch.from_numpy(scale.cluster).to(device)
            x = self.join[k](torch.cat([kept[k], features[k + 1][cluster]], dim=1))
            x = self.up[k](x, scale.graph)
            features[k] = x
        lines = torch.zeros((len(pyramid.frames), 2), device=device)
        for head, scale, x in zip(self.heads, pyramid.scales, features, strict=False):
            coarse = head(x, scale)[torch.from_numpy(scale.ancestor).to(device)]
            lines = lines + _turned(coarse, torch.from_numpy(scale.carry).to(device))
        return lines


def _pooled(x: Tensor, scale: Scale) -> Tensor:
    """Return the largest value in each cluster of a scale (V', C) from (V, C)."""
    cluster = torch.from_numpy(scale.cluster).to(x.device)
    n = int(scale.cluster.max()) + 1 if scale.cluster is not None and len(scale.cluster) else 0
    start = x.new_full((n, x.shape[1]), -torch.inf)
    return start.scatter_reduce(0, cluster[:, None].expand_as(x), x, "amax", include_self=True)


def _turned(lines: Tensor, by: Tensor) -> Tensor:
    """Return lines (N, 2) turned by rotations (N, 2), as products of complex numbers."""
    real = lines[:, 0] * by[:, 0] - lines[:, 1] * by[:, 1]
    imaginary = lines[:, 0] * by[:, 1] + lines[:, 1] * by[:, 0]
    return torch.stack([real, imaginary], dim=1)
