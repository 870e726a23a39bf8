"""T-junctions: points of one face in the middle of a side of another, as tools for constructive geometry leave them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from anisomesh._arrays import Faces, PointLabels, Points
from anisomesh.mesh import topology

ON_SIDE = 1e-6
"""Distance of a point from a side that it is on, over the bounding-box diagonal: coordinates rounded to float32."""

_SHORTEST_PART = 10.0  # of a split side, in such distances: nearer points are ends that are nearly equal; heuristic
_CHUNK = 1_000  # sides looked at together

Integers = npt.NDArray[np.int64]


class _Junctions(NamedTuple):
    """Points in the middle of sides, in order along each side: number of the side (n,) and point (n,)."""

    side: Integers
    point: Integers


class SplitFaces(NamedTuple):
    """Faces with split sides (F', 3), the face that each is a part of (F',), and the number of split sides."""

    faces: Faces
    source: Integers
    n_split: int


def split_at_t_junctions(points: Points, faces: Faces, labels: PointLabels, tolerance: float) -> SplitFaces:
    """Return faces (F, 3) whose open sides are split where points of other open sides lie on them.

    Parameters
    ----------
    points
        Coordinates (V, 3).
    faces
        Faces (F, 3).
    labels
        For each point (V,) the point that it is welded to.
    tolerance
        Distance up to which a point is on a side, if it is larger than 1e-6 of the bounding-box diagonal.

    Returns
    -------
    SplitFaces
        At most one side of each face was split, so another call may find more.

    Notes
    -----
    A side is split if one of its parts is then a part of another open side, so that the two can be glued. A point that
    only touches a side changes nothing.
    """
    welded = labels[faces].astype(np.int64)
    _, face_edges = topology.edges_of(labels[faces])
    open_sides = np.flatnonzero(np.bincount(face_edges.ravel())[face_edges.ravel()] == 1)
    face, corner = np.divmod(open_sides, 3)
    apex, first, last = (welded[face, (corner + turn) % 3] for turn in range(3))
    limit = max(tolerance, ON_SIDE * float(np.linalg.norm(np.ptp(points, axis=0))))
    found = _points_on_sides(points, first, last, limit)
    chosen = _glued(first, last, found)
    _, one_of_face = np.unique(face[chosen], return_index=True)
    chosen = chosen[one_of_face]
    if len(chosen) == 0:
        return SplitFaces(faces, np.arange(len(faces)), 0)
    counts = np.ones(len(faces), dtype=np.int64)
    counts[face[chosen]] += np.bincount(found.side, minlength=len(face))[chosen]
    source = np.repeat(np.arange(len(faces)), counts)
    split = faces[source]
    place = np.cumsum(counts) - counts
    for side in chosen.tolist():
        chain = np.concatenate([[first[side]], found.point[found.side == side], [last[side]]])
        rows = place[face[side]] + np.arange(len(chain) - 1)
        split[rows] = np.stack([np.full(len(rows), apex[side]), chain[:-1], chain[1:]], axis=1)
    return SplitFaces(split, source, len(chosen))


def _points_on_sides(points: Points, first: Integers, last: Integers, limit: float) -> _Junctions:
    """Return the ends of sides from ``first`` to ``last`` (n,) that lie within a distance of the inside of others."""
    ends = np.unique(np.concatenate([first, last]))
    if len(ends) == 0:
        return _Junctions(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
    tree, sides, inner, along = cKDTree(points[ends]), [], [], []
    for start in range(0, len(first), _CHUNK):
        a, b = points[first[start : start + _CHUNK]], points[last[start : start + _CHUNK]]
        length = np.linalg.norm(b - a, axis=1)
        near = tree.query_ball_point(0.5 * (a + b), 0.5 * length + limit)
        side = np.repeat(np.arange(len(a)), [len(each) for each in near])
        point = ends[np.concatenate([np.asarray(each, dtype=np.int64) for each in near])]
        unit = (b - a)[side] / length[side, None]
        offset = points[point] - a[side]
        t = np.einsum("nx,nx->n", offset, unit)
        on_side = np.linalg.norm(offset - t[:, None] * unit, axis=1) <= limit
        on_side &= np.minimum(t, length[side] - t) > _SHORTEST_PART * limit
        sides.append(start + side[on_side])
        inner.append(point[on_side])
        along.append(t[on_side])
    side, point = np.concatenate(sides), np.concatenate(inner)
    order = np.lexsort((np.concatenate(along), side))
    return _Junctions(side[order], point[order])


def _glued(first: Integers, last: Integers, found: _Junctions) -> Integers:
    """Return the sides with points on them that have a part in common with another side, split or whole."""
    number = np.concatenate([np.arange(len(first)), found.side])
    begin = np.concatenate([first, found.point])
    order = np.argsort(number, kind="stable")  # the points of a side come behind its first end, in their order
    number, begin = number[order], begin[order]
    is_last = np.append(number[1:] != number[:-1], True)
    end = np.where(is_last, last[number], np.roll(begin, -1))
    keys = topology.edge_keys(np.stack([begin, end], axis=1))
    _, inverse, count = np.unique(keys, return_inverse=True, return_counts=True)
    return np.intersect1d(number[count[inverse] > 1], found.side)
