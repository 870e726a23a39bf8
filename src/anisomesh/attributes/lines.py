"""Edges of a mesh along given lines, and points of it at given places."""

from __future__ import annotations

import igl
import numpy as np
from scipy.spatial import cKDTree

from anisomesh._arrays import EdgeEnds, Points
from anisomesh.attributes.model import Ints
from anisomesh.attributes.places import Floats
from anisomesh.mesh.geometry import unit
from anisomesh.mesh.surface import Surface

_MAX_END_DISTANCE = 0.01  # edge lengths of an end of an edge from the lines that it follows; heuristic
_MAX_MIDDLE_DISTANCE = 0.1  # the same of its middle: chords of curved lines; heuristic
_MIN_LINE_COSINE = 0.7  # between an edge and the line at its middle; heuristic


def transfer_lines(lines: Floats, target: Surface) -> EdgeEnds:
    """Return the edges (m, 2) of a surface that follow line segments (n, 2, 3)."""
    lines = lines[(lines[:, 0] != lines[:, 1]).any(axis=1)]
    if len(lines) == 0:
        return np.zeros((0, 2), dtype=np.int64)
    ends = target.points[target.edges]
    limit = target.edge_lengths
    near = np.flatnonzero(
        (_distances(ends[:, 0], lines)[0] <= _MAX_END_DISTANCE * limit)
        & (_distances(ends[:, 1], lines)[0] <= _MAX_END_DISTANCE * limit)
    )
    distance, line = _distances(ends[near].mean(axis=1), lines)
    along = unit(ends[near, 1] - ends[near, 0]), unit(lines[line, 1] - lines[line, 0])
    follows = np.abs(np.einsum("nx,nx->n", *along)) >= _MIN_LINE_COSINE
    chosen = near[follows & (distance <= _MAX_MIDDLE_DISTANCE * limit[near])]
    return np.asarray(target.edges[chosen], dtype=np.int64)


def transfer_fixed_points(places: Points, target: Surface) -> Ints:
    """Return the points (m,) of a surface that are at places (n, 3), to a hundredth of the shortest edge there."""
    if len(places) == 0:
        return np.zeros(0, dtype=np.int64)
    shortest = np.full(target.n_points, np.inf)
    for end in target.edges.T:
        np.minimum.at(shortest, end, target.edge_lengths)
    used = np.unique(target.faces)
    distance, nearest = cKDTree(target.points[used]).query(places)
    point = used[nearest]
    return np.unique(point[distance <= _MAX_END_DISTANCE * shortest[point]]).astype(np.int64)


def _distances(points: Points, lines: Floats) -> tuple[Floats, Ints]:
    """Return the distance (n,) of points (n, 3) from line segments (m, 2, 3), and the closest segment (n,)."""
    segments = np.arange(2 * len(lines)).reshape(-1, 2)
    squares, line, _ = igl.point_mesh_squared_distance(
        np.ascontiguousarray(points), np.ascontiguousarray(lines.reshape(-1, 3)), segments
    )
    return np.sqrt(np.asarray(squares)), np.asarray(line, dtype=np.int64)
