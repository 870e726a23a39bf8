"""Pairs of triangles of a surface that intersect."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh._kernels import intersections as kernels
from anisomesh._kernels.orientation import choose_axes
from anisomesh.mesh.geometry import unit
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.weld import coincident

_LEAF = 4  # most faces in a leaf of the tree
_LEAST_ROOM = 65_536  # pairs that a block has room for at least
_SLAB_ERROR = 1e-14  # more than the rounding error of two products of vectors of length 1

Pairs = npt.NDArray[np.int32]


def self_intersections(surface: Surface) -> Pairs:
    """Return the pairs of faces (n, 2) that intersect, lower index first, in lexicographic order.

    Points with equal coordinates are one point, so sheets that were cut apart along an edge do not intersect there.
    Two faces intersect

    - without a common point, if the closed triangles have a point in common: touching counts;
    - with one common point, if they have another point in common besides it;
    - with two common points, if they lie in one plane on the same side of their common edge, folded onto each other;
    - with the same three points.

    Faces without area, whose points are exactly collinear or repeated, are left out.

    Parameters
    ----------
    surface
        Any triangles; they need be neither manifold nor oriented.

    Notes
    -----
    Decisions are exact for the coordinates as they are, as long as none but zero is smaller than 1e-90 times the
    largest. Candidates are pairs of overlapping bounding boxes; they are not stored, so the memory taken is
    proportional to the faces and the pairs found. Faces that are long, thin and oblique to the axes overlap many
    boxes, which costs time only.

    References
    ----------
    Guigue, Devillers, "Fast and robust triangle-triangle overlap test using orientation predicates", 2003.
    Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric predicates", 1997.
    """
    points, faces = _welded(surface)
    axes = np.empty(len(faces), dtype=np.int8)
    choose_axes(points, faces, axes)
    with_area = np.flatnonzero(axes >= 0)
    if len(with_area) == 0:
        return np.empty((0, 2), dtype=np.int32)
    faces, axes = faces[with_area], axes[with_area]

    boxes = _boxes(points, faces)
    depth = max(0, (len(faces) - 1) // _LEAF).bit_length()
    order = np.arange(len(faces))
    kernels.sort_into_tree(0.5 * (boxes[:, :3] + boxes[:, 3:]), order, depth)
    boxes, faces, axes = boxes[order], faces[order], axes[order]
    nodes, slabs = _nodes(boxes, depth), _slabs(points, faces)

    stack = np.empty((depth + 2, 2), dtype=np.int64)
    room = np.empty((max(len(faces), _LEAST_ROOM), 2), dtype=np.int32)
    blocks, face = [], 0
    while face < len(faces):
        face, written = kernels.find_pairs(face, points, faces, axes, boxes, slabs, nodes, depth, stack, room)
        blocks.append(room[:written].copy())
    pairs = np.sort(with_area[order[np.concatenate(blocks)]], axis=1)
    return np.asarray(pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))], dtype=np.int32)


def _welded(surface: Surface) -> tuple[Points, Faces]:
    """Return the points in use, each once and scaled by a power of two to be at most 1, and the faces on them."""
    used, inverse = np.unique(coincident(surface.points)[surface.faces], return_inverse=True)
    points = surface.points[used]
    points = np.ldexp(points, -np.frexp(np.abs(points).max())[1])
    return points, inverse.reshape(-1, 3).astype(np.int32)


def _boxes(points: Points, faces: Faces) -> npt.NDArray[np.float64]:
    """Return lower and upper bounds (F, 6) of the faces."""
    corners = points[faces]
    return np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)


def _slabs(points: Points, faces: Faces) -> npt.NDArray[np.float64]:
    """Return the narrowest slab around each face, in its plane: a direction and two bounds, (F, 5).

    Boxes of long, thin and oblique triangles that lie side by side overlap; their slabs do not. The bounds allow for
    the rounding of products of points, which are at most 1, with the direction.
    """
    corners = points[faces]
    sides = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    longest = np.argmax(np.linalg.norm(sides, axis=2), axis=1)
    direction = unit(np.cross(np.cross(sides[:, 1], sides[:, 2]), sides[np.arange(len(faces)), longest]))
    heights = np.einsum("fcx,fx->fc", corners, direction)
    low, high = heights.min(axis=1) - _SLAB_ERROR, heights.max(axis=1) + _SLAB_ERROR
    return np.concatenate([direction, low[:, None], high[:, None]], axis=1)


def _nodes(boxes: npt.NDArray[np.float64], depth: int) -> npt.NDArray[np.float64]:
    """Return lower and upper bounds of the nodes of the complete tree over boxes (F, 6) in its order."""
    first = (len(boxes) * np.arange(1 << depth)) >> depth
    low = np.minimum.reduceat(boxes[:, :3], first)
    high = np.maximum.reduceat(boxes[:, 3:], first)
    levels = [np.concatenate([low, high], axis=1)]
    for _ in range(depth):
        low, high = np.minimum(low[0::2], low[1::2]), np.maximum(high[0::2], high[1::2])
        levels.append(np.concatenate([low, high], axis=1))
    return np.concatenate(levels[::-1])
