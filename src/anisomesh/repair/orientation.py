"""Oriented manifolds from triangle soups: which sides to glue, which faces to reverse, which points to split.

Sides are numbered as in :mod:`anisomesh.mesh.topology`. The approach is cutting and stitching (Gueziec, Taubin,
Lazarus, Horn, "Cutting and stitching: converting sets of polygons to manifold surfaces", IEEE TVCG 7, 2001).
"""

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
    """The reversals that orient a surface consistently across its pairs of glued sides.

    Attributes
    ----------
    flip
        Which faces (F,) to reverse.
    conflict
        Which pairs (n,) to cut open, since a component is not orientable.
    """

    flip: FaceMask
    conflict: npt.NDArray[np.bool_]


def pair_sides(faces: Faces, welded: Faces) -> tuple[Pairs, Sides]:
    """Pair the sides of faces that share an edge with no other face.

    Parameters
    ----------
    faces
        Point indices (F, 3), before coincident points were merged.
    welded
        The faces (F, 3) with coincident points merged.

    Returns
    -------
    tuple
        Pairs (n, 2) of sides, and the remaining sides on edges with more than two sides.

    Notes
    -----
    Two faces that share an edge of ``faces`` stay neighbours whatever else coincides with the edge, so that coincident
    parts of a manifold surface stay separate. Only unpaired sides are matched by coincident points.
    """
    all_sides = np.arange(3 * len(faces))
    pairs, _ = _pair_twos(topology.edges_of(faces)[1].ravel(), all_sides)
    welded_pairs, nonmanifold = _pair_twos(topology.edges_of(welded)[1].ravel(), np.setdiff1d(all_sides, pairs))
    return np.concatenate([pairs, welded_pairs]), nonmanifold


def renumber_sides(sides: Sides, flip: FaceMask) -> Sides:
    """Return the numbers of sides after faces are reversed by swapping their last two corners."""
    face, corner = np.divmod(sides, 3)
    renumbered: Sides = 3 * face + np.where(flip[face], (3 - corner) % 3, corner)
    return renumbered


def find_orientation(faces: Faces, pairs: Pairs, areas: FaceScalars) -> Orientation:
    """Find a consistent orientation across pairs of sides.

    Parameters
    ----------
    faces
        Point indices (F, 3).
    pairs
        Pairs (n, 2) of glued sides.
    areas
        Face areas (F,): each component is oriented as the larger part of its area is.

    Notes
    -----
    Faces that are consistent with their neighbours form patches; a breadth-first tree over the patches decides which
    to reverse. A surface that is consistent except across cuts therefore keeps these cuts, and a second pass changes
    nothing. Linear in the number of faces.
    """
    sides = topology.half_edges(faces)
    disagree = sides[pairs[:, 0], 0] == sides[pairs[:, 1], 0]
    pair_faces = pairs // 3
    n_patches, patch = topology.graph_components(pair_faces[~disagree], len(faces))
    links = patch[pair_faces[disagree]]
    odd = _tree_parity(links, n_patches)[patch]
    conflict = np.zeros(len(pairs), dtype=np.bool_)
    conflict[disagree] = odd[pair_faces[disagree, 0]] == odd[pair_faces[disagree, 1]]
    n_components, component = topology.graph_components(pair_faces, len(faces))
    odd_area = np.bincount(component, areas * odd, minlength=n_components)
    flip = odd ^ (2 * odd_area > np.bincount(component, areas, minlength=n_components))[component]
    return Orientation(flip=flip, conflict=conflict)


def pair_nonmanifold_sides(points: Points, faces: Faces, sides: Sides) -> Pairs:
    """Pair the sides of oriented faces on non-manifold edges by their angle around the edge.

    Parameters
    ----------
    points
        Coordinates (V, 3).
    faces
        Oriented faces (F, 3).
    sides
        The sides (n,) to pair.

    Returns
    -------
    ndarray
        Pairs (m, 2) of sides in opposite directions, whose faces bound the same wedge of the solid. Sides without a
        partner are not listed.

    Notes
    -----
    By increasing angle around the edge, the solid begins behind a face whose side is against the edge and ends at one
    whose side is along it, so that the faces pair like brackets. Angles are measured from the first face in the
    direction of its side, which makes the result independent of the numbering of the points.
    """
    side_edges = topology.edges_of(faces)[1].ravel()
    sides = np.sort(sides)
    sides = sides[np.argsort(side_edges[sides], kind="stable")]
    if len(sides) == 0:
        return np.zeros((0, 2), dtype=np.int64)
    first_of_edge = np.diff(side_edges[sides], prepend=-1) != 0
    group = np.cumsum(first_of_edge) - 1
    corners = faces.ravel()
    start, end = (corners[ends] for ends in topology.side_ends(sides[first_of_edge][group]))
    axis = geometry.unit(points[end] - points[start])
    outward = points[corners[sides]] - points[start]
    outward -= (outward * axis).sum(axis=1, keepdims=True) * axis
    x_axis = geometry.unit(outward)[first_of_edge][group]
    y_axis = np.cross(axis, x_axis)
    angle = np.arctan2((outward * y_axis).sum(axis=1), (outward * x_axis).sum(axis=1)) % (2 * np.pi)
    angle[first_of_edge] = 0.0
    closes = corners[topology.side_ends(sides)[0]] == start
    order = np.lexsort((sides, angle, group))
    bounds = np.append(np.flatnonzero(first_of_edge), len(sides)).tolist()
    side_list, closing = sides[order].tolist(), closes[order].tolist()
    pairs: list[tuple[int, int]] = []
    for first, last in pairwise(bounds):
        pairs += _match_brackets(side_list[first:last], closing[first:last])
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def split_points(faces: Faces, pairs: Pairs) -> tuple[int, npt.NDArray[np.int32]]:
    """Give every fan of faces its own point; return the number of points and the point of every corner (3F,).

    Notes
    -----
    Where a surface passes twice through an edge and through the same fans at both of its ends, the edge keeps more than
    two faces; the pairs there are removed. An unglued side ends its fans and a fan has two ends, so that at most two
    such sides, of opposite direction, remain on an edge. Every round removes pairs, so that the loop terminates.
    """
    while True:
        n_points, corner_point = topology.corner_fans(faces, pairs)
        side_edges = topology.edges_of(corner_point.reshape(-1, 3))[1].ravel()
        nonmanifold = (np.bincount(side_edges) > 2)[side_edges]
        if not nonmanifold.any():
            return n_points, corner_point
        pairs = pairs[~nonmanifold[pairs].any(axis=1)]


def _pair_twos(side_edges: npt.NDArray[np.int32], sides: Sides) -> tuple[Pairs, Sides]:
    """Pair sides on edges with exactly two of the sides; return also the sides on edges with more."""
    order = sides[np.argsort(side_edges[sides], kind="stable")]
    count = np.bincount(side_edges[sides], minlength=1)[side_edges[order]]
    return order[count == 2].reshape(-1, 2), order[count > 2]


def _match_brackets(sides: list[int], closing: list[bool]) -> list[tuple[int, int]]:
    """Pair opening with closing sides, in cyclic order."""
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
    """Return for each node (size,) whether its depth in a breadth-first forest over the links (n, 2) is odd."""
    n_trees, tree = topology.graph_components(links, size)
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
