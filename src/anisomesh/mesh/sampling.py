"""Random points of a surface and of its edges, independent and uniform.

They come in the order of their faces or edges, so that searches for one after the other stay near by.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Points
from anisomesh.mesh.surface import Surface

Rows = npt.NDArray[np.int64]


def points_on_faces(surface: Surface, count: int, rng: np.random.Generator) -> tuple[Points, Rows]:
    """Draw points (count, 3) uniformly by area and return them with their faces (count,).

    A surface without area is sampled at its faces alike.
    """
    areas = surface.face_areas
    share = areas / surface.area if surface.area > 0.0 else np.full(surface.n_faces, 1.0 / surface.n_faces)
    face = np.sort(rng.choice(surface.n_faces, size=count, p=share))
    root, second = np.sqrt(rng.random(count)), rng.random(count)
    weights = np.stack([1.0 - root, root * (1.0 - second), root * second], axis=1)
    return np.asarray(np.einsum("nc,ncx->nx", weights, surface.points[surface.faces[face]])), face


def points_on_edges(surface: Surface, chosen: npt.NDArray[np.bool_], count: int, rng: np.random.Generator) -> Points:
    """Draw points (count, 3) uniformly by length from chosen edges (E,); none, (0, 3), where these have no length."""
    edges = np.flatnonzero(chosen & (surface.edge_lengths > 0.0))
    if len(edges) == 0:
        return np.zeros((0, 3))
    lengths = surface.edge_lengths[edges]
    which = np.sort(rng.choice(len(edges), size=count, p=lengths / lengths.sum()))
    ends = surface.points[surface.edges[edges[which]]]
    share = rng.random((count, 1))
    return np.asarray((1.0 - share) * ends[:, 0] + share * ends[:, 1])
