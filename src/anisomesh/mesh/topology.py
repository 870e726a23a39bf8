"""Connectivity of triangle lists (F, 3): edges, adjacency, fans, components and boundary loops.

Side ``3 f + c`` of a mesh is the directed edge opposite corner ``c`` of face ``f``, from corner ``c + 1`` to ``c + 2``.
Kernels are imported where they are used, so that files are read without Numba.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse import csgraph

from anisomesh._arrays import EdgeIndices, Edges, FaceIndices, FaceLabels, Faces, Indices, PointMask


def half_edges(faces: Faces) -> npt.NDArray[np.int32]:
    """Return the start and end point of every side, (3F, 2)."""
    return faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)


def edge_keys(ends: npt.NDArray[np.integer]) -> npt.NDArray[np.int64]:
    """Return a key (n,) of each edge (n, 2), independent of the order of its end points."""
    low, high = np.sort(ends, axis=1).astype(np.int64).T
    return np.asarray(low << 32 | high)


def edges_of(faces: Faces) -> tuple[Edges, FaceIndices]:
    """Return the unique edges (E, 2), lower index first, in order, and the edge opposite each corner (F, 3)."""
    from anisomesh._kernels import connectivity

    faces = np.array(faces, dtype=np.int32)  # of one type and layout, for which the kernels are compiled
    n_points = int(faces.max()) + 1 if len(faces) else 0
    first = np.zeros(n_points + 1, dtype=np.int64)
    position = np.empty(n_points, dtype=np.int64)
    sides, ends, edge_of_side = (np.empty(faces.size, dtype=np.int32) for _ in range(3))
    connectivity.count_sides(faces, first)
    connectivity.sort_sides(faces, first, position, sides, ends)
    edges = np.empty((faces.size, 2), dtype=np.int32)
    count = connectivity.number_edges(first, sides, ends, edges, edge_of_side)
    return edges[:count].copy(), edge_of_side.reshape(-1, 3)


def edge_faces(face_edges: FaceIndices, n_edges: int) -> EdgeIndices:
    """Return the faces at each edge (E, 2): the second is -1 at a boundary edge, both are -1 at a non-manifold edge."""
    from anisomesh._kernels import connectivity

    pairs = np.full((n_edges, 2), -1, dtype=np.int32)
    connectivity.edge_faces(face_edges, np.zeros(n_edges, dtype=np.int32), pairs)
    return pairs


def face_neighbours(face_edges: FaceIndices, edge_faces: EdgeIndices) -> FaceIndices:
    """Return the face across each side (F, 3); -1 at boundary and non-manifold edges."""
    from anisomesh._kernels import connectivity

    across = np.empty_like(face_edges)
    connectivity.face_neighbours(face_edges, edge_faces, across)
    return across


def side_pairs(faces: Faces) -> npt.NDArray[np.int64]:
    """Return pairs (n, 2) of sides on the same edge; an edge with ``k`` faces gives ``k - 1`` pairs."""
    face_edges = edges_of(faces)[1].ravel()
    order = np.argsort(face_edges, kind="stable")
    same = face_edges[order[1:]] == face_edges[order[:-1]]
    return np.stack([order[:-1][same], order[1:][same]], axis=1)


def side_ends(sides: npt.NDArray[np.integer]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return the corners, numbered ``3 f + c``, at which sides of any shape start and end."""
    sides = np.asarray(sides, dtype=np.int64)
    face, corner = np.divmod(sides, 3)
    return 3 * face + (corner + 1) % 3, 3 * face + (corner + 2) % 3


def corner_fans(faces: Faces, pairs: npt.NDArray[np.int64]) -> tuple[int, npt.NDArray[np.int32]]:
    """Group the corners of the faces into fans.

    Two corners at the same point are in one fan if a path around the point connects their faces across glued sides.

    Parameters
    ----------
    faces
        Point indices (F, 3).
    pairs
        Pairs (n, 2) of glued sides, as from :func:`side_pairs`: on the same edge, in either direction.

    Returns
    -------
    tuple
        The number of fans and the fan of every corner (3F,).
    """
    corners = faces.ravel()
    start, end = side_ends(pairs)
    same_direction = corners[start[:, 0]] == corners[start[:, 1]]
    at_start = np.stack([start[:, 0], np.where(same_direction, start[:, 1], end[:, 1])], axis=1)
    at_end = np.stack([end[:, 0], np.where(same_direction, end[:, 1], start[:, 1])], axis=1)
    return graph_components(np.concatenate([at_start, at_end]), len(corners))


def connected_components(faces: Faces, n_points: int) -> tuple[int, FaceLabels]:
    """Return the number of components and the component of every face (F,); faces with a common point connect."""
    _, labels = graph_components(faces[:, [0, 1, 0, 2]].reshape(-1, 2), n_points)
    used, face_labels = np.unique(labels[faces[:, 0]], return_inverse=True)
    return len(used), face_labels.astype(np.int32)


def euler_characteristic(faces: Faces) -> int:
    """Return V - E + F, where V counts only points that are used by a face."""
    n_points = np.count_nonzero(used_points(faces, int(faces.max()) + 1))
    return int(n_points) - len(edges_of(faces)[0]) + len(faces)


def count_nonmanifold_edges(faces: Faces) -> int:
    """Return the number of edges with more than two faces."""
    return int((np.bincount(edges_of(faces)[1].ravel()) > 2).sum())


def count_nonmanifold_points(faces: Faces) -> int:
    """Return the number of points that are ends of edges with more than two faces, or whose faces form several fans."""
    edges, face_edges = edges_of(faces)
    n_fans, fans = corner_fans(faces, side_pairs(faces))
    point_of_fan = np.empty(n_fans, dtype=np.int64)
    point_of_fan[fans] = faces.ravel()
    nonmanifold = np.bincount(point_of_fan) > 1
    nonmanifold[edges[np.bincount(face_edges.ravel()) > 2]] = True
    return int(np.count_nonzero(nonmanifold))


def is_oriented(faces: Faces) -> bool:
    """Return whether the faces are consistently oriented: each edge with two faces has one side in each direction."""
    from anisomesh._kernels import connectivity

    edges, face_edges = edges_of(faces)
    counts = np.bincount(face_edges.ravel(), minlength=len(edges)).astype(np.int32)
    return bool(connectivity.is_oriented(faces, face_edges, counts, np.zeros(len(edges), dtype=np.int32)))


def has_single_fans(faces: Faces, neighbours: FaceIndices) -> bool:
    """Return whether the faces at each point form one fan, if edges have at most two faces, which are oriented.

    ``neighbours`` are the faces across the sides (F, 3), as :func:`face_neighbours` returns them.
    """
    from anisomesh._kernels import connectivity

    n_faces = np.zeros(int(faces.max()) + 1, dtype=np.int32)
    return bool(connectivity.has_single_fans(faces, neighbours, n_faces))


def used_points(faces: Faces, n_points: int) -> PointMask:
    """Return which points (n_points,) faces use."""
    used = np.zeros(n_points, dtype=bool)
    used[faces] = True
    return used


def boundary_loops(faces: Faces) -> list[Indices]:
    """Return the boundary loops, each as a list of points in order, with the surface on the left.

    Notes
    -----
    Boundary edges have one face. Where several fans meet at a point, a loop stays within its fan, so that a point can
    occur in several loops or twice in one. On a non-manifold surface a loop can be an open polyline, listed without its
    last point; on an inconsistently oriented surface its first face determines the direction.
    """
    edges_at = edges_of(faces)[1].ravel()
    sides = np.flatnonzero(np.bincount(edges_at)[edges_at] == 1)
    if len(sides) == 0:
        return []
    _, fans = corner_fans(faces, side_pairs(faces))
    start, end = side_ends(sides)
    ends = np.stack([faces.ravel()[start], faces.ravel()[end]], axis=1)
    trails = _edge_trails(fans[start], fans[end])
    return [np.array([ends[side, direction] for side, direction in trail], dtype=np.int32) for trail in trails]


def _edge_trails(tails: npt.NDArray[np.int32], heads: npt.NDArray[np.int32]) -> list[list[tuple[int, int]]]:
    """Split a graph into trails of (edge, 0 along or 1 against it), closed in components without odd degrees."""
    incident: dict[int, list[tuple[int, int]]] = {}
    nodes = np.stack([tails, heads], axis=1).tolist()
    for edge, (tail, head) in enumerate(nodes):
        incident.setdefault(head, []).insert(0, (edge, 1))
        incident.setdefault(tail, []).append((edge, 0))
    odd = [node for node, edges in incident.items() if len(edges) % 2]
    used = [False] * len(nodes)
    trails = []
    for node in odd + tails.tolist():
        trail: list[tuple[int, int]] = []
        while True:
            edges = incident[node]
            while edges and used[edges[-1][0]]:
                edges.pop()
            if not edges:
                break
            edge, direction = edges.pop()
            used[edge] = True
            trail.append((edge, direction))
            node = nodes[edge][1 - direction]
        if trail:
            trails.append(trail)
    return trails


def graph_components(links: npt.NDArray[np.integer], size: int) -> tuple[int, npt.NDArray[np.int32]]:
    """Return the number of connected components of a graph of links (n, 2), and the component (size,) of each node."""
    weights = np.ones(len(links), dtype=np.bool_)
    graph = sparse.coo_matrix((weights, (links[:, 0], links[:, 1])), shape=(size, size))
    count, labels = csgraph.connected_components(graph, directed=False)
    return int(count), labels.astype(np.int32)


def with_neighbours(faces: Faces, chosen: PointMask) -> PointMask:
    """Return the chosen points (V,) and all points of the faces (F, 3) at them."""
    grown = np.array(chosen)
    grown[faces[chosen[faces].any(axis=1)]] = True
    return grown
