"""Independent, uniformly distributed random points on faces and edges of a surface.

They are sorted by face or edge, so that successive closest-point queries are close together in memory.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Points
from anisomesh.mesh.surface import Surface


def points_on_faces(surface: Surface, count: int, rng: np.random.Generator) -> tuple[Points, npt.NDArray[np.int64]]:
    """Sample points (count, 3) uniformly by area and return them with their faces (count,).

    On a surface of zero area every face has the same probability.
    """
    areas = surface.face_areas
    probability = areas / surface.area if surface.area > 0.0 else np.full(surface.n_faces, 1.0 / surface.n_faces)
    face = np.sort(rng.choice(surface.n_faces, size=count, p=probability))
    root, second = np.sqrt(rng.random(count)), rng.random(count)
    weights = np.stack([1.0 - root, root * (1.0 - second), root * second], axis=1)
    return np.asarray(np.einsum("nc,ncx->nx", weights, surface.points[surface.faces[face]])), face


def points_on_edges(surface: Surface, chosen: npt.NDArray[np.bool_], count: int, rng: np.random.Generator) -> Points:
    """Sample points (count, 3) uniformly by length on the chosen edges (E,); none, (0, 3), if their length is zero."""
    edges = np.flatnonzero(chosen & (surface.edge_lengths > 0.0))
    if len(edges) == 0:
        return np.zeros((0, 3))
    lengths = surface.edge_lengths[edges]
    sampled = np.sort(rng.choice(len(edges), size=count, p=lengths / lengths.sum()))
    ends = surface.points[surface.edges[edges[sampled]]]
    fraction = rng.random((count, 1))
    return np.asarray((1.0 - fraction) * ends[:, 0] + fraction * ends[:, 1])
