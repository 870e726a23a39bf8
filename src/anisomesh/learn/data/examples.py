"""Training examples of the default network: items with noise as graph hierarchies, and the targets on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from anisomesh.denoise.noise import Noise, with_noise
from anisomesh.learn.data.items import Item
from anisomesh.learn.graphs.hierarchy import GraphHierarchy, graph_hierarchy
from anisomesh.mesh.geometry import sums_at_points
from anisomesh.metric.line_field import line_field_components, principal_stretch

_UNTRUSTED_WEIGHT = 0.1  # heuristic: weight, over the area, of points whose measured curvature is not reliable


@dataclass(frozen=True, eq=False)
class StretchExample:
    """Input and targets of the default network for a mesh of N points and E edges.

    Attributes
    ----------
    hierarchy
        The input.
    line_field
        Line field of the clean shape, in the tangent frames of the input (N, 2).
    offsets
        Vectors to the points of the clean shape (N, 3), in mean edge lengths.
    quadrics
        Mean n n^t over the normals of the clean triangles at each point (N, 3, 3); errors of an offset in other
        directions do not count.
    edges
        Edges (E, 2), each once.
    weight
        Weights of the points (N,), with sum 1.
    unit
        Mean edge length of the clean mesh.
    """

    hierarchy: GraphHierarchy
    line_field: Tensor
    offsets: Tensor
    quadrics: Tensor
    edges: Tensor
    weight: Tensor
    unit: float


def stretch_example(
    item: Item,
    n_levels: int,
    noise: float = 0.0,
    rng: np.random.Generator | None = None,
    kind: Noise = "independent",
) -> StretchExample:
    """Return the example of an item.

    Parameters
    ----------
    item
        The mesh and the metric of its clean shape.
    n_levels
        Number of levels of the graph hierarchy.
    noise
        Standard deviation of noise on the input, in mean edge lengths; the targets are of the clean shape.
    rng
        Random numbers of the noise; None for none.
    kind
        See :func:`anisomesh.denoise.noise.with_noise`.
    """
    clean = item.surface
    noisy = clean if rng is None else with_noise(clean, noise, rng, kind)
    hierarchy = graph_hierarchy(noisy, n_levels)
    line_field = line_field_components(*principal_stretch(item.tensors), hierarchy.frames)
    area = sums_at_points(clean.face_areas, clean.faces, clean.n_points)
    normals = clean.face_normals
    products = clean.face_areas[:, None, None] * normals[:, :, None] * normals[:, None, :]
    quadrics = sums_at_points(products, clean.faces, clean.n_points)
    weight = area * np.where(item.trusted, 1.0, _UNTRUSTED_WEIGHT)
    unit = float(clean.edge_lengths.mean())
    return StretchExample(
        hierarchy=hierarchy,
        line_field=torch.from_numpy(line_field),
        offsets=torch.from_numpy(((clean.points - noisy.points) / unit).astype(np.float32)),
        quadrics=torch.from_numpy((quadrics / np.maximum(area, 1e-30)[:, None, None]).astype(np.float32)),
        edges=torch.from_numpy(clean.edges.astype(np.int64)),
        weight=torch.from_numpy((weight / weight.sum()).astype(np.float32)),
        unit=unit,
    )
