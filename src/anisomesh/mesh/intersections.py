"""Self-intersections: the pairs of triangles of a surface that intersect, decided exactly."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh._kernels import intersections as kernels
from anisomesh._kernels.orientation import choose_axes
from anisomesh.mesh.geometry import cross, unit
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.weld import coincident

_FACES_PER_LEAF = 4  # maximal number of faces in a leaf of the bounding-box tree; heuristic, changes only the time
_MIN_PAIR_BUFFER = 65_536  # pairs, least size of the buffer that the kernel fills; changes only the time
_SLAB_MARGIN = 1e-14  # exceeds twice the rounding error of products of unit vectors and points in [-1, 1]^3

Pairs = npt.NDArray[np.int32]


def self_intersections(surface: Surface) -> Pairs:
    """Return the pairs of faces (n, 2) that intersect, lower index first, in lexicographic order.

    Vertices with equal coordinates are identified, so that faces do not intersect along an edge that was cut open.
    Two faces that share

    - no vertex intersect if the closed triangles have a common point: touching counts;
    - one vertex intersect if they have a second common point;
    - two vertices intersect if they are coplanar and on the same side of the shared edge, folded onto each other;
    - three vertices intersect.

    Faces whose vertices are exactly collinear or repeated are ignored.

    Parameters
    ----------
    surface
        Any surface; it need be neither manifold nor oriented.

    Notes
    -----
    The predicates are exact as long as no nonzero coordinate is smaller than 1e-90 times the largest. Candidates are
    pairs of overlapping bounding boxes; they are not stored, so that memory is proportional to the number of faces
    and of pairs found. Long thin faces oblique to the axes overlap many boxes, which takes more time.

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
    depth = max(0, (len(faces) - 1) // _FACES_PER_LEAF).bit_length()
    order = np.arange(len(faces))
    kernels.sort_into_tree(0.5 * (boxes[:, :3] + boxes[:, 3:]), order, depth)
    boxes, faces, axes = boxes[order], faces[order], axes[order]
    nodes, slabs = _node_boxes(boxes, depth), _slabs(points, faces)

    stack = np.empty((depth + 2, 2), dtype=np.int64)
    buffer = np.empty((max(len(faces), _MIN_PAIR_BUFFER), 2), dtype=np.int32)
    blocks, face = [], 0
    while face < len(faces):
        face, written = kernels.find_pairs(face, points, faces, axes, boxes, slabs, nodes, depth, stack, buffer)
        blocks.append(buffer[:written].copy())
    pairs = np.sort(with_area[order[np.concatenate(blocks)]], axis=1)
    return np.asarray(pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))], dtype=np.int32)


def count_intersections_from(first: int, points: Points, faces: Faces) -> int:
    """Return the number of intersecting pairs of which one face has the number ``first`` or a higher one.

    The pairs are the ones of :func:`self_intersections`, without a search tree: for a few faces among some hundred.

    Parameters
    ----------
    first
        Number of a face.
    points, faces
        A mesh (V, 3), (F, 3).
    """
    n = len(faces)
    axes, boxes = np.empty(n, dtype=np.int8), np.empty((n, 6))
    pair, pair_axes = np.empty((2, 3), dtype=np.int32), np.empty(2, dtype=np.int8)
    return int(kernels.count_pairs_from(first, _scaled(points), faces, axes, boxes, pair, pair_axes))


def _scaled(points: Points) -> Points:
    """Return points scaled by a power of two to at most 1."""
    return np.asarray(np.ldexp(points, -np.frexp(np.abs(points).max())[1]))


def _welded(surface: Surface) -> tuple[Points, Faces]:
    """Return the distinct vertices, scaled, and the faces (F, 3) on them."""
    used, inverse = np.unique(coincident(surface.points)[surface.faces], return_inverse=True)
    return _scaled(surface.points[used]), inverse.reshape(-1, 3).astype(np.int32)


def _boxes(points: Points, faces: Faces) -> npt.NDArray[np.float64]:
    """Return the bounding boxes (F, 6) of the faces, lower and upper corner."""
    a, b, c = points[faces[:, 0]], points[faces[:, 1]], points[faces[:, 2]]
    return np.concatenate([np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)], axis=1)


def _slabs(points: Points, faces: Faces) -> npt.NDArray[np.float64]:
    """Return the narrowest slab (F, 5) around each face in its plane: unit direction, lower and upper bound.

    The boxes of long thin triangles side by side overlap, their slabs do not. The bounds include the rounding error
    of dot products with the direction, as coordinates are at most 1.
    """
    corners = points[faces]
    sides = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    longest = np.argmax(np.linalg.norm(sides, axis=2), axis=1)
    direction = unit(cross(cross(sides[:, 1], sides[:, 2]), sides[np.arange(len(faces)), longest]))
    heights = np.einsum("fcx,fx->fc", corners, direction)
    low, high = heights.min(axis=1) - _SLAB_MARGIN, heights.max(axis=1) + _SLAB_MARGIN
    return np.concatenate([direction, low[:, None], high[:, None]], axis=1)


def _node_boxes(boxes: npt.NDArray[np.float64], depth: int) -> npt.NDArray[np.float64]:
    """Return the boxes (2^(depth + 1) - 1, 6) of the nodes of the complete tree over boxes (F, 6) in tree order."""
    first = (len(boxes) * np.arange(1 << depth)) >> depth
    low = np.minimum.reduceat(boxes[:, :3], first)
    high = np.maximum.reduceat(boxes[:, 3:], first)
    levels = [np.concatenate([low, high], axis=1)]
    for _ in range(depth):
        low, high = np.minimum(low[0::2], low[1::2]), np.maximum(high[0::2], high[1::2])
        levels.append(np.concatenate([low, high], axis=1))
    return np.concatenate(levels[::-1])
