"""Losses: of embeddings (dot products at corners as in the paper, Laplacian, others), of lines and of offsets."""

from __future__ import annotations

from typing import Literal

import torch
from torch import Tensor

_ROUND_LINES = 0.05  # of the logarithm: errors below it count squared, larger ones in proportion
_ROUND = 0.02  # mean edge lengths: errors of offsets below it count squared, larger ones in proportion

LossName = Literal["dot", "l2", "cosine"]
LOSSES: tuple[LossName, ...] = ("dot", "l2", "cosine")


def corner_dots(embedded: Tensor, faces: Tensor) -> Tensor:
    """Return the dot products (F, 3) of the two sides that leave each corner of the faces (F, 3), points (V, d)."""
    corners = embedded[faces]
    ahead, back = corners.roll(-1, dims=1) - corners, corners.roll(1, dims=1) - corners
    return (ahead * back).sum(dim=2)


def dot_loss(embedded: Tensor, wanted: Tensor, faces: Tensor) -> Tensor:
    """Return the mean squared difference of dot products at corners, in mean squared edges of the one wanted.

    It says how far lengths and angles are from those wanted, and does not see motions of the embedding (equation 5 of
    the paper, which does not scale it).
    """
    dots = corner_dots(wanted, faces)
    sides = wanted[faces] - wanted[faces].roll(-1, dims=1)
    scale = (sides**2).sum(dim=2).mean().clamp(min=1e-30)
    return (((corner_dots(embedded, faces) - dots) / scale) ** 2).mean()


def l2_loss(extra: Tensor, wanted: Tensor) -> Tensor:
    """Return the mean squared difference of coordinates (V, k), in those wanted."""
    return ((extra - wanted) ** 2).mean() / (wanted**2).mean().clamp(min=1e-30)


def cosine_loss(extra: Tensor, wanted: Tensor) -> Tensor:
    """Return one less the mean cosine of the angles between coordinates (V, k) and those wanted."""
    return 1.0 - torch.nn.functional.cosine_similarity(extra, wanted, dim=1, eps=1e-8).mean()


def laplacian_loss(extra: Tensor, wanted: Tensor, edges: Tensor, *, aligned: bool = True) -> Tensor:
    """Return the mean squared difference of the Laplacians of coordinates (V, k), in those wanted.

    Parameters
    ----------
    extra, wanted
        Coordinates (V, k), and those wanted.
    edges
        Edges (E, 2), each once.
    aligned
        Whether those wanted are first turned as near to the others as an orthogonal map can (orthogonal Procrustes, not
        differentiated), because they are unique only up to one. The paper does not.

    Notes
    -----
    The Laplacian of a point is the mean of its neighbours less itself.
    """
    if aligned:
        with torch.no_grad():
            u, _, v = torch.linalg.svd((wanted - wanted.mean(dim=0)).T @ (extra - extra.mean(dim=0)))
            wanted = wanted @ (u @ v)
    difference = _laplacian(extra, edges) - _laplacian(wanted, edges)
    return (difference**2).mean() / (_laplacian(wanted, edges) ** 2).mean().clamp(min=1e-30)


def _laplacian(values: Tensor, edges: Tensor) -> Tensor:
    a, b = edges[:, 0], edges[:, 1]
    total = torch.zeros_like(values).index_add(0, a, values[b]).index_add(0, b, values[a])
    ones = torch.ones(len(edges), dtype=values.dtype, device=values.device)
    count = (
        torch.zeros(len(values), dtype=values.dtype, device=values.device).index_add(0, a, ones).index_add(0, b, ones)
    )
    return total / count.clamp(min=1.0)[:, None] - values


def line_loss(predicted: Tensor, wanted: Tensor, weight: Tensor) -> Tensor:
    """Return the weighted mean distance of lines (N, 2) to those wanted (N, 2), rounded off at zero; weights (N,)."""
    square = ((predicted - wanted) ** 2).sum(dim=1)
    distance = torch.sqrt(square + _ROUND_LINES**2) - _ROUND_LINES
    return (weight * distance).sum() / torch.clamp(weight.sum(), min=1e-30)


def offset_loss(offsets: Tensor, wanted: Tensor, quadrics: Tensor, edges: Tensor, weight: Tensor) -> Tensor:
    """Return how far points are from the surface wanted, and how rough they are over it.

    Parameters
    ----------
    offsets, wanted
        Of the points (V, 3), in mean edge lengths.
    quadrics
        Mean n n^t over the normals at each point (V, 3, 3); along other directions an error does not matter.
    edges
        Edges (E, 2), each once.
    weight
        Of the points (V,), sum 1.

    Notes
    -----
    The mean of the error in the quadric, and the mean over the edges of the error's difference at their ends, both
    rounded off at zero. The second is what turns triangles away from the surface.
    """
    error = offsets - wanted
    far = _rounded(torch.einsum("vi,vij,vj->v", error, quadrics, error))
    a, b = edges[:, 0], edges[:, 1]
    difference = error[a] - error[b]
    rough = _rounded(torch.einsum("ei,eij,ej->e", difference, 0.5 * (quadrics[a] + quadrics[b]), difference))
    share = weight[a] + weight[b]
    return (weight * far).sum() + (share * rough).sum() / share.sum().clamp(min=1e-30)


def _rounded(square: Tensor) -> Tensor:
    return torch.sqrt(square.clamp(min=0.0) + _ROUND**2) - _ROUND
