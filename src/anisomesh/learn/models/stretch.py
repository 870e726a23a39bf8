"""The default network: from a pyramid of graphs to lines of stretch, and to where the points are without noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor, nn

from anisomesh.errors import OptionError
from anisomesh.learn.models.graph import Edges, Graph
from anisomesh.learn.models.hierarchy import N_EDGE, N_NODE, N_NORMALS, Pyramid, Scale
from anisomesh.learn.models.messages import mean_of_neighbours

_EPSILON = 1e-5
_INPUT_SCALE = 0.3  # brings what is seen to about 1; a norm over the mesh would hide how large curvatures are
_OFFSET_SCALE = 0.1  # offsets are small at first
_SLOPE = 0.1
_AT_ONCE = 8_192  # edges
_LINES, _ROUNDS = 4, 2  # lines at a node inside a head, and times that they are mixed with those of neighbours


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

    def __post_init__(self) -> None:
        for name in ("channels", "scales", "blocks", "heads"):
            if getattr(self, name) < 1:
                raise OptionError(f"[network] {name} = {getattr(self, name)}; expected at least 1")
        if self.heads > self.scales:
            raise OptionError(f"[network] heads = {self.heads}; expected no more than scales, {self.scales}")


class Norm(nn.Module):
    """Each channel brought to mean 0 and deviation 1 over the nodes of a mesh, then scaled and shifted as learnt."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.scale = nn.Parameter(torch.ones(channels))
        self.shift = nn.Parameter(torch.zeros(channels))

    def forward(self, x: Tensor) -> Tensor:
        """Return (V, C) from (V, C)."""
        if len(x) < 2:  # batch_norm wants two; the one is its own mean
            return (x - x) * self.scale + self.shift
        return nn.functional.batch_norm(x, None, None, self.scale, self.shift, training=True, eps=_EPSILON)


class Convolution(nn.Module):
    """f_i' = W0 (f_i, mean over neighbours j of leaky(A f_i + B f_j + C values of the edge)).

    A mean where the paper's layer (section 3.2) has the maximum: it averages over noise, and fits curvature as least
    squares do. Every node sends B f_j once.
    """

    def __init__(self, inputs: int, channels: int) -> None:
        super().__init__()
        self.sent = nn.Linear(inputs, channels, bias=False)
        self.own = nn.Linear(inputs, channels)
        self.along = nn.Parameter(torch.randn(N_EDGE, channels) / N_EDGE**0.5)
        self.out = nn.Linear(inputs + channels, channels)

    def forward(self, x: Tensor, graph: Graph) -> Tensor:
        """Return (V, C) from (V, inputs)."""
        mean = mean_of_neighbours(self.own(x), self.sent(x), self.along, graph, _SLOPE)
        return linear_of_both(self.out, x, mean)


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
        inner = nn.functional.leaky_relu(self.norm(self.convolution(x, graph)), _SLOPE, inplace=True)
        added: Tensor = self.out(inner).add_(x)
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
    """Lines and vectors at the nodes, as sums with learnt factors of what turns with the mesh.

    A few lines at every node are sums of the directions of its edges, of the duals of these, and of the line of
    curvature; then they are mixed with those of the neighbours, carried to the tangent frame of the node, twice.
    Vectors are sums of edges. The factors do not change under motion, so lines and vectors turn with the mesh.
    """

    def __init__(self, channels: int, hidden: int = 32) -> None:
        super().__init__()
        self.start = nn.Linear(channels, hidden)
        self.end = nn.Linear(channels, hidden, bias=False)
        self.along = nn.Linear(N_EDGE, hidden, bias=False)
        self.of_edges = nn.Linear(hidden, (2 + _ROUNDS) * _LINES + 1)
        self.of_nodes = nn.Linear(channels, (2 + _ROUNDS) * _LINES)

    def forward(self, x: Tensor, scale: Scale) -> tuple[Tensor, Tensor]:
        """Return lines (V, 2) and vectors (V, 3) from (V, C)."""
        edges, device = scale.graph.edges_on(x.device), x.device
        share = 1.0 / torch.bincount(edges.node, minlength=len(x)).clamp(min=1)
        of_edges = self._of_edges(x, edges, share)
        direct, dual, *mixing, vector = torch.split(of_edges, [_LINES] * (2 + _ROUNDS) + [1], dim=1)
        fitted, last, *keeping = torch.split(self.of_nodes(x), _LINES, dim=1)
        turns, duals, ties, ways, fit = (
            torch.from_numpy(values).to(device)
            for values in (scale.turns, scale.duals, scale.ties, scale.ways, scale.fit)
        )
        along = torch.addcmul(direct[:, :, None] * turns[:, None], dual[:, :, None], duals[:, None])
        lines = _at_nodes(along, edges.node, len(x)) + fitted[:, :, None] * fit[:, None]
        for mix, keep in zip(mixing, keeping, strict=True):
            carried = turned(lines[edges.neighbour], ties[:, None])
            lines = (1.0 + keep[:, :, None]) * lines + _at_nodes(mix[:, :, None] * carried, edges.node, len(x))
        vectors = _at_nodes(vector * ways, edges.node, len(x))
        return (last[:, :, None] * lines).sum(dim=1), vectors

    def _of_edges(self, x: Tensor, edges: Edges, share: Tensor) -> Tensor:
        """Return the factors of the edges (E, ...) times the shares of their nodes (V,), some edges at a time.

        What is between is many times larger.
        """
        start, end = self.start(x), self.end(x)
        parts = []
        for node, neighbour, along in zip(*(torch.split(values, _AT_ONCE) for values in edges), strict=True):
            inner = start[node] + end[neighbour] + self.along(along)
            factors = self.of_edges(nn.functional.leaky_relu(inner, _SLOPE, inplace=True))
            parts.append(factors.mul_(share[node, None]))
        return torch.cat(parts)


class Prediction(NamedTuple):
    """What the network finds at N points.

    Attributes
    ----------
    lines
        The logarithm of the squared stretch at twice the angle of its direction in the tangent frame (N, 2).
    offsets
        From the points to where they are without noise, but for motions along the surface (N, 3).
    """

    lines: Tensor
    offsets: Tensor


class StretchNetwork(nn.Module):
    """A U-Net over the graphs of a pyramid that predicts lines of stretch, and offsets that take noise away.

    Shapes: a pyramid of N points -> :class:`Prediction`. Lines are in the tangent frames of the pyramid (see
    :mod:`anisomesh.metric.tangent`); offsets are sums of edges, and of normals of the first graphs.
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
        self.rise = nn.Linear(channels, N_NORMALS)

    def forward(self, pyramid: Pyramid) -> Prediction:
        """Return the prediction at the points of a pyramid."""
        device = self.rise.weight.device
        features = self._features(pyramid)
        normals = torch.from_numpy(pyramid.normals).to(device)
        lines = torch.zeros((len(normals), 2), device=device)
        offsets = _OFFSET_SCALE * (self.rise(features[0])[:, :, None] * normals).sum(dim=1)
        for head, scale, x in zip(self.heads, pyramid.scales, features, strict=False):
            ancestor = torch.from_numpy(scale.ancestor).to(device)
            coarse, vectors = head(x, scale)
            lines = lines + turned(coarse[ancestor], torch.from_numpy(scale.carry).to(device))
            offsets = offsets + vectors[ancestor]
        return Prediction(lines, offsets)

    def _features(self, pyramid: Pyramid) -> list[Tensor]:
        """Return the features (V, C) of the nodes of all graphs."""
        device = self.rise.weight.device
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
            x = linear_of_both(self.join[k], kept[k], features[k + 1][cluster])
            features[k] = self.up[k](x, scale.graph)
        return features


def linear_of_both(linear: nn.Module, a: Tensor, b: Tensor) -> Tensor:
    """Return the linear map (V, C) of rows (V, A) and (V, B) side by side, without a table of both."""
    assert isinstance(linear, nn.Linear)
    of_a, of_b = torch.split(linear.weight, [a.shape[1], b.shape[1]], dim=1)
    return nn.functional.linear(a, of_a, linear.bias).addmm_(b, of_b.T)


def _pooled(x: Tensor, scale: Scale) -> Tensor:
    """Return the largest value in each cluster of a scale (V', C) from (V, C)."""
    cluster = torch.from_numpy(scale.cluster).to(x.device)
    n = int(scale.cluster.max()) + 1 if scale.cluster is not None and len(scale.cluster) else 0
    start = x.new_full((n, x.shape[1]), -torch.inf)
    return start.scatter_reduce(0, cluster[:, None].expand_as(x), x, "amax", include_self=True)


def _at_nodes(values: Tensor, node: Tensor, n: int) -> Tensor:
    """Return the sums of values (E, ...) at n nodes (V, ...)."""
    return values.new_zeros((n, *values.shape[1:])).index_add(0, node, values)


def turned(lines: Tensor, by: Tensor) -> Tensor:
    """Return lines (..., 2) turned by rotations (..., 2), as products of complex numbers."""
    real = lines[..., 0] * by[..., 0] - lines[..., 1] * by[..., 1]
    imaginary = lines[..., 0] * by[..., 1] + lines[..., 1] * by[..., 0]
    return torch.stack([real, imaginary], dim=-1)
