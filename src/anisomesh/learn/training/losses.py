"""Losses of embeddings (dot products and Laplacian as in the paper, and others), line fields, offsets and normals."""

from __future__ import annotations

import torch
from torch import Tensor

from anisomesh.learn.data.examples import OffsetTarget

_LINE_SOFTENING = 0.05  # of the log squared stretch: the loss is quadratic below and linear above it (heuristic)
_NORMAL_SOFTENING = 0.02  # radians: the loss is quadratic below and linear above it (heuristic)
_OFFSET_SOFTENING = 0.02  # mean edge lengths: the loss is quadratic below and linear above it (heuristic)

_POINT_COORDINATES = 3  # of the embedding; the network finds the others

LOSSES, LAPLACIAN_SCALES = ("dot", "l2", "cosine"), ("paper", "relative")
"""Losses of embeddings, and the scales of the Laplacian loss that is added to them."""


def corner_dots(embedded: Tensor, faces: Tensor) -> Tensor:
    """Return the dot products (F, 3) of the two edge vectors at each corner of faces (F, 3), from points (V, d)."""
    corners = embedded[faces]
    ahead, back = corners.roll(-1, dims=1) - corners, corners.roll(1, dims=1) - corners
    return (ahead * back).sum(dim=2)


def dot_loss(embedded: Tensor, target: Tensor, faces: Tensor) -> Tensor:
    """Return the mean squared difference of the dot products at corners, over the squared mean squared target edge.

    It compares lengths and angles and is invariant to rigid motions of the embedding: equation 5 of the paper, which
    does not scale it. Points (V, d), target (V, d), faces (F, 3).
    """
    scale = _mean_squared_edge(target, faces)
    return (((corner_dots(embedded, faces) - corner_dots(target, faces)) / scale) ** 2).mean()


def _mean_squared_edge(target: Tensor, faces: Tensor) -> Tensor:
    sides = target[faces] - target[faces].roll(-1, dims=1)
    return (sides**2).sum(dim=2).mean().clamp(min=1e-30)


def l2_loss(extra: Tensor, target: Tensor) -> Tensor:
    """Return the mean squared error of coordinates (V, k), over the mean square of the target (V, k)."""
    return ((extra - target) ** 2).mean() / (target**2).mean().clamp(min=1e-30)


def cosine_loss(extra: Tensor, target: Tensor) -> Tensor:
    """Return one minus the mean cosine of the angle between coordinates (V, k) and the target (V, k), by point."""
    return 1.0 - torch.nn.functional.cosine_similarity(extra, target, dim=1, eps=1e-8).mean()


def laplacian_loss(extra: Tensor, target: Tensor, edges: Tensor, *, aligned: bool = True) -> Tensor:
    """Return the mean squared error of the Laplacians of coordinates (V, k), in squared lengths.

    Parameters
    ----------
    extra, target
        Coordinates and their target (V, k).
    edges
        Edges (E, 2), each once.
    aligned
        Whether the target is first aligned to the coordinates by an orthogonal map (orthogonal Procrustes, without
        gradient), since it is unique only up to such a map. The paper does not align it.

    Notes
    -----
    The Laplacian is uniform: the mean of the neighbours minus the point. The mean is over the points and the 3 + k
    coordinates of the whole embedding, as in the authors' code. The first three have no error: they are the points.
    """
    if aligned:
        with torch.no_grad():
            u, _, v = torch.linalg.svd((target - target.mean(dim=0)).T @ (extra - extra.mean(dim=0)))
            target = target @ (u @ v)
    difference = _laplacian(extra, edges) - _laplacian(target, edges)
    return _mean_of_embedding(difference**2)


def laplacian_unit(name: str, scale: str, extra: Tensor, whole: Tensor, faces: Tensor, edges: Tensor) -> Tensor:
    """Return what :func:`laplacian_loss` is divided by before it is weighted and added to the loss of a name.

    Parameters
    ----------
    name
        The loss that it is added to.
    scale
        ``"paper"`` divides it by what turns the paper's unscaled loss of this name into the one here, so that the sum
        is the paper's L + w L_lap times a factor that depends on the target only. ``"relative"`` divides it by its
        value for coordinates that are all 0.
    extra, whole
        Target coordinates beyond the first three (V, k), and all of them (V, 3 + k).
    faces, edges
        Faces (F, 3) and edges (E, 2) of the mesh.

    Notes
    -----
    With lengths l, dot products are of order l^2, so the dot loss is of order l^4 and the Laplacian loss of order l^2:
    a weight has a meaning only at one size of the meshes. The authors' are, as here, at bounding-box diagonal 1.
    """
    if scale == "relative":
        unit = _mean_of_embedding(_laplacian(extra, edges) ** 2)
    elif name == "dot":
        unit = _mean_squared_edge(whole, faces) ** 2
    else:
        unit = _mean_of_embedding(extra**2) if name == "l2" else torch.ones((), dtype=extra.dtype)
    return unit.clamp(min=1e-30)


def _mean_of_embedding(values: Tensor) -> Tensor:
    """Return the mean of values (V, k) and of three columns of zeros."""
    return values.sum() / (len(values) * (_POINT_COORDINATES + values.shape[1]))


def _laplacian(values: Tensor, edges: Tensor) -> Tensor:
    a, b = edges[:, 0], edges[:, 1]
    total = torch.zeros_like(values).index_add(0, a, values[b]).index_add(0, b, values[a])
    ones = torch.ones(len(edges), dtype=values.dtype, device=values.device)
    count = (
        torch.zeros(len(values), dtype=values.dtype, device=values.device).index_add(0, a, ones).index_add(0, b, ones)
    )
    return total / count.clamp(min=1.0)[:, None] - values


def line_loss(predicted: Tensor, target: Tensor, weight: Tensor) -> Tensor:
    """Return the mean distance between line fields (N, 2), weighted (N,) and smoothed at zero."""
    square = ((predicted - target) ** 2).sum(dim=1)
    distance = torch.sqrt(square + _LINE_SOFTENING**2) - _LINE_SOFTENING
    return (weight * distance).sum() / torch.clamp(weight.sum(), min=1e-30)


def offset_loss(offsets: Tensor, target: OffsetTarget) -> Tensor:
    """Return the distance of the moved points from the target surface plus their roughness over it.

    Parameters
    ----------
    offsets
        Offsets of the points (V, 3), in mean edge lengths.
    target
        The offsets to be found.

    Notes
    -----
    The mean over points of the norm of the error in the quadric, plus the mean over edges of the norm of the difference
    of the errors at their ends, which tilts triangles. Both norms are smoothed at zero.
    """
    quadrics, edges, weight = target.quadrics, target.edges, target.weight
    error = offsets - target.offsets
    distance = _smoothed_root(torch.einsum("vi,vij,vj->v", error, quadrics, error))
    a, b = edges[:, 0], edges[:, 1]
    difference = error[a] - error[b]
    roughness = _smoothed_root(torch.einsum("ei,eij,ej->e", difference, 0.5 * (quadrics[a] + quadrics[b]), difference))
    share = weight[a] + weight[b]
    return (weight * distance).sum() + (share * roughness).sum() / share.sum().clamp(min=1e-30)


def normal_loss(normals: Tensor, target: Tensor, area: Tensor) -> Tensor:
    """Return the mean distance between unit normals (F, 3), weighted by shares of the area (F,), smoothed at zero."""
    square = ((normals - target) ** 2).sum(dim=1)
    return (area * (torch.sqrt(square + _NORMAL_SOFTENING**2) - _NORMAL_SOFTENING)).sum()


def _smoothed_root(square: Tensor) -> Tensor:
    return torch.sqrt(square.clamp(min=0.0) + _OFFSET_SOFTENING**2) - _OFFSET_SOFTENING
