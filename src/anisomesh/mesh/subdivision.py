"""Splitting long edges without changing the surface."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceIndices, FaceLabels
from anisomesh.errors import OptionError
from anisomesh.mesh.surface import Surface

logger = logging.getLogger(__name__)

EdgeMask = npt.NDArray[np.bool_]

# Triangles for 0, 1, 2, 3 split sides, and for 2 with the other diagonal. Nodes 0-2 are the corners, 3-5 the
# middles of the sides opposite them.
PATTERNS = (
    np.array([[0, 1, 2]]),
    np.array([[0, 1, 3], [0, 3, 2]]),
    np.array([[0, 5, 4], [5, 1, 2], [5, 2, 4]]),
    np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2], [3, 4, 5]]),
    np.array([[0, 5, 4], [5, 1, 4], [1, 2, 4]]),
)


@dataclass(frozen=True, kw_only=True)
class Subdivision:
    """A subdivided surface and how it lies on its parent.

    Parameters
    ----------
    surface
        The refined surface; its first points are the parent's, unchanged.
    parent_face
        The parent's face that each face (F',) lies in.
    point_corners
        Three points of the parent (V', 3) for every point.
    barycentric
        Their weights (V', 3): point = sum of weight times corner; a parent's point is its own first corner.
    complete
        Whether no edge is too long any more; False if the limit on faces came first.
    """

    surface: Surface
    parent_face: FaceLabels
    point_corners: FaceIndices
    barycentric: npt.NDArray[np.float64]
    complete: bool

    def interpolate(self, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return values (V', ...) at the refined points from values (V, ...) at the parent's points."""
        values = np.asarray(values, dtype=np.float64)
        return np.asarray(np.einsum("vc,vc...->v...", self.barycentric, values[self.point_corners]))


def split_long_edges(surface: Surface, max_length: float, *, max_faces: int) -> Subdivision:
    """Split every edge longer than ``max_length`` at its middle until none is left.

    Parameters
    ----------
    surface
        The parent surface.
    max_length
        Length (model units) that no edge of the result exceeds.
    max_faces
        The result has at most this many faces; reaching it ends the work early, which ``complete`` tells.

    Raises
    ------
    OptionError
        If ``max_length`` is not positive and finite or ``max_faces`` is below the number of faces there are.

    Notes
    -----
    Each pass splits all long edges at once, so that neighbours agree: a face with one, two or three split sides
    becomes two, three or four faces; with two, the rest is a quadrilateral cut along its shorter diagonal. The
    surface as a set of points, its boundary and its topology stay the same. Linear in the number of faces of
    the result. When a pass would exceed the limit only the longest edges that fit are split.
    """
    if not (np.isfinite(max_length) and max_length > 0):
        raise OptionError(f"max_length is {max_length:g}; expected a positive length in model units")
    if max_faces < surface.n_faces:
        raise OptionError(f"max_faces is {max_faces:,} but the surface has {surface.n_faces:,} faces already")
    current = surface
    parent = np.arange(surface.n_faces, dtype=np.int32)
    weights = np.broadcast_to(np.eye(3), (surface.n_faces, 3, 3))
    while (split := _edges_to_split(current, max_length, max_faces - current.n_faces)).any():
        current, origin, weights = _split(current, weights, split)
        parent = parent[origin]
    complete = not bool((current.edge_lengths > max_length).any())
    if not complete:
        logger.info("stopped at %d faces (limit %d) with edges over %g left", current.n_faces, max_faces, max_length)
    point_corners = np.repeat(np.arange(current.n_points, dtype=np.int32)[:, None], 3, axis=1)
    barycentric = np.tile([1.0, 0.0, 0.0], (current.n_points, 1))
    added = current.faces >= surface.n_points
    point_corners[current.faces[added]] = surface.faces[parent[np.nonzero(added)[0]]]
    barycentric[current.faces[added]] = weights[added]
    return Subdivision(
        surface=current, parent_face=parent, point_corners=point_corners, barycentric=barycentric, complete=complete
    )


def _edges_to_split(surface: Surface, max_length: float, budget: int) -> EdgeMask:
    """Return the edges that are too long; the longest that fit if all of them would add too many faces."""
    split = surface.edge_lengths > max_length
    long = np.flatnonzero(split)
    if surface.edge_face_count[long].sum() > budget:
        long = long[np.argsort(-surface.edge_lengths[long], kind="stable")]
        split[long[np.cumsum(surface.edge_face_count[long]) > budget]] = False
    return split


def _split(
    surface: Surface, weights: npt.NDArray[np.float64], split: EdgeMask
) -> tuple[Surface, FaceLabels, npt.NDArray[np.float64]]:
    """Split these edges; return the new surface, the old face of each new one and its corner weights (F', 3, 3)."""
    middle = np.full(len(split), -1, dtype=np.int32)
    middle[split] = surface.n_points + np.arange(split.sum())
    ends = surface.points[surface.edges[split]]
    points = np.concatenate([surface.points, 0.5 * (ends[:, 0] + ends[:, 1])])
    middles = middle[surface.face_edges]
    has = middles >= 0
    count = has.sum(axis=1)
    # Turn the faces so that the only split side, or the only whole one, is opposite the first corner.
    odd_one = np.where(count == 1, has.argmax(axis=1), has.argmin(axis=1) * (count == 2))
    turn = (odd_one[:, None] + np.arange(3)) % 3
    rows = np.arange(surface.n_faces)[:, None]
    nodes = np.concatenate([surface.faces[rows, turn], middles[rows, turn]], axis=1)
    w = weights[rows, turn]
    node_weights = np.concatenate([w, 0.5 * (w[:, [1, 2, 0]] + w[:, [2, 0, 1]])], axis=1)
    across = np.linalg.norm(points[nodes[:, [5, 1]]] - points[nodes[:, [2, 4]]], axis=2)
    pattern = np.where((count == 2) & (across[:, 0] > across[:, 1]), 4, count)
    origin, corners = [], []
    for number, triangles in enumerate(PATTERNS):
        chosen = np.flatnonzero(pattern == number)
        origin.append(np.repeat(chosen, len(triangles)))
        corners.append(np.tile(triangles, (len(chosen), 1)))
    old, local = np.concatenate(origin), np.concatenate(corners)
    order = np.argsort(old, kind="stable")
    old, local = old[order], local[order]
    refined = Surface(points, nodes[old[:, None], local])
    return refined, old.astype(np.int32), node_weights[old[:, None], local]
