"""Jagged lines along edges of a smooth surface, straightened: borders of regions of a scan go around its triangles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, Edges, PointMask, Points
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.geometry import face_cross, unit
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys, graph_components

_ROUNDS, _PAIRS = 3, 2  # of flips and smoothing, and pairs of steps of smoothing after the flips of each
_SHORTEST_LINE = 24  # edges: shorter ones stay, since a small loop would shrink; heuristic
_STEPS = (0.5, -0.52)  # of the way to the middle of the two neighbours: the first ends a zigzag, the second shrinkage
_MIN_TURN_COSINE = 0.7  # between the normals of a face before and after
_MIN_AREA = 0.2  # of a face, over its area before

Keys = npt.NDArray[np.int64]  # (n,)


def with_smooth_lines(
    surface: Surface, lines: EdgeMask, others: Sequence[EdgeMask], fixed: PointMask
) -> tuple[Surface, list[EdgeMask]]:
    """Return a surface with points on lines moved along it, such that the lines turn less, and its marked edges.

    Parameters
    ----------
    surface
        An oriented manifold surface.
    lines
        Edges (E,) that make up the lines.
    others
        Other marked edges (E,), which stay.
    fixed
        Points (V,) that stay, besides ends and junctions of lines, and short lines.

    Returns
    -------
    surface, marked
        A surface with as many points and faces, and its edges that were in ``lines`` and in each of ``others``.

    Notes
    -----
    Taubin smoothing, each step projected back onto the surface. A triangle with two sides on a line would lose its
    area, so its third side is flipped first. Points at faces that would turn by more than 45 degrees or lose more than
    four fifths of their area go back to where they were.

    References
    ----------
    Taubin, "A signal processing approach to fair surface design", 1995.
    """
    keys = [edge_keys(surface.edges[mask]) for mask in (lines, *others)]
    ends = surface.edges[lines]
    movable = (np.bincount(ends.ravel(), minlength=surface.n_points) == 2) & ~fixed
    line = graph_components(ends, surface.n_points)[1]
    movable &= (np.bincount(line[ends[:, 0]], minlength=line.max() + 1) >= _SHORTEST_LINE)[line]
    reference, moved = ClosestPoints(surface), surface
    for _ in range(_ROUNDS if movable.any() else 0):
        moved = _with_room(moved, keys[0], np.concatenate(keys))
        before = moved
        for step in _PAIRS * _STEPS:
            moved = _without_folds(moved, before, _stepped(moved.points, ends, movable, step, reference))
    found = edge_keys(moved.edges)
    return moved, [np.isin(found, those) for those in keys]


def _with_room(surface: Surface, lines: Keys, kept: Keys) -> Surface:
    """Return a surface whose faces with two sides on lines have had the third side flipped, unless it is kept.

    ``lines`` and ``kept`` are keys of edges (n,).
    """
    keys = edge_keys(surface.edges)
    on_line, stays = np.isin(keys, lines)[surface.face_edges], np.isin(keys, kept)
    face = np.flatnonzero(on_line.sum(axis=1) == 2)
    side = np.argmin(on_line[face], axis=1)
    other = surface.face_neighbours[face, side]
    usable = (other >= 0) & ~stays[surface.face_edges[face, side]] & ~np.isin(other, face)
    usable[usable] &= np.isin(np.arange(usable.sum()), np.unique(other[usable], return_index=True)[1])
    face, side, other = face[usable], side[usable], other[usable]
    far_side = np.argmax(surface.face_neighbours[other] == face[:, None], axis=1)
    tip, far = surface.faces[face, side], surface.faces[other, far_side]
    start, end = surface.faces[face, (side + 1) % 3], surface.faces[face, (side + 2) % 3]
    first, second = np.stack([tip, start, far], axis=1), np.stack([tip, far, end], axis=1)
    normals = unit(surface.face_normals[face] + surface.face_normals[other])
    new_keys = edge_keys(np.stack([tip, far], axis=1))
    good = ~np.isin(new_keys, keys) & np.isin(np.arange(len(tip)), np.unique(new_keys, return_index=True)[1])
    for triangles in (first, second):
        good &= np.einsum("nx,nx->n", unit(face_cross(surface.points, triangles)), normals) > _MIN_TURN_COSINE
    faces = surface.faces.copy()
    faces[face[good]], faces[other[good]] = first[good], second[good]
    return Surface(surface.points, faces)


def _stepped(points: Points, ends: Edges, movable: PointMask, step: float, reference: ClosestPoints) -> Points:
    """Return points (V, 3) after a step of smoothing along edges (n, 2), on a surface."""
    sums = np.zeros_like(points)
    np.add.at(sums, ends[:, 0], points[ends[:, 1]])
    np.add.at(sums, ends[:, 1], points[ends[:, 0]])
    facet, weights = reference.locate(points[movable] + step * (0.5 * sums[movable] - points[movable]))
    moved = points.copy()
    moved[movable] = np.einsum("nc,ncx->nx", weights, reference.surface.points[reference.surface.faces[facet]])
    return moved


def _without_folds(surface: Surface, before: Surface, trial: Points) -> Surface:
    """Return a surface with points moved (V, 3), but not the ones at faces that fold or get flat against ``before``."""
    back = np.zeros(surface.n_points, dtype=bool)
    while True:
        moved = surface.with_points(np.where(back[:, None], surface.points, trial))
        cosine = np.einsum("fx,fx->f", moved.face_normals, before.face_normals)
        bad = (cosine < _MIN_TURN_COSINE) | (moved.face_areas < _MIN_AREA * before.face_areas)
        more = np.zeros_like(back)
        more[surface.faces[bad]] = True
        more &= (moved.points != surface.points).any(axis=1)
        if not more.any():
            return moved
        back |= more
