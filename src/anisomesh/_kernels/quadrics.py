"""Quadrics: sums of weighted squared distances to planes, as functions of the place.

A row of ten numbers holds the coefficients of xx, yy, zz, xy, xz, yz, x, y, z and 1; the mixed and linear ones are
halved.
"""

from .compiled import inlined, kernel
from .vectors import dot, solve_symmetric


@inlined
def add_plane(quadric, weight, normal, point):
    """Add to a quadric the weighted squared distance to the plane through a point with a unit normal."""
    x, y, z = normal
    height = dot(normal, point)
    quadric[0] += weight * x * x
    quadric[1] += weight * y * y
    quadric[2] += weight * z * z
    quadric[3] += weight * x * y
    quadric[4] += weight * x * z
    quadric[5] += weight * y * z
    quadric[6] += weight * height * x
    quadric[7] += weight * height * y
    quadric[8] += weight * height * z
    quadric[9] += weight * height * height


@inlined
def quadric_value(quadric, place):
    """Return the value of a quadric at a place."""
    x, y, z = place
    return (
        quadric[0] * x * x
        + quadric[1] * y * y
        + quadric[2] * z * z
        + 2.0 * (quadric[3] * x * y + quadric[4] * x * z + quadric[5] * y * z)
        - 2.0 * (quadric[6] * x + quadric[7] * y + quadric[8] * z)
        + quadric[9]
    )


@kernel
def quadric_trace(quadric):
    """Return the sum of the weights of the planes of a quadric."""
    return quadric[0] + quadric[1] + quadric[2]


@kernel
def quadric_step(quadric, place, pull):
    """Return the step from a place to where a quadric is lowest, held back by a pull in shares of its trace."""
    x, y, z = place
    right = (
        quadric[6] - quadric[0] * x - quadric[3] * y - quadric[4] * z,
        quadric[7] - quadric[3] * x - quadric[1] * y - quadric[5] * z,
        quadric[8] - quadric[4] * x - quadric[5] * y - quadric[2] * z,
    )
    matrix = quadric[0], quadric[3], quadric[4], quadric[1], quadric[5], quadric[2]
    return solve_symmetric(matrix, pull * quadric_trace(quadric), right)
