"""Intersecting triangles of a mesh: candidates from a tree of boxes, decided by exact orientations.

A face is a row of three distinct indices into points, so faces share a point if and only if they share an index. Every
decision is the exact sign of an orientation determinant (module orientation).

Triangles in different planes are compared by the sides of these planes on which their corners lie, and by the sides on
which their edges pass each other (Guigue and Devillers, "Fast and robust triangle-triangle overlap test using
orientation predicates", 2003); coplanar triangles after projection along a coordinate axis.

The tree is complete: node m of level l has the faces from ``n m >> l`` to ``n (m + 1) >> l`` of the n faces in its
order, and is row ``2**l - 1 + m`` of ``nodes``.
"""

import numpy as np

from .compiled import inlined, kernel
from .orientation import choose_axes, orient2d, orient3d


@kernel
def _outside_an_edge(points, axis, a, b, c, p, q, r):
    """Return whether p, q and r, projected along the axis, are all strictly outside one edge of the triangle a b c."""
    inside = orient2d(points, axis, a, b, c)
    for _ in range(3):
        if (
            orient2d(points, axis, a, b, p) * inside < 0
            and orient2d(points, axis, a, b, q) * inside < 0
            and orient2d(points, axis, a, b, r) * inside < 0
        ):
            return True
        a, b, c = b, c, a
    return False


@kernel
def _within_wedge(points, axis, v, p, q, r):
    """Return whether r, projected along the axis, is in the closed wedge at v from p to q, less than a half-plane."""
    turn = orient2d(points, axis, v, p, q)
    return orient2d(points, axis, v, p, r) * turn >= 0 and orient2d(points, axis, v, r, q) * turn >= 0


@kernel
def _passes(points, u, v, side_u, side_v, x, y, z):
    """Return whether the segment u v, not coplanar, meets the triangle x y z, from the sides of its plane."""
    if side_u * side_v > 0 or (side_u == 0 and side_v == 0):
        return False
    xy = orient3d(points, u, v, x, y)
    yz = orient3d(points, u, v, y, z)
    if xy * yz < 0:
        return False
    zx = orient3d(points, u, v, z, x)
    return xy * zx >= 0 and yz * zx >= 0


@kernel
def _disjoint_meet(points, axis, a, b, c, p, q, r):
    """Return whether two triangles without a common corner meet; ``axis`` is the projection axis of the first.

    Coplanar triangles are disjoint if and only if one is outside an edge of the other (their Minkowski difference is
    convex, with edges parallel to theirs). Triangles in different planes meet in a segment on the intersection line of
    the planes. An end of it is on an edge of one triangle that meets the other or, if that edge is in the plane of the
    other, on an adjacent edge that is not.
    """
    side_a = orient3d(points, p, q, r, a)
    side_b = orient3d(points, p, q, r, b)
    side_c = orient3d(points, p, q, r, c)
    if side_a == side_b and side_b == side_c:
        if side_a != 0:
            return False
        return not (
            _outside_an_edge(points, axis, a, b, c, p, q, r) or _outside_an_edge(points, axis, p, q, r, a, b, c)
        )
    side_p = orient3d(points, a, b, c, p)
    side_q = orient3d(points, a, b, c, q)
    side_r = orient3d(points, a, b, c, r)
    if side_p == side_q and side_q == side_r:
        return False
    return (
        _passes(points, a, b, side_a, side_b, p, q, r)
        or _passes(points, b, c, side_b, side_c, p, q, r)
        or _passes(points, c, a, side_c, side_a, p, q, r)
        or _passes(points, p, q, side_p, side_q, a, b, c)
        or _passes(points, q, r, side_q, side_r, a, b, c)
        or _passes(points, r, p, side_r, side_p, a, b, c)
    )


@kernel
def _meet_beside_corner(points, axis, v, p, q, r, s):
    """Return whether triangles v p q and v r s meet in more than v; ``axis`` is the projection axis of the first.

    If they meet in another point, they meet along the ray from v through it up to the boundary of one of them: p q
    meets the triangle v r s, or r s the triangle v p q. If coplanar, an edge at v of one is in the wedge of the other.
    """
    side_p = orient3d(points, v, r, s, p)
    side_q = orient3d(points, v, r, s, q)
    if side_p * side_q > 0:
        return False
    if side_p == 0 and side_q == 0:
        return (
            _within_wedge(points, axis, v, p, q, r)
            or _within_wedge(points, axis, v, p, q, s)
            or _within_wedge(points, axis, v, r, s, p)
            or _within_wedge(points, axis, v, r, s, q)
        )
    side_r = orient3d(points, v, p, q, r)
    side_s = orient3d(points, v, p, q, s)
    if side_r * side_s > 0:
        return False
    # side_r and -side_s tell how the line p q passes v r and s v; side_p and -side_q how r s passes v p and q v
    passing = orient3d(points, p, q, r, s)
    return passing * (side_r - side_s) >= 0 or passing * (side_p - side_q) >= 0


@kernel
def faces_intersect(points, faces, axes, i, j):
    """Return whether two nondegenerate faces i and j meet in more than their common corners or edge."""
    shared = 0
    sum_i = 0
    sum_j = 0
    for k in range(3):
        for m in range(3):
            if faces[i, k] == faces[j, m]:
                shared += 1
                sum_i += k
                sum_j += m
    if shared == 0:
        return _disjoint_meet(
            points, axes[i], faces[i, 0], faces[i, 1], faces[i, 2], faces[j, 0], faces[j, 1], faces[j, 2]
        )
    if shared == 1:
        return _meet_beside_corner(
            points,
            axes[i],
            faces[i, sum_i],
            faces[i, (sum_i + 1) % 3],
            faces[i, (sum_i + 2) % 3],
            faces[j, (sum_j + 1) % 3],
            faces[j, (sum_j + 2) % 3],
        )
    if shared == 2:
        apex = 3 - sum_i
        a = faces[i, apex]
        b = faces[i, (apex + 1) % 3]
        c = faces[i, (apex + 2) % 3]
        other = faces[j, 3 - sum_j]
        if orient3d(points, a, b, c, other) != 0:
            return False
        return orient2d(points, axes[i], b, c, a) == orient2d(points, axes[i], b, c, other)
    return True


@inlined
def _select(keys, axis, order, first, last, middle):
    """Partition ``order[first:last]`` about the key of rank ``middle`` along one axis (quickselect, Hoare 1961)."""
    low = first
    high = last - 1
    while low < high:
        pivot = keys[order[(low + high) >> 1], axis]
        up = low
        down = high
        while up <= down:
            while keys[order[up], axis] < pivot:
                up += 1
            while keys[order[down], axis] > pivot:
                down -= 1
            if up <= down:
                order[up], order[down] = order[down], order[up]
                up += 1
                down -= 1
        if middle <= down:
            high = down
        elif middle >= up:
            low = up
        else:
            break


@kernel
def sort_into_tree(centres, order, depth):
    """Permute ``order`` (n,) so that each node splits its centres (n, 3) at the median of the widest axis."""
    n = len(order)
    for level in range(depth):
        for node in range(1 << level):
            first = (n * node) >> level
            last = (n * (node + 1)) >> level
            axis = 0
            widest = -1.0
            for x in range(3):
                low = np.inf
                high = -np.inf
                for k in range(first, last):
                    low = min(low, centres[order[k], x])
                    high = max(high, centres[order[k], x])
                if high - low > widest:
                    axis = x
                    widest = high - low
            _select(centres, axis, order, first, last, (n * (2 * node + 1)) >> (level + 1))


@inlined
def _overlap(boxes, i, others, j):
    """Return whether two closed boxes, each a row of three lower and three upper bounds, intersect."""
    return (
        boxes[i, 0] <= others[j, 3]
        and others[j, 0] <= boxes[i, 3]
        and boxes[i, 1] <= others[j, 4]
        and others[j, 1] <= boxes[i, 4]
        and boxes[i, 2] <= others[j, 5]
        and others[j, 2] <= boxes[i, 5]
    )


@inlined
def _outside_slab(points, faces, i, slabs, j):
    """Return whether face i is outside the slab of face j: a direction, a lower and an upper bound along it."""
    lowest = np.inf
    highest = -np.inf
    for c in range(3):
        p = faces[i, c]
        height = points[p, 0] * slabs[j, 0] + points[p, 1] * slabs[j, 1] + points[p, 2] * slabs[j, 2]
        lowest = min(lowest, height)
        highest = max(highest, height)
    return lowest > slabs[j, 4] or highest < slabs[j, 3]


@kernel
def find_pairs(begin, points, faces, axes, boxes, slabs, nodes, depth, stack, pairs):
    """Write the intersecting pairs of faces, from face ``begin`` on, as rows of ``pairs`` until it is full.

    Faces (F, 3), axes (F,), boxes (F, 6) and slabs (F, 5) are in the order of the tree; ``nodes`` are its boxes. A pair
    is found from its lower face. ``stack`` (depth + 2, 2) is a workspace.

    Returns
    -------
    tuple
        The face at which to continue, F at the end, and the number of pairs written. With F rows at least one face is
        completed.
    """
    n = len(faces)
    written = 0
    for face in range(begin, n):
        before = written
        stack[0, 0] = 0
        stack[0, 1] = 0
        height = 1
        while height > 0:
            height -= 1
            level = stack[height, 0]
            node = stack[height, 1]
            last = (n * (node + 1)) >> level
            if last <= face + 1 or not _overlap(boxes, face, nodes, (1 << level) - 1 + node):
                continue
            if level < depth:
                for child in range(2 * node, 2 * node + 2):
                    stack[height, 0] = level + 1
                    stack[height, 1] = child
                    height += 1
                continue
            for other in range(max((n * node) >> level, face + 1), last):
                if (
                    _overlap(boxes, face, boxes, other)
                    and not _outside_slab(points, faces, other, slabs, face)
                    and faces_intersect(points, faces, axes, face, other)
                ):
                    if written == len(pairs):
                        return face, before
                    pairs[written, 0] = face
                    pairs[written, 1] = other
                    written += 1
    return n, written


@inlined
def _coincide(points, p, q):
    """Return whether two points have equal coordinates."""
    return points[p, 0] == points[q, 0] and points[p, 1] == points[q, 1] and points[p, 2] == points[q, 2]


@inlined
def _write_box(points, faces, f, boxes):
    """Write the bounding box of a face, a row of three lower and three upper bounds."""
    a = faces[f, 0]
    b = faces[f, 1]
    c = faces[f, 2]
    for x in range(3):
        boxes[f, x] = min(points[a, x], points[b, x], points[c, x])
        boxes[f, x + 3] = max(points[a, x], points[b, x], points[c, x])


@kernel
def count_pairs_from(first, points, faces, axes, boxes, pair, pair_axes):
    """Return the number of intersecting pairs of which one face has the number ``first`` or a higher one.

    Every such face is compared with all before it, which suits a few among some hundred faces. Points with equal
    coordinates are the same one, faces (F, 3) without area are ignored. ``axes`` (F,), ``boxes`` (F, 6), ``pair``
    (2, 3) and ``pair_axes`` (2,) are workspaces.
    """
    choose_axes(points, faces, axes)
    for f in range(len(faces)):
        _write_box(points, faces, f, boxes)
    count = 0
    for face in range(first, len(faces)):
        if axes[face] < 0:
            continue
        pair_axes[0] = axes[face]
        for k in range(3):
            pair[0, k] = faces[face, k]
        for other in range(face):
            if axes[other] < 0 or not _overlap(boxes, face, boxes, other):
                continue
            pair_axes[1] = axes[other]
            for m in range(3):
                pair[1, m] = faces[other, m]
                for k in range(3):
                    if _coincide(points, pair[0, k], faces[other, m]):
                        pair[1, m] = pair[0, k]
            if faces_intersect(points, pair, pair_axes, 0, 1):
                count += 1
    return count
