"""Orientation of triangle soups, and the sides to glue so that every point has one fan."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse import csgraph

from anisomesh._arrays import FaceMask, Faces, FaceScalars, Points
from anisomesh.mesh import geometry, topology

Pairs = npt.NDArray[np.int64]
Sides = npt.NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class Orientation:
    """Which faces to turn over, and which glued pairs of sides to cut open since nothing can orient them."""

    flip: FaceMask
    conflict: npt.NDArray[np.bool_]
    n_nonorientable: int


def glue(faces: Faces, welded: Faces) -> tuple[Pairs, Sides]:
    """Pair the sides of faces that belong together beyond doubt.

    Parameters
    ----------
    faces
        Point indices (F, 3), before coincident points were merged.
    welded
        The same faces with coincident points merged.

    Returns
    -------
    tuple
        Pairs (n, 2) of sides, and the sides that are left on edges with more than two of them.

    Notes
    -----
    Two faces that share an edge of the input stay neighbours, whatever else touches that edge: a surface
    that is manifold already is not spoiled by points that happen to coincide. Only sides without a partner
    are matched by coincident points.
    """
    every = np.arange(3 * len(faces))
    pairs, _ = _twos(topology.edges_of(faces)[1].ravel(), every)
    more, crowded = _twos(topology.edges_of(welded)[1].ravel(), np.setdiff1d(every, pairs))
    return np.concatenate([pairs, more]), crowded


def turn(sides: Sides, flip: FaceMask) -> Sides:
    """Return the numbers that sides have after the last two corners of the faces in ``flip`` are swapped."""
    face, corner = np.divmod(sides, 3)
    turned: Sides = 3 * face + np.where(flip[face], (3 - corner) % 3, corner)
    return turned


def orient(faces: Faces, pairs: Pairs, areas: FaceScalars) -> Orientation:
    """Find a consistent orientation across pairs of sides.

    Parameters
    ----------
    faces
        Point indices (F, 3).
    pairs
        Pairs (n, 2) of sides across which to be consistent.
    areas
        Face areas (F,): in each component the faces with less than half the area are turned.

    Notes
    -----
    Faces that agree already are one patch; a breadth-first tree over the patches decides which patches turn.
    So a surface that is consistent but for a cut keeps that very cut, and the second run changes nothing.
    Linear in the number of faces.
    """
    sides = topology.half_edges(faces)
    disagree = sides[pairs[:, 0], 0] == sides[pairs[:, 1], 0]
    ends = pairs // 3
    n_patches, patch = _components(ends[~disagree], len(faces))
    links = patch[ends[disagree]]
    turned = _tree_parity(links, n_patches)[patch]
    conflict = np.zeros(len(pairs), dtype=np.bool_)
    conflict[disagree] = turned[ends[disagree, 0]] == turned[ends[disagree, 1]]
    n_components, component = _components(ends, len(faces))
    turned_area = np.bincount(component, areas * turned, minlength=n_components)
    flip = turned ^ (2 * turned_area > np.bincount(component, areas, minlength=n_components))[component]
    n_nonorientable = len(np.unique(component[ends[conflict, 0]]))
    return Orientation(flip=flip, conflict=conflict, n_nonorientable=n_nonorientable)


def wedge_pairs(points: Points, faces: Faces, crowded: Sides) -> Pairs:
    """Pair sides on edges with more than two of them, as neighbours around the edge.

    Parameters
    ----------
    points
        Coordinates (V, 3).
    faces
        Oriented faces (F, 3).
    crowded
        The sides to pair.

    Returns
    -------
    ndarray
        Pairs (n, 2) of sides of opposite direction. With outside as the faces' orientation says, the two faces
        of a pair bound the same wedge of material; sides that find no partner are not listed.

    Notes
    -----
    Around the edge, in the direction of increasing angle, material begins behind a face that runs against the
    edge and ends at one that runs along it: so the faces pair like brackets. The angle is counted from the
    first face along its own direction, which makes the result independent of the numbering of the points.
    """
    edges_at = topology.edges_of(faces)[1].ravel()
    crowded = np.sort(crowded)
    crowded = crowded[np.argsort(edges_at[crowded], kind="stable")]
    if len(crowded) == 0:
        return np.zeros((0, 2), dtype=np.int64)
    new_group = np.diff(edges_at[crowded], prepend=-1) != 0
    group = np.cumsum(new_group) - 1
    reference = crowded[new_group][group]
    corners = faces.ravel()
    start, end = (corners[ends] for ends in topology.side_ends(reference))
    axis = geometry.unit(points[end] - points[start])
    outward = points[corners[crowded]] - points[start]
    outward -= (outward * axis).sum(axis=1, keepdims=True) * axis
    across = geometry.unit(outward)[new_group][group]
    upward = np.cross(axis, across)
    angle = np.arctan2((outward * upward).sum(axis=1), (outward * across).sum(axis=1)) % (2 * np.pi)
    angle[new_group] = 0.0
    closes = corners[topology.side_ends(crowded)[0]] == start
    order = np.lexsort((crowded, angle, group))
    bounds = np.append(np.flatnonzero(new_group), len(crowded)).tolist()
    sides, closing = crowded[order].tolist(), closes[order].tolist()
    pairs: list[tuple[int, int]] = []
    for first, last in pairwise(bounds):
        pairs += _brackets(sides[first:last], closing[first:last])
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def settle(faces: Faces, pairs: Pairs) -> tuple[int, npt.NDArray[np.int32]]:
    """Return the number of points and the point of every corner (3F,) once only ``pairs`` are glued.

    Notes
    -----
    Two sheets can still share both ends of an edge, where a surface passes twice through the same edge and
    the same fans. Such edges are cut open. That is enough: a side that is not glued is an end of its fans, and
    a fan has two ends, so that at most two such sides are left on an edge, and those run in opposite directions.
    Cutting may split fans but never joins any, and each round removes pairs, so this ends.
    """
    while True:
        count, corner_point = topology.corner_fans(faces, pairs)
        face_edges = topology.edges_of(corner_point.reshape(-1, 3))[1].ravel()
        crowded = (np.bincount(face_edges) > 2)[face_edges]
        if not crowded.any():
            return count, corner_point
        pairs = pairs[~crowded[pairs].any(axis=1)]


def _twos(edges_at: npt.NDArray[np.int32], sides: Sides) -> tuple[Pairs, Sides]:
    """Pair those of the sides that are two on their edge; return also those that are more."""
    order = sides[np.argsort(edges_at[sides], kind="stable")]
    count = np.bincount(edges_at[sides], minlength=1)[edges_at[order]]
    return order[count == 2].reshape(-1, 2), order[count > 2]


def _brackets(sides: list[int], closing: list[bool]) -> list[tuple[int, int]]:
    """Match opening with closing sides around a circle."""
    pairs: list[tuple[int, int]] = []
    stack: list[int] = []
    used: set[int] = set()
    for side, closes in [*zip(sides, closing, strict=True)] * 2:
        if side in used:
            continue
        if not closes:
            if side not in stack:
                stack.append(side)
        elif stack:
            pairs.append((stack.pop(), side))
            used.update(pairs[-1])
    return pairs


def _tree_parity(links: npt.NDArray[np.int32], size: int) -> npt.NDArray[np.bool_]:
    """Return for each node whether its depth in a breadth-first forest over the links (n, 2) is odd."""
    n_trees, tree = _components(links, size)
    roots = np.full(n_trees, size, dtype=np.int64)
    np.minimum.at(roots, tree, np.arange(size))
    rows = np.concatenate([links[:, 0], roots])
    columns = np.concatenate([links[:, 1], np.full(n_trees, size)])
    graph = sparse.coo_matrix((np.ones(len(rows), dtype=np.bool_), (rows, columns)), shape=(size + 1, size + 1))
    parent = csgraph.breadth_first_order(graph.tocsr(), size, directed=False)[1].astype(np.int64)
    odd = np.ones(size + 1, dtype=np.bool_)
    parent[size], odd[size] = size, False
    parent[roots], odd[roots] = size, False
    while (parent != size).any():
        odd = odd ^ odd[parent]
        parent = parent[parent]
    return odd[:size]


def _components(links: npt.NDArray[np.integer], size: int) -> tuple[int, npt.NDArray[np.int32]]:
    weights = np.ones(len(links), dtype=np.bool_)
    graph = sparse.coo_matrix((weights, (links[:, 0], links[:, 1])), shape=(size, size))
    count, labels = csgraph.connected_components(graph, directed=False)
    return int(count), labels.astype(np.int32)
