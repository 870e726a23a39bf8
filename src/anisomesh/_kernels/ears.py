"""Triangulation of simple polygons, concave ones included, by ear clipping.

A corner is an ear if the triangle of it and its two neighbours lies inside the polygon. Clipping an ear changes only
the two neighbours, so ears are kept in queues (Eberly, "Triangulation by ear clipping"): the cost is the number of
corners times the number of concave corners. Thin ears wait for the others, since corners on a straight side are rarely
exactly on it. Corners are compared with a tolerance for rounding of their coordinates.
"""

from typing import Any, NamedTuple

import numpy as np

from .compiled import kernel

_THIN = 1e-3  # twice the area of an ear over the square of its longest side; heuristic
_ROUNDING = 16.0 * np.finfo(np.float64).eps  # of a signed area, relative to extent times length


class Corners(NamedTuple):
    """Workspace for a polygon of at most n corners.

    Attributes
    ----------
    xy
        Coordinates in the plane of the polygon (n, 2), divided by its extent.
    before, after
        Neighbours in the polygon as it is (n,).
    stamp
        Number of changes of the neighbours of each corner (n,), -1 if it is clipped.
    concave
        Corners that had no clearly convex angle (n,).
    queue
        Ears and their stamps (3 n, 2): well-shaped ones from the beginning, thin ones from the end.
    """

    xy: Any
    before: Any
    after: Any
    stamp: Any
    concave: Any
    queue: Any


@kernel
def _turn(xy, a, b, c):
    """Return twice the signed area of a b c; 0 within its rounding error."""
    ux, uy = xy[b, 0] - xy[a, 0], xy[b, 1] - xy[a, 1]
    vx, vy = xy[c, 0] - xy[a, 0], xy[c, 1] - xy[a, 1]
    area = ux * vy - uy * vx
    error = _ROUNDING * (abs(ux) + abs(uy) + abs(vx) + abs(vy))
    return area if abs(area) > error else 0.0


@kernel
def _same(xy, a, b):
    return xy[a, 0] == xy[b, 0] and xy[a, 1] == xy[b, 1]


@kernel
def _in_wedge(xy, a, b, c, p):
    """Return whether the direction from b to p lies strictly between the sides b c and b a of a convex corner."""
    return _turn(xy, b, c, p) > 0.0 and _turn(xy, a, b, p) > 0.0


@kernel
def _blocks(corners, a, b, c, p, closed):
    """Return whether corner p keeps a b c from being an ear; ``closed`` if it also does on the outline of a b c."""
    xy = corners.xy
    if _same(xy, p, a) or _same(xy, p, c):
        return False
    if _same(xy, p, b):
        return _in_wedge(xy, a, b, c, corners.before[p]) or _in_wedge(xy, a, b, c, corners.after[p])
    least = min(_turn(xy, a, b, p), _turn(xy, b, c, p), _turn(xy, c, a, p))
    return least >= 0.0 if closed else least > 0.0


@kernel
def _is_ear(corners, n_concave, b, closed):
    """Return whether corner b is convex and no other corner lies in the triangle with its neighbours."""
    xy = corners.xy
    a, c = corners.before[b], corners.after[b]
    if _turn(xy, a, b, c) <= 0.0:
        return False
    left, right = min(xy[a, 0], xy[b, 0], xy[c, 0]), max(xy[a, 0], xy[b, 0], xy[c, 0])
    low, high = min(xy[a, 1], xy[b, 1], xy[c, 1]), max(xy[a, 1], xy[b, 1], xy[c, 1])
    for k in range(n_concave):
        p = corners.concave[k]
        if left <= xy[p, 0] <= right and low <= xy[p, 1] <= high:
            inside = corners.stamp[p] >= 0 and p != a and p != b and p != c
            if inside and _blocks(corners, a, b, c, p, closed):
                return False
    return True


@kernel
def _without_ears(corners, n_concave, start):
    """Return a corner to clip where no ear is queued, and whether that is by force.

    In this order: an ear; a corner without an area; an ear with others on its outline; the most convex corner.
    """
    for attempt in range(3):
        b = start
        while True:
            if attempt == 1:
                found = _turn(corners.xy, corners.before[b], b, corners.after[b]) == 0.0
            else:
                found = _is_ear(corners, n_concave, b, attempt == 0)
            if found:
                return b, False
            b = corners.after[b]
            if b == start:
                break
    best, largest = start, -np.inf
    b = start
    while True:
        turn = _turn(corners.xy, corners.before[b], b, corners.after[b])
        if turn > largest:
            best, largest = b, turn
        b = corners.after[b]
        if b == start:
            return best, True


@kernel
def _is_thin(corners, b):
    """Return whether the triangle of corner b and its neighbours is thin."""
    xy, a, c = corners.xy, corners.before[b], corners.after[b]
    longest = 0.0
    for p, q in ((a, b), (b, c), (c, a)):
        longest = max(longest, (xy[p, 0] - xy[q, 0]) ** 2 + (xy[p, 1] - xy[q, 1]) ** 2)
    return _turn(xy, a, b, c) < _THIN * longest


@kernel
def _queue_ear(corners, n_concave, b, end, thin):
    """Enter corner b into a queue if it is an ear; return where good ears end and thin ones begin."""
    if not _is_ear(corners, n_concave, b, True):
        return end, thin
    if _is_thin(corners, b):
        thin -= 1
        corners.queue[thin, 0], corners.queue[thin, 1] = b, corners.stamp[b]
    else:
        corners.queue[end, 0], corners.queue[end, 1] = b, corners.stamp[b]
        end += 1
    return end, thin


@kernel
def _next_ear(corners, begin, end, thin):
    """Return a queued ear, -1 if there is none, and where good and thin ears begin after it."""
    queue, stamp, last = corners.queue, corners.stamp, len(corners.queue)
    while begin < end and stamp[queue[begin, 0]] != queue[begin, 1]:
        begin += 1
    if begin < end:
        return queue[begin, 0], begin + 1, thin
    while thin < last and stamp[queue[thin, 0]] != queue[thin, 1]:
        thin += 1
    if thin < last:
        return queue[thin, 0], begin, thin + 1
    return -1, begin, thin


@kernel
def _clip_polygon(corners, n, triangles):
    """Write the triangles (n - 2, 3) of a polygon; return whether one had to be cut off by force."""
    n_concave = 0
    for k in range(n):
        corners.before[k], corners.after[k], corners.stamp[k] = (k - 1) % n, (k + 1) % n, 0
        if _turn(corners.xy, (k - 1) % n, k, (k + 1) % n) <= 0.0:
            corners.concave[n_concave] = k
            n_concave += 1
    begin, end, thin = 0, 0, len(corners.queue)
    for k in range(n):
        end, thin = _queue_ear(corners, n_concave, k, end, thin)
    forced = False
    a = 0
    for row in range(n - 2):
        b, begin, thin = _next_ear(corners, begin, end, thin)
        if b < 0:
            b, by_force = _without_ears(corners, n_concave, a)
            forced = forced or by_force
        a, c = corners.before[b], corners.after[b]
        triangles[row, 0], triangles[row, 1], triangles[row, 2] = a, b, c
        corners.after[a], corners.before[c], corners.stamp[b] = c, a, -1
        corners.stamp[a] += 1
        corners.stamp[c] += 1
        end, thin = _queue_ear(corners, n_concave, a, end, thin)
        end, thin = _queue_ear(corners, n_concave, c, end, thin)
    return forced


@kernel
def clip_polygons(xy, first, corners, triangles, forced):
    """Triangulate polygons in the plane, counter-clockwise, each into as many triangles as it has corners, less two.

    Parameters
    ----------
    xy
        Coordinates of the corners of all polygons (first[-1], 2); each polygon has an extent of about 1.
    first
        First corner of each polygon and the number of all (P + 1,).
    corners
        Workspace for the largest polygon; its ``xy`` is ignored.
    triangles
        Set to the numbers of corners, counted from the first of each polygon (first[-1] - 2 P, 3).
    forced
        Set to whether the polygon is not simple, so that its triangles overlap (P,).
    """
    for k in range(len(first) - 1):
        begin, end = first[k], first[k + 1]
        here = Corners(xy[begin:end], corners.before, corners.after, corners.stamp, corners.concave, corners.queue)
        forced[k] = _clip_polygon(here, end - begin, triangles[begin - 2 * k : end - 2 * k - 2])
