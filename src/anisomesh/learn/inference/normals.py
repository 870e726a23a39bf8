"""The filter of normals in NumPy: :class:`anisomesh.learn.models.normals.NormalFilter` without torch."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.denoise.filters import following_normals
from anisomesh.learn.architecture import HEAD_WIDTH, FilterOptions
from anisomesh.learn.graphs.faces import N_FACE_FEATURES, N_NEIGHBOUR_FEATURES, NORMAL_WIDTH, FaceGraph, face_graph
from anisomesh.learn.inference.layers import Floats, Layers, Shapes, leaky, linear_shapes
from anisomesh.learn.inference.stretch import block_shapes, blocks
from anisomesh.mesh.surface import Surface


def filter_shapes(options: FilterOptions) -> Shapes:
    """Return the shapes of the arrays of the filter."""
    c = options.channels
    shapes = linear_shapes("enter", N_FACE_FEATURES, c)
    shapes |= block_shapes("blocks", options.blocks, c, N_NEIGHBOUR_FEATURES)
    shapes |= linear_shapes("start", c, HEAD_WIDTH) | linear_shapes("end", c, HEAD_WIDTH, bias=False)
    shapes |= linear_shapes("along", N_NEIGHBOUR_FEATURES, HEAD_WIDTH, bias=False)
    return shapes | linear_shapes("of_pairs", HEAD_WIDTH, 2 * options.rounds)


class NormalFilterInference:
    """The filter of normals with learnt weights.

    Parameters
    ----------
    options
        Sizes of the network.
    arrays
        Its weights by their names.

    Raises
    ------
    WeightsError
        If the arrays are not the weights of a filter of these sizes.
    """

    def __init__(self, options: FilterOptions, arrays: dict[str, npt.NDArray[Any]]) -> None:
        self.options = options
        self._layers = Layers(arrays, filter_shapes(options))

    def __call__(self, noisy: Surface, moved: Surface) -> Surface:
        """Return a surface whose points follow its filtered normals; ``noisy`` is it with all of the noise."""
        faces = face_graph(noisy, moved)
        pairs, neighbours = self._pairs(faces), faces.neighbours
        face, neighbour, normals = neighbours.face, neighbours.neighbour, moved.face_normals
        for shift, narrowing in zip(*np.split(pairs.T.astype(np.float64), 2), strict=True):
            difference = ((normals[face] - normals[neighbour]) ** 2).sum(axis=1)
            spread = np.exp(narrowing) * difference / (2.0 * NORMAL_WIDTH**2)
            normals = neighbours.averaged(neighbours.weight * np.exp(shift - spread), normals)
        return following_normals(moved, neighbours, normals)

    def _pairs(self, faces: FaceGraph) -> Floats:
        """Return what is learnt for each pair of neighbours: a shift of its weight by round, then a narrowing."""
        layers, graph = self._layers, faces.graph
        x = blocks(layers, "blocks", self.options.blocks, layers.linear("enter", faces.nodes), graph)
        start, end = layers.linear("start", x), layers.linear("end", x)
        inner = start[graph.node] + end[graph.neighbour] + layers.linear("along", graph.features)
        return layers.linear("of_pairs", leaky(inner))
