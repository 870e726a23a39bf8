"""The default network: from a graph hierarchy to a line field of stretch, and to offsets that remove noise.

Names of modules are the names in files of weights and configurations.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn

from anisomesh.learn.architecture import (
    EDGES_PER_CHUNK,
    HEAD_LINES,
    HEAD_ROUNDS,
    HEAD_WIDTH,
    INPUT_SCALE,
    LEAKY_SLOPE,
    NORM_EPSILON,
    OFFSET_SCALE,
    NetworkOptions,
)
from anisomesh.learn.graphs.graph import EdgeTensors, Graph
from anisomesh.learn.graphs.hierarchy import (
    N_EDGE_FEATURES,
    N_NODE_FEATURES,
    N_NORMAL_LEVELS,
    GraphHierarchy,
    HierarchyLevel,
)
from anisomesh.learn.models.messages import mean_aggregation


class MeshNorm(nn.Module):
    """Normalisation of each channel to mean 0 and variance 1 over the nodes of a mesh, with learnt scale and shift."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.scale = nn.Parameter(torch.ones(channels))
        self.shift = nn.Parameter(torch.zeros(channels))

    def forward(self, x: Tensor) -> Tensor:
        """Return (V, C) from (V, C)."""
        if len(x) < 2:  # batch_norm needs two nodes; a single node is its own mean
            return (x - x) * self.scale + self.shift
        return nn.functional.batch_norm(x, None, None, self.scale, self.shift, training=True, eps=NORM_EPSILON)


class MeanConvolution(nn.Module):
    """f_i' = W0 (f_i, mean over neighbours j of leaky(A f_i + B f_j + C features of the edge)).

    The layer of the paper (section 3.2) has the maximum. The mean averages noise out and fits curvature as least
    squares do. B f_j is computed once per node.
    """

    def __init__(self, inputs: int, channels: int, edge_features: int = N_EDGE_FEATURES) -> None:
        super().__init__()
        self.sent = nn.Linear(inputs, channels, bias=False)
        self.own = nn.Linear(inputs, channels)
        self.along = nn.Parameter(torch.randn(edge_features, channels) / edge_features**0.5)
        self.out = nn.Linear(inputs + channels, channels)

    def forward(self, x: Tensor, graph: Graph) -> Tensor:
        """Return (V, C) from (V, inputs)."""
        mean = mean_aggregation(self.own(x), self.sent(x), self.along, graph, LEAKY_SLOPE)
        return linear_of_concatenation(self.out, x, mean)


class ResidualBlock(nn.Module):
    """x + linear(leaky(norm(convolution(x)))); the identity before training."""

    def __init__(self, channels: int, edge_features: int = N_EDGE_FEATURES) -> None:
        super().__init__()
        self.convolution = MeanConvolution(channels, channels, edge_features)
        self.norm = MeshNorm(channels)
        self.out = nn.Linear(channels, channels)
        nn.init.zeros_(self.out.weight)

    def forward(self, x: Tensor, graph: Graph) -> Tensor:
        """Return (V, C) from (V, C)."""
        inner = nn.functional.leaky_relu(self.norm(self.convolution(x, graph)), LEAKY_SLOPE, inplace=True)
        added: Tensor = self.out(inner).add_(x)
        return added


class ResidualBlocks(nn.ModuleList):
    """Residual blocks in sequence."""

    def __init__(self, channels: int, count: int, edge_features: int = N_EDGE_FEATURES) -> None:
        super().__init__(ResidualBlock(channels, edge_features) for _ in range(count))

    def forward(self, x: Tensor, graph: Graph) -> Tensor:
        """Return (V, C) from (V, C)."""
        for block in self:
            x = block(x, graph)
        return x


class EquivariantHead(nn.Module):
    """A line and a vector at each node, as combinations of directions and vectors that turn with the mesh.

    A few lines at each node are combinations of the directions of its edges, of their fit weights, and of the fitted
    line of curvature; then they are mixed twice with the neighbours' lines, transported to the tangent frame of the
    node. Vectors are combinations of edge vectors. The learnt coefficients depend on invariants only, so lines and
    vectors turn with the mesh.
    """

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.start = nn.Linear(channels, HEAD_WIDTH)
        self.end = nn.Linear(channels, HEAD_WIDTH, bias=False)
        self.along = nn.Linear(N_EDGE_FEATURES, HEAD_WIDTH, bias=False)
        self.of_edges = nn.Linear(HEAD_WIDTH, (2 + HEAD_ROUNDS) * HEAD_LINES + 1)
        self.of_nodes = nn.Linear(channels, (2 + HEAD_ROUNDS) * HEAD_LINES)

    def forward(self, x: Tensor, level: HierarchyLevel) -> tuple[Tensor, Tensor]:
        """Return lines (V, 2) and vectors (V, 3) from (V, C)."""
        edges, device = level.graph.edges_on(x.device), x.device
        share = 1.0 / torch.bincount(edges.node, minlength=len(x)).clamp(min=1)
        of_edges = self._edge_coefficients(x, edges, share)
        direct, fitted, *mixing, vector = torch.split(of_edges, [HEAD_LINES] * (2 + HEAD_ROUNDS) + [1], dim=1)
        curved, last, *keeping = torch.split(self.of_nodes(x), HEAD_LINES, dim=1)
        directions, fit_weights, transport, vectors, curvature_line = (
            torch.from_numpy(values).to(device)
            for values in (level.directions, level.fit_weights, level.transport, level.vectors, level.curvature_line)
        )
        along = torch.addcmul(direct[:, :, None] * directions[:, None], fitted[:, :, None], fit_weights[:, None])
        lines = _sum_at_nodes(along, edges.node, len(x)) + curved[:, :, None] * curvature_line[:, None]
        for mix, keep in zip(mixing, keeping, strict=True):
            carried = rotated_lines(lines[edges.neighbour], transport[:, None])
            lines = (1.0 + keep[:, :, None]) * lines + _sum_at_nodes(mix[:, :, None] * carried, edges.node, len(x))
        return (last[:, :, None] * lines).sum(dim=1), _sum_at_nodes(vector * vectors, edges.node, len(x))

    def _edge_coefficients(self, x: Tensor, edges: EdgeTensors, share: Tensor) -> Tensor:
        """Return the coefficients of the edges (E, ...) times the shares of their nodes (V,), in chunks of edges."""
        start, end = self.start(x), self.end(x)
        parts = []
        for node, neighbour, features in zip(*(torch.split(part, EDGES_PER_CHUNK) for part in edges), strict=True):
            inner = start[node] + end[neighbour] + self.along(features)
            coefficients = self.of_edges(nn.functional.leaky_relu(inner, LEAKY_SLOPE, inplace=True))
            parts.append(coefficients.mul_(share[node, None]))
        return torch.cat(parts)


class Prediction(NamedTuple):
    """Output of the network at N points.

    Attributes
    ----------
    line_field
        Logarithm of the squared stretch, at twice the angle of its direction in the tangent frame (N, 2).
    offsets
        Vectors to the points without noise, up to motions within the surface (N, 3).
    """

    line_field: Tensor
    offsets: Tensor


class StretchNetwork(nn.Module):
    """A U-Net over a graph hierarchy that predicts a line field of stretch, and offsets that remove noise.

    Shapes: a hierarchy of N points -> :class:`Prediction`. The line field is in the tangent frames of the hierarchy
    (:mod:`anisomesh.metric.tangent`); offsets are combinations of edge vectors and of the normals of the first levels.
    """

    def __init__(self, options: NetworkOptions) -> None:
        super().__init__()
        self.options = options
        channels, n_levels = options.channels, options.scales
        self.enter = nn.ModuleList(nn.Linear(N_NODE_FEATURES, channels) for _ in range(n_levels))
        self.down = nn.ModuleList(ResidualBlocks(channels, options.blocks) for _ in range(n_levels))
        self.up = nn.ModuleList(ResidualBlocks(channels, options.blocks) for _ in range(n_levels - 1))
        self.join = nn.ModuleList(nn.Linear(2 * channels, channels) for _ in range(n_levels - 1))
        self.heads = nn.ModuleList(EquivariantHead(channels) for _ in range(options.heads))
        self.rise = nn.Linear(channels, N_NORMAL_LEVELS)

    def forward(self, hierarchy: GraphHierarchy) -> Prediction:
        """Return the prediction at the points of a hierarchy."""
        device = self.rise.weight.device
        features = self._features(hierarchy)
        normals = torch.from_numpy(hierarchy.normals).to(device)
        line_field = torch.zeros((len(normals), 2), device=device)
        offsets = OFFSET_SCALE * (self.rise(features[0])[:, :, None] * normals).sum(dim=1)
        for head, level, x in zip(self.heads, hierarchy.levels, features, strict=False):
            ancestor = torch.from_numpy(level.ancestor).to(device)
            lines, vectors = head(x, level)
            line_field = line_field + rotated_lines(lines[ancestor], torch.from_numpy(level.point_transport).to(device))
            offsets = offsets + vectors[ancestor]
        return Prediction(line_field, offsets)

    def _features(self, hierarchy: GraphHierarchy) -> list[Tensor]:
        """Return the features (V, C) of the nodes of each level."""
        device = self.rise.weight.device
        skipped: list[Tensor] = []
        x: Tensor | None = None
        for k, level in enumerate(hierarchy.levels):
            entered = self.enter[k](INPUT_SCALE * torch.from_numpy(level.nodes).to(device))
            x = entered if x is None else entered + _max_pooled(x, hierarchy.levels[k - 1])
            x = self.down[k](x, level.graph)
            skipped.append(x)
        features = skipped.copy()
        for k in reversed(range(len(hierarchy.levels) - 1)):
            level = hierarchy.levels[k]
            cluster = torch.from_numpy(level.cluster).to(device)
            x = linear_of_concatenation(self.join[k], skipped[k], features[k + 1][cluster])
            features[k] = self.up[k](x, level.graph)
        return features


def linear_of_concatenation(linear: nn.Module, a: Tensor, b: Tensor) -> Tensor:
    """Return the linear map (V, C) of the concatenated rows of (V, A) and (V, B), without concatenating them."""
    assert isinstance(linear, nn.Linear)
    of_a, of_b = torch.split(linear.weight, [a.shape[1], b.shape[1]], dim=1)
    return nn.functional.linear(a, of_a, linear.bias).addmm_(b, of_b.T)


def rotated_lines(lines: Tensor, rotations: Tensor) -> Tensor:
    """Return lines (..., 2) rotated by unit complex numbers (..., 2), all at twice their angle."""
    real = lines[..., 0] * rotations[..., 0] - lines[..., 1] * rotations[..., 1]
    imaginary = lines[..., 0] * rotations[..., 1] + lines[..., 1] * rotations[..., 0]
    return torch.stack([real, imaginary], dim=-1)


def _max_pooled(x: Tensor, level: HierarchyLevel) -> Tensor:
    """Return the maximum over each cluster of a level (V', C) from (V, C)."""
    cluster = torch.from_numpy(level.cluster).to(x.device)
    n = int(level.cluster.max()) + 1 if level.cluster is not None and len(level.cluster) else 0
    start = x.new_full((n, x.shape[1]), -torch.inf)
    return start.scatter_reduce(0, cluster[:, None].expand_as(x), x, "amax", include_self=True)


def _sum_at_nodes(values: Tensor, node: Tensor, n: int) -> Tensor:
    """Return the sums of edge values (E, ...) at n nodes (V, ...)."""
    return values.new_zeros((n, *values.shape[1:])).index_add(0, node, values)
