"""Training examples of the default network and of the filter of normals: items with noise, and the targets on them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from anisomesh.denoise.noise import Noise, with_noise
from anisomesh.learn.data.items import Item
from anisomesh.learn.graphs.faces import FaceGraph, face_graph
from anisomesh.learn.graphs.hierarchy import GraphHierarchy, graph_hierarchy
from anisomesh.mesh.geometry import sums_at_points
from anisomesh.mesh.surface import Surface
from anisomesh.metric.line_field import line_field_components, principal_stretch

_UNTRUSTED_WEIGHT = 0.1  # heuristic: weight, over the area, of points whose measured curvature is not reliable


@dataclass(frozen=True, eq=False)
class OffsetTarget:
    """Where the N points of a mesh with noise and E edges should go.

    Attributes
    ----------
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

    offsets: Tensor
    quadrics: Tensor
    edges: Tensor
    weight: Tensor
    unit: float


@dataclass(frozen=True, eq=False)
class StretchExample:
    """Input and targets of the default network for a mesh of N points.

    Attributes
    ----------
    hierarchy
        The input.
    line_field
        Line field of the clean shape, in the tangent frames of the input (N, 2).
    offsets
        Where the points should go.
    """

    hierarchy: GraphHierarchy
    line_field: Tensor
    offsets: OffsetTarget


@dataclass(frozen=True, eq=False)
class FilterExample:
    """Input and targets of the filter of normals for a mesh of N points and F faces.

    Attributes
    ----------
    faces
        The input.
    normals, area
        Unit normals of the clean mesh (F, 3), and the shares of its faces in its area (F,).
    corners
        Points of each face (F, 3).
    points
        Points with all of the noise (N, 3).
    offsets
        Where they should go.
    """

    faces: FaceGraph
    normals: Tensor
    area: Tensor
    corners: Tensor
    points: Tensor
    offsets: OffsetTarget


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
    return StretchExample(
        hierarchy=hierarchy, line_field=torch.from_numpy(line_field), offsets=_offset_target(item, noisy)
    )


def filter_example(
    item: Item, moved: Callable[[Surface], Surface], noise: float, rng: np.random.Generator, kind: Noise
) -> FilterExample:
    """Return the example of an item for the filter of normals.

    Parameters
    ----------
    item
        The mesh of the clean shape.
    moved
        Removes the noise that the network finds, which the filter goes on from.
    noise, rng, kind
        See :func:`anisomesh.denoise.noise.with_noise`.
    """
    clean = item.surface
    noisy = with_noise(clean, noise, rng, kind)
    return FilterExample(
        faces=face_graph(noisy, moved(noisy)),
        normals=torch.from_numpy(clean.face_normals.astype(np.float32)),
        area=torch.from_numpy((clean.face_areas / clean.area).astype(np.float32)),
        corners=torch.from_numpy(clean.faces.astype(np.int64)),
        points=torch.from_numpy(noisy.points.astype(np.float32)),
        offsets=_offset_target(item, noisy),
    )


def _offset_target(item: Item, noisy: Surface) -> OffsetTarget:
    """Return the offsets from a surface with noise to the clean mesh of an item."""
    clean = item.surface
    area = sums_at_points(clean.face_areas, clean.faces, clean.n_points)
    normals = clean.face_normals
    products = clean.face_areas[:, None, None] * normals[:, :, None] * normals[:, None, :]
    quadrics = sums_at_points(products, clean.faces, clean.n_points)
    weight = area * np.where(item.trusted, 1.0, _UNTRUSTED_WEIGHT)
    unit = float(clean.edge_lengths.mean())
    return OffsetTarget(
        offsets=torch.from_numpy(((clean.points - noisy.points) / unit).astype(np.float32)),
        quadrics=torch.from_numpy((quadrics / np.maximum(area, 1e-30)[:, None, None]).astype(np.float32)),
        edges=torch.from_numpy(clean.edges.astype(np.int64)),
        weight=torch.from_numpy((weight / weight.sum()).astype(np.float32)),
        unit=unit,
    )
