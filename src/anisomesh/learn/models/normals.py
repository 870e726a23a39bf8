"""The filter of normals with learnt weights, in torch; names of modules are the names in files of weights."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from anisomesh.denoise.filters import POINT_STEPS
from anisomesh.learn.architecture import HEAD_WIDTH, LEAKY_SLOPE, FilterOptions
from anisomesh.learn.graphs.faces import N_FACE_FEATURES, N_NEIGHBOUR_FEATURES, NORMAL_WIDTH, FaceGraph
from anisomesh.learn.models.stretch import ResidualBlocks
from anisomesh.mesh.surface import Surface


class FilteredNormals(NamedTuple):
    """Output of the filter at F faces and V points.

    Attributes
    ----------
    rounds
        Unit normals after each round, (F, 3) each.
    points
        Points after the steps that follow the last normals (V, 3).
    """

    rounds: list[Tensor]
    points: Tensor


class NormalFilter(nn.Module):
    """A bilateral filter of normals whose weights are corrected by a graph network over the faces.

    In each round the normal of a face becomes the unit mean of the normals n_j of its neighbours with the weights
    w_j exp(a_j - exp(b_j) |n_i - n_j|^2 / (2 s^2)), with w_j by area and distance, and learnt a and b for each pair
    and round. They depend on features that no rotation changes, so the normals rotate with the mesh. Before training a
    and b are zero, which is the bilateral filter. Then the points follow the normals in a fixed number of steps.
    """

    def __init__(self, options: FilterOptions) -> None:
        super().__init__()
        self.options = options
        channels = options.channels
        self.enter = nn.Linear(N_FACE_FEATURES, channels)
        self.blocks = ResidualBlocks(channels, options.blocks, edge_features=N_NEIGHBOUR_FEATURES)
        self.start = nn.Linear(channels, HEAD_WIDTH)
        self.end = nn.Linear(channels, HEAD_WIDTH, bias=False)
        self.along = nn.Linear(N_NEIGHBOUR_FEATURES, HEAD_WIDTH, bias=False)
        self.of_pairs = nn.Linear(HEAD_WIDTH, 2 * options.rounds)
        nn.init.zeros_(self.of_pairs.weight)
        nn.init.zeros_(self.of_pairs.bias)

    def forward(self, faces: FaceGraph) -> FilteredNormals:
        """Return the normals and points of a surface."""
        device = self.enter.weight.device
        pairs = faces.graph.edges_on(device)
        x = self.blocks(self.enter(torch.from_numpy(faces.nodes).to(device)), faces.graph)
        inner = self.start(x)[pairs.node] + self.end(x)[pairs.neighbour] + self.along(pairs.features)
        learnt = self.of_pairs(nn.functional.leaky_relu(inner, LEAKY_SLOPE))
        weight = torch.from_numpy(faces.weight).to(device)
        normals, rounds = torch.from_numpy(faces.normals).to(device), []
        for shift, narrowing in zip(*(part.unbind(dim=1) for part in learnt.chunk(2, dim=1)), strict=True):
            difference = ((normals[pairs.node] - normals[pairs.neighbour]) ** 2).sum(dim=1)
            spread = torch.exp(narrowing) * difference / (2.0 * NORMAL_WIDTH**2)
            weighted = (weight * torch.exp(shift - spread))[:, None] * normals[pairs.neighbour]
            normals = nn.functional.normalize(torch.zeros_like(normals).index_add(0, pairs.node, weighted), dim=1)
            rounds.append(normals)
        return FilteredNormals(rounds, _following(faces.surface, normals))


def _following(surface: Surface, normals: Tensor) -> Tensor:
    """Return :func:`anisomesh.denoise.filters.following_normals` as points (V, 3), float32."""
    device = normals.device
    faces = torch.from_numpy(surface.faces.astype(np.int64)).to(device)
    points = torch.from_numpy(surface.points.astype(np.float32)).to(device)
    corner, at = faces.flatten(), torch.arange(len(faces), device=device).repeat_interleave(3)
    count = torch.bincount(corner, minlength=len(points)).clamp(min=1)
    free = torch.from_numpy(~surface.on_boundary).to(device)
    share = (free / count)[:, None].to(points.dtype)
    for _ in range(POINT_STEPS):
        ways = points[faces].mean(dim=1)[at] - points[corner]
        steps = (ways * normals[at]).sum(dim=1, keepdim=True) * normals[at]
        points = points + share * torch.zeros_like(points).index_add(0, corner, steps)
    return points
