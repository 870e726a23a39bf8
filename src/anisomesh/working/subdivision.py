"""Subdivision of long edges that does not change the surface as a point set."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, FaceIndices, FaceLabels, Floats
from anisomesh.errors import OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys

logger = logging.getLogger(__name__)

_MAX_PASSES = 64  # each halves edges, so Euclidean lengths need fewer; a metric that grows with each pass does not end

# Triangles that replace a face, by the number of its split sides. Nodes 0-2 are the corners of the face and 3-5 the
# midpoints of the sides opposite them. The face is rotated so that the one split side, or the one whole side of two
# split ones, is opposite corner 0; the quadrilateral 5, 1, 2, 4 is then cut along its shorter diagonal.
_SPLIT_PATTERNS = (
    np.array([[0, 1, 2]]),  # no side
    np.array([[0, 1, 3], [0, 3, 2]]),  # one side
    np.array([[0, 5, 4], [5, 1, 2], [5, 2, 4]]),  # two sides, diagonal 5-2
    np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2], [3, 4, 5]]),  # three sides
    np.array([[0, 5, 4], [5, 1, 4], [1, 2, 4]]),  # two sides, diagonal 1-4
)


@dataclass(frozen=True, kw_only=True)
class Subdivision:
    """A subdivided surface and its position on the parent surface.

    Attributes
    ----------
    surface
        The subdivided surface; its first V points are the parent's points, unchanged.
    parent_face
        For every face (F',) the parent's face that contains it.
    point_corners
        For every point (V', 3) three points of the parent; a point of the parent itself is repeated.
    barycentric
        Their weights (V', 3): a point is the sum of weights times corners.
    complete
        Whether all edges are short enough; False if the limit on the number of faces was reached.
    """

    surface: Surface
    parent_face: FaceLabels
    point_corners: FaceIndices
    barycentric: npt.NDArray[np.float64]
    complete: bool

    def interpolate(self, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Interpolate values (V, ...) at the parent's points linearly to all points (V', ...)."""
        values = np.asarray(values, dtype=np.float64)
        return np.asarray(np.einsum("vc,vc...->v...", self.barycentric, values[self.point_corners]))


def split_long_edges(
    surface: Surface, max_length: float, *, max_faces: int, lengths: Callable[[Surface], Floats] | None = None
) -> Subdivision:
    """Split every edge longer than ``max_length`` at its midpoint until none is left.

    Parameters
    ----------
    surface
        The parent surface.
    max_length
        Upper bound on edge lengths of the result, in model units.
    max_faces
        Upper bound on the number of faces of the result. If a pass would exceed it, only the longest edges are split
        and the result is not ``complete``.
    lengths
        What counts as the lengths of the edges (E,) of a subdivided surface, such as lengths in a metric; by default
        their Euclidean lengths.

    Raises
    ------
    OptionError
        If ``max_length`` is not positive and finite, or ``max_faces`` is less than the number of faces.

    Notes
    -----
    Each pass splits all long edges at once: a face with one, two or three split sides becomes two, three or four
    faces. Geometry, boundary and topology of the surface do not change. Linear in the number of resulting faces.
    """
    if not (np.isfinite(max_length) and max_length > 0):
        raise OptionError(f"max_length is {max_length:g}; expected a positive length in model units")
    if max_faces < surface.n_faces:
        raise OptionError(f"max_faces is {max_faces:,}; expected at least the surface's {surface.n_faces:,} faces")
    current = surface
    parent = np.arange(surface.n_faces, dtype=np.int32)
    weights = np.broadcast_to(np.eye(3), (surface.n_faces, 3, 3))
    for _ in range(_MAX_PASSES):
        long = current.edge_lengths if lengths is None else lengths(current)
        split = _edges_to_split(current, long, max_length, max_faces - current.n_faces)
        if not split.any():
            break
        current, origin, weights = _split(current, weights, split)
        parent = parent[origin]
    complete = not bool((long > max_length).any())
    if not complete:
        logger.info("subdivision reached the limit of %d faces; some edges are longer than %g", max_faces, max_length)
    point_corners = np.repeat(np.arange(current.n_points, dtype=np.int32)[:, None], 3, axis=1)
    barycentric = np.tile([1.0, 0.0, 0.0], (current.n_points, 1))
    added = current.faces >= surface.n_points
    point_corners[current.faces[added]] = surface.faces[parent[np.nonzero(added)[0]]]
    barycentric[current.faces[added]] = weights[added]
    return Subdivision(
        surface=current, parent_face=parent, point_corners=point_corners, barycentric=barycentric, complete=complete
    )


def edges_within(subdivision: Subdivision, parent: Surface, edges: EdgeMask) -> EdgeMask:
    """Return which edges (E',) of a subdivided surface are parts of these edges (E,) of its parent.

    Notes
    -----
    A point lies on an edge of the parent if at most two distinct corners have positive weight. An edge is a part of
    an edge of the parent if both its ends lie on it.
    """
    used = subdivision.barycentric > 0.0
    some = subdivision.point_corners[np.arange(len(used)), used.argmax(axis=1)]
    corners = np.where(used, subdivision.point_corners, some[:, None])
    low, high = corners.min(axis=1), corners.max(axis=1)
    middle = corners.sum(axis=1) - low - high
    on_edge = (middle == low) | (middle == high)
    a, b = subdivision.surface.edges.T
    ends = np.stack([np.minimum(low[a], low[b]), np.maximum(high[a], high[b])], axis=1)
    fits = on_edge[a] & on_edge[b]
    for end in (a, b):
        fits &= (low[end, None] == ends).any(axis=1) & (high[end, None] == ends).any(axis=1)
    return np.asarray(fits & np.isin(edge_keys(ends), edge_keys(parent.edges[edges])))


def _edges_to_split(surface: Surface, lengths: Floats, max_length: float, budget: int) -> EdgeMask:
    """Return which edges (E,) exceed the length; only the longest if splitting all would add more than ``budget``."""
    split = lengths > max_length
    long = np.flatnonzero(split)
    if surface.edge_face_count[long].sum() > budget:
        long = long[np.argsort(-lengths[long], kind="stable")]
        split[long[np.cumsum(surface.edge_face_count[long]) > budget]] = False
    return split


def _split(
    surface: Surface, weights: npt.NDArray[np.float64], split: EdgeMask
) -> tuple[Surface, FaceLabels, npt.NDArray[np.float64]]:
    """Split edges once; return the surface, the old face of each new face (F',) and its corner weights (F', 3, 3)."""
    edge_midpoint = np.full(len(split), -1, dtype=np.int32)
    edge_midpoint[split] = surface.n_points + np.arange(split.sum())
    ends = surface.points[surface.edges[split]]
    points = np.concatenate([surface.points, 0.5 * (ends[:, 0] + ends[:, 1])])
    midpoints = edge_midpoint[surface.face_edges]
    is_split = midpoints >= 0
    count = is_split.sum(axis=1)
    first_corner = np.where(count == 1, is_split.argmax(axis=1), is_split.argmin(axis=1) * (count == 2))
    rotation = (first_corner[:, None] + np.arange(3)) % 3
    rows = np.arange(surface.n_faces)[:, None]
    nodes = np.concatenate([surface.faces[rows, rotation], midpoints[rows, rotation]], axis=1)
    w = weights[rows, rotation]
    node_weights = np.concatenate([w, 0.5 * (w[:, [1, 2, 0]] + w[:, [2, 0, 1]])], axis=1)
    diagonals = np.linalg.norm(points[nodes[:, [5, 1]]] - points[nodes[:, [2, 4]]], axis=2)
    pattern = np.where((count == 2) & (diagonals[:, 0] > diagonals[:, 1]), 4, count)
    origin, corners = [], []
    for number, triangles in enumerate(_SPLIT_PATTERNS):
        chosen = np.flatnonzero(pattern == number)
        origin.append(np.repeat(chosen, len(triangles)))
        corners.append(np.tile(triangles, (len(chosen), 1)))
    old, local = np.concatenate(origin), np.concatenate(corners)
    order = np.argsort(old, kind="stable")
    old, local = old[order], local[order]
    return Surface(points, nodes[old[:, None], local]), old.astype(np.int32), node_weights[old[:, None], local]
