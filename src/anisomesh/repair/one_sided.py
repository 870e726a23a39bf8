"""Short cuts of surfaces that have one side only, as a Moebius strip."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse import csgraph

from anisomesh._arrays import Faces, FaceScalars, Points
from anisomesh.mesh import topology
from anisomesh.repair.orientation import Orientation, Pairs, find_orientation

_LEAST_GAIN = 1e-9  # share by which a cut has to be shorter, so that a surface that was cut keeps its cut

PairMask = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]


def with_short_cuts(points: Points, faces: Faces, pairs: Pairs, areas: FaceScalars, found: Orientation) -> Orientation:
    """Return an orientation whose cuts across components that are not orientable are shortest paths of edges.

    Parameters
    ----------
    points
        Coordinates (V, 3).
    faces
        Point indices (F, 3).
    pairs
        Pairs (n, 2) of glued sides.
    areas
        Face areas (F,).
    found
        The orientation that was found for them.

    Notes
    -----
    A cut from boundary to boundary makes a Moebius strip orientable if it crosses a loop of faces that reverses the
    orientation an odd number of times. The shortest such path is found in the double cover, whose points are the ones
    of the surface with the parity of these crossings. Components that one path does not make orientable, such as
    closed ones, keep their cuts.
    """
    n_fans, fans = topology.corner_fans(faces, pairs)
    cut = found.conflict
    component = topology.graph_components(pairs // 3, len(faces))[1][pairs[:, 0] // 3]
    ends = np.stack([fans[corners[:, 0]] for corners in topology.side_ends(pairs)], axis=1).astype(np.int64)
    place = np.empty((n_fans, 3))
    place[fans] = points[faces.ravel()]
    lengths = np.linalg.norm(place[ends[:, 1]] - place[ends[:, 0]], axis=1)
    open_sides = np.setdiff1d(np.arange(3 * len(faces)), pairs)
    at_boundary = np.unique(fans[np.concatenate(topology.side_ends(open_sides))]).astype(np.int64)
    for number in np.unique(component[cut]).tolist():
        own = component == number
        crossed = _reversing_loop(pairs, own, cut, len(faces))
        path = _path_across(ends, lengths, own, crossed, at_boundary, n_fans)
        if len(path) and lengths[path].sum() < (1.0 - _LEAST_GAIN) * lengths[own & cut].sum():
            shorter = cut & ~own
            shorter[path] = True
            if not find_orientation(faces, pairs[own & ~shorter], areas).conflict.any():
                cut = shorter
    if cut is found.conflict:
        return found
    return Orientation(flip=find_orientation(faces, pairs[~cut], areas).flip, conflict=cut)


def _reversing_loop(pairs: Pairs, own: PairMask, cut: PairMask, n_faces: int) -> Ints:
    """Return the pairs (m,) that a loop of faces crosses, of which one is cut, in the component of ``own`` pairs."""
    closing, inside = np.flatnonzero(own & cut)[0], np.flatnonzero(own & ~cut)
    inside = inside[np.unique(topology.edge_keys(pairs[inside] // 3), return_index=True)[1]]
    links = pairs[inside] // 3
    number = sparse.coo_matrix((inside + 1, links.T), shape=(n_faces, n_faces)).tocsr()
    start, end = (pairs[closing] // 3).tolist()
    before = csgraph.breadth_first_order(number, start, directed=False)[1]
    crossed = [int(closing)]
    while end != start:
        ahead = int(before[end])
        crossed.append(int(max(number[end, ahead], number[ahead, end])) - 1)
        end = ahead
    return np.array(crossed, dtype=np.int64)


def _path_across(
    ends: Ints, lengths: npt.NDArray[np.float64], own: PairMask, crossed: Ints, at_boundary: Ints, n_fans: int
) -> Ints:
    """Return the pairs (m,) on the shortest path of ``own`` edges between boundary points that is odd; empty for none.

    Parameters
    ----------
    ends
        Points (n, 2) at the ends of the edge of each pair.
    lengths
        Lengths of the edges (n,).
    own
        The edges (n,) to go along.
    crossed
        Edges (m,) that change the parity of a path.
    at_boundary
        Points (k,) that paths start and end at.
    n_fans
        Number of points.
    """
    inside, odd = np.flatnonzero(own), np.zeros(len(ends), dtype=bool)
    starts = np.intersect1d(at_boundary, ends[inside])
    if len(starts) == 0:
        return starts.astype(np.int64)
    odd[crossed] = True
    first, pair = np.concatenate([ends[inside, 0], ends[inside, 0] + n_fans]), np.tile(inside, 2)
    last = ends[pair, 1] + np.where((first >= n_fans) != odd[pair], n_fans, 0)
    keys = topology.edge_keys(np.stack([first, last], axis=1))
    order = np.lexsort((lengths[pair], keys))
    order = order[np.diff(keys[order], prepend=-1) != 0]  # the shortest of several edges between two points
    shape = (2 * n_fans, 2 * n_fans)
    graph = sparse.coo_matrix((lengths[pair[order]], (first[order], last[order])), shape=shape).tocsr()
    search = csgraph.dijkstra(graph, directed=False, indices=starts, return_predecessors=True, min_only=True)
    distance, before = search[:2]
    pair_at = dict(zip(keys[order].tolist(), pair[order].tolist(), strict=True))
    point, path = int(starts[np.argmin(distance[starts + n_fans])]) + n_fans, []
    while before[point] >= 0:
        ahead = int(before[point])
        path.append(pair_at[int(topology.edge_keys(np.array([[point, ahead]]))[0])])
        point = ahead
    return np.array(path, dtype=np.int64)
