"""Removing faces without area such that a closed surface stays closed."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse import csgraph

from anisomesh._arrays import FaceMask, Faces, Floats, Points
from anisomesh.mesh import geometry, topology

FLAT = 1e-14
"""A face is degenerate if twice its area is at most this times its longest side squared."""

MAX_ROUNDS = 100


def remove_degenerate(
    points: Points, faces: Faces, labels: npt.NDArray[np.int32]
) -> tuple[Faces, npt.NDArray[np.int32]]:
    """Remove faces with repeated points or without area.

    Parameters
    ----------
    points
        Coordinates (V, 3).
    faces
        Point indices (F, 3).
    labels
        Points with the same label (V,) are one point; a label is the index of one of its points.

    Returns
    -------
    tuple
        The faces that are left (F', 3), and the labels (V,) after the merges that this took.

    Notes
    -----
    A face of three distinct points on a line cannot simply be left out: its neighbours would no longer meet.
    A needle (one side about zero) has that side merged into a point. A cap (one point on the opposite side)
    gives its long side to the neighbour across: the neighbour is split at that point and the cap is gone. Both
    keep a closed surface closed. Caps on a common face are handled in turn, longest first; a cap whose long
    side is on the boundary is dropped, which leaves its two short sides as the boundary.
    """
    faces, labels = faces.copy(), labels.copy()
    points = _scaled(points)
    for _ in range(MAX_ROUNDS):
        faces = faces[~_repeats(labels[faces])]
        if len(faces) == 0:
            break
        sides = _side_lengths(points, labels[faces])
        flat = _flat(points, labels[faces], sides)
        if not flat.any():
            return faces, labels
        needle = flat & (sides.min(axis=1) <= 2 * FLAT * sides.max(axis=1))
        if needle.any():
            labels = _merge(faces[needle], sides[needle], labels)
        else:
            faces = _flip_caps(faces, labels, sides, np.flatnonzero(flat))
    else:
        faces = faces[~_flat(points, labels[faces], _side_lengths(points, labels[faces]))]
    return faces, labels


def is_degenerate(points: Points, faces: Faces) -> FaceMask:
    """Return which faces (F,) have a repeated point or no area."""
    return np.asarray(_repeats(faces) | _flat(_scaled(points), faces, _side_lengths(_scaled(points), faces)))


def _scaled(points: Points) -> Points:
    """Return the points at about unit size; a power of two keeps every digit, so that decisions can be repeated."""
    return np.asarray(np.ldexp(points, -int(np.frexp(np.abs(points).max())[1])))


def _repeats(faces: Faces) -> FaceMask:
    a, b, c = faces.T
    return np.asarray((a == b) | (b == c) | (c == a))


def _side_lengths(points: Points, faces: Faces) -> npt.NDArray[np.float64]:
    """Return the length of the side opposite each corner (F, 3)."""
    return np.stack(
        [np.linalg.norm(points[faces[:, c - 2]] - points[faces[:, c - 1]], axis=1) for c in range(3)], axis=1
    )


def _flat(points: Points, faces: Faces, sides: npt.NDArray[np.float64]) -> FaceMask:
    doubled: Floats = np.linalg.norm(geometry.face_cross(points, faces), axis=1)
    return np.asarray(doubled <= FLAT * sides.max(axis=1) ** 2)


def _merge(faces: Faces, sides: npt.NDArray[np.float64], labels: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Give the ends of the shortest side of each of these faces one label."""
    rows, shortest = np.arange(len(faces)), sides.argmin(axis=1)
    a, b = labels[faces[rows, shortest - 2]], labels[faces[rows, shortest - 1]]
    graph = sparse.coo_matrix((np.ones(len(a), dtype=np.bool_), (a, b)), shape=(len(labels), len(labels)))
    group = csgraph.connected_components(graph, directed=False)[1]
    lowest = np.full(len(labels), len(labels), dtype=np.int32)
    np.minimum.at(lowest, group, labels)
    merged: npt.NDArray[np.int32] = lowest[group[labels]]
    return merged


def _flip_caps(
    faces: Faces, labels: npt.NDArray[np.int32], sides: npt.NDArray[np.float64], caps: npt.NDArray[np.int64]
) -> Faces:
    """Give the long side of caps to the faces across, as many as do not touch each other."""
    longest = sides[caps].argmax(axis=1)
    across = _across(labels[faces], caps, longest)
    alone = across < 0
    order = np.lexsort((caps, sides[caps, longest]))
    rank = np.empty(len(caps), dtype=np.int64)
    rank[order] = np.arange(len(caps))
    best = np.full(len(faces), -1, dtype=np.int64)
    np.maximum.at(best, caps[~alone], rank[~alone])
    np.maximum.at(best, across[~alone], rank[~alone])
    chosen = np.flatnonzero(~alone & (best[caps] == rank) & (best[across] == rank))
    drop = np.zeros(len(faces), dtype=np.bool_)
    drop[caps[alone]] = True
    result = faces.copy()
    for k in chosen.tolist():
        face, other, corner = caps[k], across[k], longest[k]
        tip, ends = faces[face, corner], labels[faces[face, [corner - 2, corner - 1]]]
        own = labels[faces[other]]
        if labels[tip] in own:
            # The two faces have the same points: opposite ones cancel, of equal ones the second is left.
            drop[face] = True
            first = int(np.flatnonzero(own == ends[0])[0])
            drop[other] = own[(first + 1) % 3] != ends[1]
            continue
        result[face, :] = np.where(own == ends[0], tip, faces[other])
        result[other, :] = np.where(own == ends[1], tip, faces[other])
    return result[~drop]


def _across(faces: Faces, chosen: npt.NDArray[np.int64], corner: npt.NDArray[np.intp]) -> npt.NDArray[np.int64]:
    """Return one other face (-1 if none) at the side opposite ``corner`` of each chosen face."""
    pairs = topology.side_pairs(faces)
    other = np.full(3 * len(faces), -1, dtype=np.int64)
    other[pairs[:, 0]] = pairs[:, 1] // 3
    unset = pairs[other[pairs[:, 1]] < 0]
    other[unset[:, 1]] = unset[:, 0] // 3
    found: npt.NDArray[np.int64] = other[3 * chosen + corner]
    return found
