"""The network of the paper in NumPy: :class:`anisomesh.learn.models.paper.PaperNetwork` without torch."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._kernels.messages import feature_distances, max_messages
from anisomesh.learn.architecture import DISTANCE_SOFTENING, PAPER_INPUTS, PAPER_OUTPUTS, PaperOptions
from anisomesh.learn.graphs.graph import Graph, mesh_graph
from anisomesh.learn.graphs.pooling import connected_within_two_edges, interpolation_weights
from anisomesh.learn.inference.layers import Floats, Ints, Layers, Shapes, leaky, linear_shapes, norm_shapes
from anisomesh.mesh.surface import Surface


def paper_shapes(options: PaperOptions) -> Shapes:
    """Return the shapes of the arrays of the network."""
    c = options.channels
    shapes = _block_shapes("bottom", c if options.levels else PAPER_INPUTS, options)
    shapes |= linear_shapes("out", c, PAPER_OUTPUTS)
    for k in range(options.levels):
        shapes |= _block_shapes(f"down.{k}", PAPER_INPUTS if k == 0 else c, options)
        shapes |= _block_shapes(f"up.{k}", c, options)
        shapes |= {f"pools.{k}.direction": (c,)}
    return shapes


def _block_shapes(name: str, inputs: int, options: PaperOptions) -> Shapes:
    channels, running = options.channels, options.norm == "batch"
    shapes: Shapes = {} if inputs == channels else linear_shapes(f"{name}.skip", inputs, channels)
    for k, (convolution, width) in enumerate((("first", inputs), ("second", channels))):
        part = f"{name}.{convolution}"
        shapes |= {f"{part}.away": (1, channels)} | norm_shapes(f"{name}.norms.{k}", channels, running=running)
        for own in ("sent", "own"):
            shapes |= linear_shapes(f"{part}.{own}", width, channels, bias=False)
        shapes |= linear_shapes(f"{part}.out", width + channels, channels)
    return shapes


class PaperInference:
    """The network of the paper: from points and normals to the extra coordinates of the embedding.

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

    def __init__(self, options: PaperOptions, arrays: dict[str, npt.NDArray[Any]]) -> None:
        self.options = options
        self._layers = Layers(arrays, paper_shapes(options))

    def __call__(self, surface: Surface) -> Floats:
        """Return the extra coordinates (N, 5) of the points of a surface at bounding-box diagonal 1."""
        x = np.concatenate([surface.points, surface.point_normals], axis=1).astype(np.float32)
        graph, points, skipped = mesh_graph(surface), surface.points, []
        for k in range(self.options.levels):
            x = self._block(f"down.{k}", x, graph)
            pooled, kept = self._pooled(f"pools.{k}", x)
            skipped.append((x, graph, points, kept))
            x, graph, points = pooled, connected_within_two_edges(graph, kept), points[kept]
        x = self._block("bottom", x, graph)
        for k, (before, fine, places, kept) in enumerate(reversed(skipped)):
            nearest, weights = interpolation_weights(places, kept)
            x = self._block(f"up.{k}", before + (weights[:, :, None] * x[nearest]).sum(axis=1), fine)
        return self._layers.linear("out", x)

    def _block(self, name: str, x: Floats, graph: Graph) -> Floats:
        """Return (V, C): two times convolution and norm, a leaky rectifier after each, and a skip connection."""
        layers = self._layers
        norm = layers.batch_norm if self.options.norm == "batch" else layers.mesh_norm
        inner = leaky(norm(f"{name}.norms.0", self._convolution(f"{name}.first", x, graph)))
        inner = norm(f"{name}.norms.1", self._convolution(f"{name}.second", inner, graph))
        skipped = x if x.shape[1] == inner.shape[1] else layers.linear(f"{name}.skip", x)
        return leaky(inner + skipped) if self.options.skip == "before" else leaky(inner) + skipped

    def _convolution(self, name: str, x: Floats, graph: Graph) -> Floats:
        """Return (V, C): a map of the features and the maximum of the messages from the neighbours."""
        layers = self._layers
        distance = np.empty(len(graph.neighbour), dtype=np.float32)
        feature_distances(graph.first, graph.neighbour, x, DISTANCE_SOFTENING, distance)
        sent = layers.linear(f"{name}.sent", x)
        maximum, winner = np.empty_like(sent), np.empty(sent.shape, dtype=np.int32)
        away = layers.array(f"{name}.away")
        max_messages(graph.first, graph.neighbour, sent, distance[:, None], away, maximum, winner)
        return layers.linear_of_both(f"{name}.out", x, maximum - layers.linear(f"{name}.own", x))

    def _pooled(self, name: str, x: Floats) -> tuple[Floats, Ints]:
        """Return the features of the nodes of highest score (V', C), times its tanh, and their indices (V',)."""
        direction = self._layers.array(f"{name}.direction").astype(np.float64)
        score = np.einsum("vc,c->v", x, direction / np.linalg.norm(direction))
        n = max(1, int(np.ceil(self.options.ratio * len(x))))
        kept = np.sort(np.argsort(-score, kind="stable")[:n])
        return x[kept] * np.tanh(score[kept]).astype(np.float32)[:, None], kept
