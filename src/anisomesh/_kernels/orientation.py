"""Exact orientation predicates with a floating-point filter.

Where the error bound does not decide, exact arithmetic does (Shewchuk, "Adaptive precision floating-point arithmetic
and fast robust geometric predicates", 1997). Products of three coordinates and their rounding errors must be
representable as normal doubles.
"""

import numpy as np

from .compiled import allocating, kernel
from .predicates import UNIT_ROUNDOFF, add_determinant, add_product, sign_of_sum

_ORIENT2D_ERROR = (3.0 + 16.0 * UNIT_ROUNDOFF) * UNIT_ROUNDOFF  # relative; bound A of Shewchuk's orient2d
_ORIENT3D_ERROR = (7.0 + 56.0 * UNIT_ROUNDOFF) * UNIT_ROUNDOFF  # relative; bound A of Shewchuk's orient3d


@allocating
def _exact_orient2d(points, x, y, a, b, c):
    """Return the sign of the signed area of a b c in the coordinates x, y."""
    terms = np.empty(12)
    n = 0
    for p, q in ((a, b), (b, c), (c, a)):
        n = add_product(terms, n, points[p, x], points[q, y], 1.0)
        n = add_product(terms, n, points[p, y], points[q, x], -1.0)
    return sign_of_sum(terms, n)


@allocating
def _exact_orient3d(points, a, b, c, d):
    """Return the sign of the determinant of a - d, b - d, c - d; of one expansion if the differences are exact."""
    rows = np.empty((3, 3))
    rounded = False
    for k, p in enumerate((a, b, c)):
        for x in range(3):
            difference = points[p, x] - points[d, x]
            part = points[p, x] - difference
            error = (points[p, x] - (difference + part)) + (part - points[d, x])
            rows[k, x] = difference
            rounded = rounded or error != 0.0
    terms = np.empty(96)
    if not rounded:
        return sign_of_sum(terms, add_determinant(terms, 0, rows[0], rows[1], rows[2], 1.0))
    n = add_determinant(terms, 0, points[a], points[b], points[c], 1.0)
    n = add_determinant(terms, n, points[d], points[b], points[c], -1.0)
    n = add_determinant(terms, n, points[a], points[d], points[c], -1.0)
    n = add_determinant(terms, n, points[a], points[b], points[d], -1.0)
    return sign_of_sum(terms, n)


@kernel
def orient2d(points, axis, a, b, c):
    """Return the exact sign of the area of the triangle a b c projected along an axis, 1 if counter-clockwise."""
    x = (axis + 1) % 3
    y = (axis + 2) % 3
    left = (points[a, x] - points[c, x]) * (points[b, y] - points[c, y])
    right = (points[a, y] - points[c, y]) * (points[b, x] - points[c, x])
    area = left - right
    size = abs(left) + abs(right)
    if abs(area) > _ORIENT2D_ERROR * size:
        return 1 if area > 0.0 else -1
    if size == 0.0:
        return 0
    return _exact_orient2d(points, x, y, a, b, c)


@kernel
def orient3d(points, a, b, c, d):
    """Return the exact sign of the determinant of a - d, b - d, c - d, antisymmetric in the four points."""
    ax = points[a, 0] - points[d, 0]
    ay = points[a, 1] - points[d, 1]
    az = points[a, 2] - points[d, 2]
    bx = points[b, 0] - points[d, 0]
    by = points[b, 1] - points[d, 1]
    bz = points[b, 2] - points[d, 2]
    cx = points[c, 0] - points[d, 0]
    cy = points[c, 1] - points[d, 1]
    cz = points[c, 2] - points[d, 2]
    bc = bx * cy
    cb = cx * by
    ca = cx * ay
    ac = ax * cy
    ab = ax * by
    ba = bx * ay
    volume = az * (bc - cb) + bz * (ca - ac) + cz * (ab - ba)
    size = (abs(bc) + abs(cb)) * abs(az) + (abs(ca) + abs(ac)) * abs(bz) + (abs(ab) + abs(ba)) * abs(cz)
    if abs(volume) > _ORIENT3D_ERROR * size:
        return 1 if volume > 0.0 else -1
    if size == 0.0:  # every product has a factor 0, a difference of equal coordinates
        return 0
    return _exact_orient3d(points, a, b, c, d)


@kernel
def choose_axes(points, faces, axes):
    """Write for each face an axis (F,) along which its projection has an area, -1 for a degenerate face."""
    for f in range(len(faces)):
        a = faces[f, 0]
        b = faces[f, 1]
        c = faces[f, 2]
        widest = 0
        largest = -1.0
        for axis in range(3):
            x = (axis + 1) % 3
            y = (axis + 2) % 3
            area = (points[a, x] - points[c, x]) * (points[b, y] - points[c, y])
            area -= (points[a, y] - points[c, y]) * (points[b, x] - points[c, x])
            if abs(area) > largest:
                widest = axis
                largest = abs(area)
        axes[f] = -1
        for k in range(3):
            axis = (widest + k) % 3
            if orient2d(points, axis, a, b, c) != 0:
                axes[f] = axis
                break
