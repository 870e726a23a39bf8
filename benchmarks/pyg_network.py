"""The paper's network in PyTorch Geometric, written as a user of that library would, for comparison."""

from __future__ import annotations

import torch
from scipy.spatial import cKDTree
from torch import Tensor, nn
from torch_geometric.nn import MessagePassing, TopKPooling

INPUTS, OUTPUTS = 6, 5
NEAREST = 3


class Convolution(MessagePassing):
    """W0 (f_i, max_j W1 (f_j, f_j - f_i, |f_j - f_i|)), section 3.2 of the paper."""

    def __init__(self, inputs: int, channels: int) -> None:
        super().__init__(aggr="max")
        self.along = nn.Linear(2 * inputs + 1, channels)
        self.out = nn.Linear(inputs + channels, channels)

    def forward(self, x: Tensor, edges: Tensor) -> Tensor:
        return self.out(torch.cat([x, self.propagate(edges, x=x)], dim=1))

    def message(self, x_i: Tensor, x_j: Tensor) -> Tensor:
        way = x_j - x_i
        return self.along(torch.cat([x_j, way, way.norm(dim=1, keepdim=True)], dim=1))


class Block(nn.Module):
    def __init__(self, inputs: int, channels: int) -> None:
        super().__init__()
        self.convolutions = nn.ModuleList([Convolution(inputs, channels), Convolution(channels, channels)])
        self.norms = nn.ModuleList(nn.BatchNorm1d(channels) for _ in range(2))
        self.skip = nn.Linear(inputs, channels) if inputs != channels else nn.Identity()

    def forward(self, x: Tensor, edges: Tensor) -> Tensor:
        inner = x
        for convolution, norm in zip(self.convolutions, self.norms, strict=True):
            inner = nn.functional.leaky_relu(norm(convolution(inner, edges)), 0.1)
        return self.skip(x) + inner


class Network(nn.Module):
    """Points and normals (N, 6), their edges (2, E), positions (N, 3) -> extra coordinates (N, 5)."""

    def __init__(self, channels: int = 256, levels: int = 5, ratio: float = 0.5) -> None:
        super().__init__()
        self.down = nn.ModuleList(Block(channels if k else INPUTS, channels) for k in range(levels))
        self.pools = nn.ModuleList(TopKPooling(channels, ratio) for _ in range(levels))
        self.bottom = Block(channels, channels)
        self.up = nn.ModuleList(Block(channels, channels) for _ in range(levels))
        self.out = nn.Linear(channels, OUTPUTS)

    def forward(self, x: Tensor, edges: Tensor, positions: Tensor) -> Tensor:
        way = []
        for block, pool in zip(self.down, self.pools, strict=True):
            x = block(x, edges)
            pooled, coarse, _, _, kept, _ = pool(x, edges)
            way.append((x, edges, positions, positions[kept]))
            x, edges, positions = pooled, coarse, positions[kept]
        x = self.bottom(x, edges)
        for block, (before, edges, positions, kept) in zip(self.up, reversed(way), strict=True):
            x = block(before + interpolated(x, positions, kept), edges)
        return self.out(x)


def interpolated(x: Tensor, positions: Tensor, kept: Tensor) -> Tensor:
    """Return values at all positions from the three nearest kept nodes, weighted by inverse distance."""
    distance, nearest = cKDTree(kept.numpy()).query(positions.numpy(), k=min(NEAREST, len(kept)))
    weight = 1.0 / torch.from_numpy(distance).float().clamp(min=1e-12)
    weight = weight / weight.sum(dim=1, keepdim=True)
    return (weight[:, :, None] * x[torch.from_numpy(nearest)]).sum(dim=1)
