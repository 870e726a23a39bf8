"""The default network in NumPy: :class:`anisomesh.learn.models.stretch.StretchNetwork` without torch."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._kernels.messages import mean_messages
from anisomesh.learn.architecture import (
    EDGES_PER_CHUNK,
    HEAD_LINES,
    HEAD_ROUNDS,
    HEAD_WIDTH,
    INPUT_SCALE,
    LEAKY_SLOPE,
    OFFSET_SCALE,
    NetworkOptions,
)
from anisomesh.learn.graphs.graph import Graph
from anisomesh.learn.graphs.hierarchy import (
    N_EDGE_FEATURES,
    N_NODE_FEATURES,
    N_NORMAL_LEVELS,
    GraphHierarchy,
    HierarchyLevel,
)
from anisomesh.learn.inference.layers import (
    Floats,
    Ints,
    Layers,
    Shapes,
    leaky,
    linear_shapes,
    norm_shapes,
    sums_at_nodes,
)


def stretch_shapes(options: NetworkOptions) -> Shapes:
    """Return the shapes of the arrays of the network."""
    c, shapes = options.channels, linear_shapes("rise", options.channels, N_NORMAL_LEVELS)
    for k in range(options.scales):
        shapes |= linear_shapes(f"enter.{k}", N_NODE_FEATURES, c)
        shapes |= block_shapes(f"down.{k}", options.blocks, c, N_EDGE_FEATURES)
    for k in range(options.scales - 1):
        shapes |= linear_shapes(f"join.{k}", 2 * c, c)
        shapes |= block_shapes(f"up.{k}", options.blocks, c, N_EDGE_FEATURES)
    for k in range(options.heads):
        head, of_nodes = f"heads.{k}", (2 + HEAD_ROUNDS) * HEAD_LINES
        shapes |= linear_shapes(f"{head}.start", c, HEAD_WIDTH)
        shapes |= linear_shapes(f"{head}.end", c, HEAD_WIDTH, bias=False)
        shapes |= linear_shapes(f"{head}.along", N_EDGE_FEATURES, HEAD_WIDTH, bias=False)
        shapes |= linear_shapes(f"{head}.of_edges", HEAD_WIDTH, of_nodes + 1)
        shapes |= linear_shapes(f"{head}.of_nodes", c, of_nodes)
    return shapes


def block_shapes(name: str, count: int, channels: int, edge_features: int) -> Shapes:
    """Return the shapes of the arrays of residual blocks."""
    c, shapes = channels, Shapes()
    for k in range(count):
        convolution = f"{name}.{k}.convolution"
        shapes |= {f"{convolution}.along": (edge_features, c)} | norm_shapes(f"{name}.{k}.norm", c)
        shapes |= linear_shapes(f"{convolution}.sent", c, c, bias=False) | linear_shapes(f"{convolution}.own", c, c)
        shapes |= linear_shapes(f"{convolution}.out", 2 * c, c) | linear_shapes(f"{name}.{k}.out", c, c)
    return shapes


def blocks(layers: Layers, name: str, count: int, x: Floats, graph: Graph) -> Floats:
    """Return (V, C) after residual blocks: x + linear(leaky(norm(convolution(x))))."""
    for k in range(count):
        block = f"{name}.{k}"
        inner = leaky(layers.mesh_norm(f"{block}.norm", _convolution(layers, f"{block}.convolution", x, graph)))
        x = layers.linear(f"{block}.out", inner) + x
    return x


def _convolution(layers: Layers, name: str, x: Floats, graph: Graph) -> Floats:
    """Return (V, C): a map of the features and the mean of the messages from the neighbours."""
    own, sent = layers.linear(f"{name}.own", x), layers.linear(f"{name}.sent", x)
    mean = np.empty_like(own)
    along = layers.array(f"{name}.along")
    mean_messages(graph.first, graph.neighbour, own, sent, graph.features, along, LEAKY_SLOPE, mean)
    return layers.linear_of_both(f"{name}.out", x, mean)


class StretchInference:
    """The default network: from a graph hierarchy to a line field of stretch, and to offsets that remove noise.

    Parameters
    ----------
    options
        Sizes of the network.
    arrays
        Its weights by their names.

    Raises
    ------
    WeightsError
        If the arrays are not the weights of a network of these sizes.
    """

    def __init__(self, options: NetworkOptions, arrays: dict[str, npt.NDArray[Any]]) -> None:
        self.options = options
        self._layers = Layers(arrays, stretch_shapes(options))

    def __call__(self, hierarchy: GraphHierarchy) -> tuple[Floats, Floats]:
        """Return the line field (N, 2) and the offsets (N, 3) at the points of a hierarchy."""
        levels, features = hierarchy.levels, self._features(hierarchy.levels)
        rise = self._layers.linear("rise", features[0])
        offsets = np.float32(OFFSET_SCALE) * (rise[:, :, None] * hierarchy.normals).sum(axis=1)
        line_field = np.zeros((len(offsets), 2), dtype=np.float32)
        for k, (level, x) in enumerate(zip(levels[: self.options.heads], features, strict=False)):
            lines, vectors = self._head(f"heads.{k}", x, level)
            line_field += rotated_lines(lines[level.ancestor], level.point_transport)
            offsets += vectors[level.ancestor]
        return line_field, offsets

    def _features(self, levels: list[HierarchyLevel]) -> list[Floats]:
        """Return the features (V, C) of the nodes of each level: down to the coarsest and up again."""
        layers, count, skipped = self._layers, self.options.blocks, []
        x: Floats | None = None
        for k, level in enumerate(levels):
            entered = layers.linear(f"enter.{k}", np.float32(INPUT_SCALE) * level.nodes)
            x = entered if x is None else entered + _max_pooled(x, levels[k - 1].cluster)
            x = blocks(layers, f"down.{k}", count, x, level.graph)
            skipped.append(x)
        features = skipped.copy()
        for k in reversed(range(len(levels) - 1)):
            x = layers.linear_of_both(f"join.{k}", skipped[k], features[k + 1][levels[k].cluster])
            features[k] = blocks(layers, f"up.{k}", count, x, levels[k].graph)
        return features

    def _head(self, name: str, x: Floats, level: HierarchyLevel) -> tuple[Floats, Floats]:
        """Return lines (V, 2) and vectors (V, 3) from the features of the nodes of a level (V, C)."""
        first, neighbour = level.graph.first, level.graph.neighbour
        parts = HEAD_LINES * np.arange(1, 3 + HEAD_ROUNDS)
        of_edges = self._edge_coefficients(name, x, level.graph)
        direct, fitted, *mixing, vector = np.split(of_edges, parts, axis=1)
        curved, last, *keeping = np.split(self._layers.linear(f"{name}.of_nodes", x), parts[:-1], axis=1)
        along = direct[:, :, None] * level.directions[:, None] + fitted[:, :, None] * level.fit_weights[:, None]
        lines = sums_at_nodes(along, first) + curved[:, :, None] * level.curvature_line[:, None]
        for mix, keep in zip(mixing, keeping, strict=True):
            carried = rotated_lines(lines[neighbour], level.transport[:, None])
            lines = (np.float32(1.0) + keep[:, :, None]) * lines + sums_at_nodes(mix[:, :, None] * carried, first)
        return (last[:, :, None] * lines).sum(axis=1), sums_at_nodes(vector * level.vectors, first)

    def _edge_coefficients(self, name: str, x: Floats, graph: Graph) -> Floats:
        """Return the coefficients of the edges (E, ...) over the number of edges of their nodes, in chunks of edges."""
        layers, node = self._layers, graph.node
        share = (1.0 / np.maximum(np.diff(graph.first), 1)).astype(np.float32)
        start, end = layers.linear(f"{name}.start", x), layers.linear(f"{name}.end", x)
        found = np.empty((len(node), (2 + HEAD_ROUNDS) * HEAD_LINES + 1), dtype=np.float32)
        for begin in range(0, len(node), EDGES_PER_CHUNK):
            part = slice(begin, begin + EDGES_PER_CHUNK)
            inner = (
                start[node[part]] + end[graph.neighbour[part]] + layers.linear(f"{name}.along", graph.features[part])
            )
            found[part] = layers.linear(f"{name}.of_edges", leaky(inner)) * share[node[part], None]
        return found


def rotated_lines(lines: Floats, rotations: Floats) -> Floats:
    """Return lines (..., 2) rotated by unit complex numbers (..., 2), all at twice their angle."""
    real = lines[..., 0] * rotations[..., 0] - lines[..., 1] * rotations[..., 1]
    imaginary = lines[..., 0] * rotations[..., 1] + lines[..., 1] * rotations[..., 0]
    return np.stack([real, imaginary], axis=-1)


def _max_pooled(x: Floats, cluster: Ints | None) -> Floats:
    """Return the maximum (V', C) over the nodes (V, C) of each cluster; none is empty."""
    assert cluster is not None
    order = np.argsort(cluster, kind="stable")
    starts = np.flatnonzero(np.diff(cluster[order], prepend=-1))
    return np.asarray(np.maximum.reduceat(x[order], starts, axis=0))
