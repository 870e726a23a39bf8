"""Training examples: items with noise, as pyramids, with the lines and offsets that a network is to find on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from anisomesh.learn.data.items import Item
from anisomesh.learn.models.hierarchy import Pyramid, pyramid
from anisomesh.mesh.geometry import sums_at_points
from anisomesh.mesh.noise import Noise, with_noise
from anisomesh.metric.line_field import line_field_components, principal_stretch

_UNTRUSTED = 0.1  # weight of points whose curvature is not known well


@dataclass(frozen=True, eq=False)
class Example:
    """A mesh as the network sees it, and what is wanted of it.

    Attributes
    ----------
    pyramid
        Graphs of the mesh of N points and E edges.
    lines
        Lines of the clean shape (N, 2).
    offsets
        To the points of the clean shape (N, 3), in mean edge lengths.
    quadrics
        Mean n n^t over the normals of the clean triangles at each point (N, 3, 3): along the others an offset does not
        matter.
    edges
        Edges (E, 2).
    weight
        Of the points (N,), sum 1.
    unit
        Mean edge length of the clean mesh.
    """

    pyramid: Pyramid
    lines: Tensor
    offsets: Tensor
    quadrics: Tensor
    edges: Tensor
    weight: Tensor
    unit: float


def example_of(
    item: Item,
    n_scales: int,
    noise: float = 0.0,
    rng: np.random.Generator | None = None,
    kind: Noise = "independent",
) -> Example:
    """Return an example.

    Parameters
    ----------
    item
        The mesh and the metric of its clean shape.
    n_scales
        Graphs of the pyramid.
    noise
        Its deviation, in mean edge lengths. What is wanted is still that of the clean shape.
    rng
        Of the noise.
    kind
        See :func:`anisomesh.mesh.noise.with_noise`.
    """
    clean = item.surface
    noisy = clean if rng is None else with_noise(clean, noise, rng, kind)
    directions, logarithms = principal_stretch(item.tensors)
    scales = pyramid(noisy, n_scales)
    area = sums_at_points(clean.face_areas, clean.faces, clean.n_points)
    normals = clean.face_normals
    products = clean.face_areas[:, None, None] * normals[:, :, None] * normals[:, None, :]
    quadrics = sums_at_points(products, clean.faces, clean.n_points)
    weight = area * np.where(item.trusted, 1.0, _UNTRUSTED)
    unit = float(clean.edge_lengths.mean())
    return Example(
        pyramid=scales,
        lines=torch.from_numpy(line_field_components(directions, logarithms, scales.frames)),
        offsets=torch.from_numpy(((clean.points - noisy.points) / unit).astype(np.float32)),
        quadrics=torch.from_numpy((quadrics / np.maximum(area, 1e-30)[:, None, None]).astype(np.float32)),
        edges=torch.from_numpy(clean.edges.astype(np.int64)),
        weight=torch.from_numpy((weight / weight.sum()).astype(np.float32)),
        unit=unit,
    )
