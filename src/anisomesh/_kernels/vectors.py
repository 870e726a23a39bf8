"""Vectors as tuples of three numbers, and the distance of a point to a triangle."""

from math import sqrt

from .compiled import inlined, kernel


@inlined
def cross(u, v):
    """Return the cross product of two vectors."""
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


@inlined
def dot(u, v):
    """Return the scalar product of two vectors."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@inlined
def length(u):
    """Return the length of a vector."""
    return sqrt(dot(u, u))


@inlined
def coordinates(points, p):
    """Return the coordinates of point p."""
    return points[p, 0], points[p, 1], points[p, 2]


@inlined
def subtract(u, v):
    """Return u - v."""
    return u[0] - v[0], u[1] - v[1], u[2] - v[2]


@inlined
def subtract_share(u, share, v):
    """Return u - share v."""
    return u[0] - share * v[0], u[1] - share * v[1], u[2] - share * v[2]


@inlined
def squared_length(u):
    """Return the squared length of a vector."""
    return dot(u, u)


@kernel
def square_to_triangle(p, a, b, c):
    """Return the squared distance of point p to triangle a b c; not a number for some degenerate triangles.

    References
    ----------
    Ericson, "Real-Time Collision Detection", 2005, section 5.1.5.
    """
    ab, ac, ap, bp, cp = subtract(b, a), subtract(c, a), subtract(p, a), subtract(p, b), subtract(p, c)
    ab_a, ac_a, ab_b, ac_b, ab_c, ac_c = dot(ab, ap), dot(ac, ap), dot(ab, bp), dot(ac, bp), dot(ab, cp), dot(ac, cp)
    if ab_a <= 0.0 and ac_a <= 0.0:
        return squared_length(ap)
    if ab_b >= 0.0 and ac_b <= ab_b:
        return squared_length(bp)
    at_c = ab_a * ac_b - ab_b * ac_a
    if at_c <= 0.0 and ab_a >= 0.0 and ab_b <= 0.0:
        return squared_length(subtract_share(ap, ab_a / (ab_a - ab_b), ab))
    if ac_c >= 0.0 and ab_c <= ac_c:
        return squared_length(cp)
    at_b = ab_c * ac_a - ab_a * ac_c
    if at_b <= 0.0 and ac_a >= 0.0 and ac_c <= 0.0:
        return squared_length(subtract_share(ap, ac_a / (ac_a - ac_c), ac))
    at_a = ab_b * ac_c - ab_c * ac_b
    towards_c, towards_b = ac_b - ab_b, ab_c - ac_c
    if at_a <= 0.0 and towards_c >= 0.0 and towards_b >= 0.0:
        return squared_length(subtract_share(bp, towards_c / (towards_c + towards_b), subtract(c, b)))
    total = at_a + at_b + at_c
    return squared_length(subtract_share(subtract_share(ap, at_b / total, ab), at_c / total, ac))
