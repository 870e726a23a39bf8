"""Vectors as tuples of three numbers, small systems of equations, and the distance of a point to a triangle."""

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


@inlined
def combine(weights, a, b, c):
    """Return the sum of three vectors with these weights."""
    u, v, w = weights
    return u * a[0] + v * b[0] + w * c[0], u * a[1] + v * b[1] + w * c[1], u * a[2] + v * b[2] + w * c[2]


@kernel
def closest_weights(p, a, b, c):
    """Return the barycentric coordinates of the point of triangle a b c closest to point p.

    They are not numbers for some triangles without area.

    References
    ----------
    Ericson, "Real-Time Collision Detection", 2005, section 5.1.5.
    """
    ab, ac, ap, bp, cp = subtract(b, a), subtract(c, a), subtract(p, a), subtract(p, b), subtract(p, c)
    ab_a, ac_a, ab_b, ac_b, ab_c, ac_c = dot(ab, ap), dot(ac, ap), dot(ab, bp), dot(ac, bp), dot(ab, cp), dot(ac, cp)
    if ab_a <= 0.0 and ac_a <= 0.0:
        return 1.0, 0.0, 0.0
    if ab_b >= 0.0 and ac_b <= ab_b:
        return 0.0, 1.0, 0.0
    at_c = ab_a * ac_b - ab_b * ac_a
    if at_c <= 0.0 and ab_a >= 0.0 and ab_b <= 0.0:
        share = ab_a / (ab_a - ab_b)
        return 1.0 - share, share, 0.0
    if ac_c >= 0.0 and ab_c <= ac_c:
        return 0.0, 0.0, 1.0
    at_b = ab_c * ac_a - ab_a * ac_c
    if at_b <= 0.0 and ac_a >= 0.0 and ac_c <= 0.0:
        share = ac_a / (ac_a - ac_c)
        return 1.0 - share, 0.0, share
    at_a = ab_b * ac_c - ab_c * ac_b
    towards_c, towards_b = ac_b - ab_b, ab_c - ac_c
    if at_a <= 0.0 and towards_c >= 0.0 and towards_b >= 0.0:
        share = towards_c / (towards_c + towards_b)
        return 0.0, 1.0 - share, share
    total = at_a + at_b + at_c
    return at_a / total, at_b / total, at_c / total


@kernel
def square_to_triangle(p, a, b, c):
    """Return the squared distance of point p to triangle a b c; not a number for some triangles without area."""
    return squared_length(combine(closest_weights(p, a, b, c), subtract(a, p), subtract(b, p), subtract(c, p)))


@inlined
def mapped(root, vector):
    """Return the product of a matrix (3, 3) and a vector."""
    x, y, z = vector
    return (
        root[0, 0] * x + root[0, 1] * y + root[0, 2] * z,
        root[1, 0] * x + root[1, 1] * y + root[1, 2] * z,
        root[2, 0] * x + root[2, 1] * y + root[2, 2] * z,
    )


@kernel
def solve_symmetric(matrix, shift, right):
    """Solve a symmetric system of three equations with a multiple of the identity added, by L D L^t."""
    xx, xy, xz, yy, yz, zz = matrix
    first = xx + shift
    low_y, low_z = xy / first, xz / first
    second = yy + shift - low_y * xy
    low_yz = (yz - low_y * xz) / second
    third = zz + shift - low_z * xz - low_yz * low_yz * second
    x = right[0]
    y = right[1] - low_y * x
    z = right[2] - low_z * x - low_yz * y
    z = z / third
    y = y / second - low_yz * z
    x = x / first - low_y * y - low_z * z
    return x, y, z
