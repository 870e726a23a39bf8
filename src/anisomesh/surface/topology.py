"""Connectivity of triangle lists: edges, adjacency, boundary loops, components."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeIndices, Edges, FaceIndices, Faces


def half_edges(faces: Faces) -> npt.NDArray[np.int32]:
    """Return the directed sides (3F, 2) of the faces: row ``3 f + c`` is the side opposite corner ``c``."""
    return faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)


def edges_of(faces: Faces) -> tuple[Edges, FaceIndices]:
    """Return the unique edges (E, 2), lower index first, and the edge opposite each corner (F, 3)."""
    sides = np.sort(half_edges(faces), axis=1).astype(np.int64)
    keys = sides[:, 0] << 32 | sides[:, 1]
    unique, inverse = np.unique(keys, return_inverse=True)
    edges = np.stack([unique >> 32, unique & 0xFFFFFFFF], axis=1).astype(np.int32)
    return edges, inverse.reshape(-1, 3).astype(np.int32)


def edge_faces(face_edges: FaceIndices, n_edges: int) -> EdgeIndices:
    """Return the faces at each edge (E, 2): second -1 on the boundary, both -1 where not manifold."""
    flat = face_edges.ravel()
    order = np.argsort(flat, kind="stable")
    count = np.bincount(flat, minlength=n_edges)
    start = np.cumsum(count) - count
    result = np.full((n_edges, 2), -1, dtype=np.int32)
    one, two = count == 1, count == 2
    result[one | two, 0] = order[start[one | two]] // 3
    result[two, 1] = order[start[two] + 1] // 3
    return result


def face_neighbours(face_edges: FaceIndices, edge_faces: EdgeIndices) -> FaceIndices:
    """Return the face across the side opposite each corner (F, 3), -1 for none."""
    pairs = edge_faces[face_edges]
    own = np.arange(len(face_edges), dtype=np.int32)[:, None]
    return np.where(pairs[:, :, 0] == own, pairs[:, :, 1], pairs[:, :, 0]).astype(np.int32)
