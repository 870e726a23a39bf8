"""Edges of a mesh along given lines, points of it at given places, and faces of it with given corners."""

from __future__ import annotations

import igl
import numpy as np
from scipy.spatial import cKDTree

from anisomesh._arrays import EdgeEnds, Points
from anisomesh.attributes.model import Ints
from anisomesh.attributes.places import Floats
from anisomesh.mesh.geometry import unit
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.weld import coincident

_MAX_END_DISTANCE = 0.01  # edge lengths of an end of an edge from the lines that it follows; heuristic
_MAX_MIDDLE_DISTANCE = 0.1  # the same of its middle: chords of curved lines; heuristic
_MIN_LINE_COSINE = 0.7  # between an edge and the line at its middle; heuristic


def transfer_lines(lines: Floats, target: Surface) -> tuple[EdgeEnds, Ints]:
    """Return the edges (m, 2) of a surface that follow line segments (n, 2, 3), and the segment (m,) of each."""
    proper = np.flatnonzero((lines[:, 0] != lines[:, 1]).any(axis=1))
    lines = lines[proper]
    if len(lines) == 0:
        return np.zeros((0, 2), dtype=np.int64), np.zeros(0, dtype=np.int64)
    ends = target.points[target.edges]
    limit = target.edge_lengths
    near = np.flatnonzero(
        (_distances(ends[:, 0], lines)[0] <= _MAX_END_DISTANCE * limit)
        & (_distances(ends[:, 1], lines)[0] <= _MAX_END_DISTANCE * limit)
    )
    distance, line = _distances(ends[near].mean(axis=1), lines)
    along = unit(ends[near, 1] - ends[near, 0]), unit(lines[line, 1] - lines[line, 0])
    follows = np.abs(np.einsum("nx,nx->n", *along)) >= _MIN_LINE_COSINE
    follows &= distance <= _MAX_MIDDLE_DISTANCE * limit[near]
    return np.asarray(target.edges[near[follows]], dtype=np.int64), proper[line[follows]]


def transfer_fixed_points(places: Points, target: Surface) -> tuple[Ints, Ints]:
    """Return the points (m,) of a surface that are at places (n, 3), and the place (m,) that each is at.

    They are as near as a hundredth of the shortest edge there.
    """
    if len(places) == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    shortest = np.full(target.n_points, np.inf)
    for end in target.edges.T:
        np.minimum.at(shortest, end, target.edge_lengths)
    used = np.unique(target.faces)
    distance, nearest = cKDTree(target.points[used]).query(places)
    point = used[nearest]
    found = np.flatnonzero(distance <= _MAX_END_DISTANCE * shortest[point])
    found = found[np.argsort(distance[found], kind="stable")]
    points, first = np.unique(point[found], return_index=True)
    return points.astype(np.int64), found[first]


def _distances(points: Points, lines: Floats) -> tuple[Floats, Ints]:
    """Return the distance (n,) of points (n, 3) from line segments (m, 2, 3), and the closest segment (n,)."""
    segments = np.arange(2 * len(lines)).reshape(-1, 2)
    squares, line, _ = igl.point_mesh_squared_distance(
        np.ascontiguousarray(points), np.ascontiguousarray(lines.reshape(-1, 3)), segments
    )
    return np.sqrt(np.asarray(squares)), np.asarray(line, dtype=np.int64)


def same_faces(surface: Surface, faces: Ints, target: Surface) -> Ints:
    """Return the faces (m,) of a target whose corners are at the places of the corners of some faces (n,)."""
    if len(faces) == 0:
        return np.zeros(0, dtype=np.int64)
    corners = surface.points[surface.faces[faces]].reshape(-1, 3)
    place = coincident(np.concatenate([corners, target.points]))
    wanted = np.sort(place[: len(corners)].reshape(-1, 3), axis=1)
    given = np.sort(place[len(corners) :][target.faces], axis=1)
    row = np.unique(np.concatenate([wanted, given]), axis=0, return_inverse=True)[1].reshape(-1)
    return np.flatnonzero(np.isin(row[len(wanted) :], row[: len(wanted)])).astype(np.int64)
