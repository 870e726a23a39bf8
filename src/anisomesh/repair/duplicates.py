"""Selection among faces with the same three points."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceMask, Faces
from anisomesh.mesh import topology


def select_unique_faces(faces: Faces) -> FaceMask:
    """Return which faces (F,) to keep such that no two have the same three points.

    Notes
    -----
    The first of equal faces is kept, except for flaps: two faces of opposite orientation on edges of a surface that is
    closed without them. Keeping one would add a boundary, so both are removed.
    """
    order, group = _group_by_points(faces)
    keep = np.zeros(len(faces), dtype=np.bool_)
    keep[order[np.diff(group, prepend=-1) > 0]] = True
    if keep.all():
        return keep
    unique = np.flatnonzero(keep)
    face_edges = topology.edges_of(faces[unique])[1]
    n_neighbours = np.bincount(face_edges.ravel())[face_edges] - 1
    closed_without = (n_neighbours % 2 == 0).all(axis=1) & (n_neighbours >= 2).any(axis=1)
    size = np.bincount(group)
    n_even = np.bincount(group, _is_even_permutation(faces[order]))
    opposite_pair = np.zeros(len(faces), dtype=np.bool_)
    opposite_pair[order[((size == 2) & (n_even == 1))[group]]] = True
    keep[unique[closed_without & opposite_pair[unique]]] = False
    return keep


def _group_by_points(faces: Faces) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return an order of the faces (F,) and, in this order, the group (F,) of faces with the same points."""
    a, b, c = np.sort(faces, axis=1).T
    order = np.lexsort((np.arange(len(faces)), c, b, a))
    differs = np.zeros(len(faces), dtype=np.intp)
    differs[1:] = (np.diff(a[order]) != 0) | (np.diff(b[order]) != 0) | (np.diff(c[order]) != 0)
    return order, np.cumsum(differs)


def _is_even_permutation(faces: Faces) -> FaceMask:
    """Return for each face (F,) whether its corners are an even permutation of their sorted order."""
    a, b, c = faces.T
    return np.asarray((a < b) ^ (b < c) ^ (c < a) ^ True)
