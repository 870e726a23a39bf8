"""Deciding which of the faces with the same three points stay."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import FaceMask, Faces
from anisomesh.mesh import topology


def kept(faces: Faces) -> FaceMask:
    """Return which faces (F,) to keep so that no two have the same three points.

    Notes
    -----
    The first of equal faces is kept. The exception is a flap: two faces, back to back, hinged on edges of a
    surface that is closed without them. Keeping one would leave a loose fin with a boundary, so both go.
    """
    order, group = _groups(faces)
    first = np.zeros(len(faces), dtype=np.bool_)
    first[order[np.diff(group, prepend=-1) > 0]] = True
    if first.all():
        return first
    single = np.flatnonzero(first)
    face_edges = topology.edges_of(faces[single])[1]
    others = np.bincount(face_edges.ravel())[face_edges] - 1
    closed_without = (others % 2 == 0).all(axis=1) & (others >= 2).any(axis=1)
    size = np.bincount(group)
    turns = np.bincount(group, _even(faces[order]))
    back_to_back = ((size == 2) & (turns == 1))[group]
    candidate = np.zeros(len(faces), dtype=np.bool_)
    candidate[order[back_to_back]] = True
    first[single[closed_without & candidate[single]]] = False
    return first


def _groups(
    faces: Faces,
) -> tuple[np.ndarray[tuple[int], np.dtype[np.intp]], np.ndarray[tuple[int], np.dtype[np.intp]]]:
    """Return an order of the faces and, in that order, the number of the group of equal faces of each."""
    a, b, c = np.sort(faces, axis=1).T
    order = np.lexsort((np.arange(len(faces)), c, b, a))
    new = np.zeros(len(faces), dtype=np.intp)
    new[1:] = (np.diff(a[order]) != 0) | (np.diff(b[order]) != 0) | (np.diff(c[order]) != 0)
    return order, np.cumsum(new)


def _even(faces: Faces) -> FaceMask:
    """Return whether the corners are an even permutation of their sorted order."""
    a, b, c = faces.T
    return np.asarray((a < b) ^ (b < c) ^ (c < a) ^ True)
