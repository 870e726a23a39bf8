"""A triangle mesh that kernels change, with what all of them need: faces across sides.

Side i of a face is opposite its corner i.
"""

from typing import Any, NamedTuple

from .compiled import inlined, kernel


class Triangulation(NamedTuple):
    """A manifold triangle mesh that kernels change: faces, what is across their sides, and points.

    Attributes
    ----------
    points, faces
        Coordinates (n, 3) and corners (m, 3).
    neighbours
        The face across each side (m, 3), -1 at the boundary.
    labels
        A number for each side (m, 3), the same from both faces; sides of another number than 0 are not flipped.
    parents
        For points that are the middle of an edge, its ends (n, 2).
    deviation
        Bound on the distance of each face (m,) from the surface before all flips.
    stack
        Workspace (m,) for faces.
    """

    points: Any
    faces: Any
    neighbours: Any
    labels: Any
    parents: Any
    deviation: Any
    stack: Any


@inlined
def difference(points, p, q):
    """Return the vector from point q to point p."""
    return points[p, 0] - points[q, 0], points[p, 1] - points[q, 1], points[p, 2] - points[q, 2]


@inlined
def write_row(table, row, values):
    """Write three values to a row of a table."""
    table[row, 0] = values[0]
    table[row, 1] = values[1]
    table[row, 2] = values[2]


@inlined
def write_face(mesh, face, corners, neighbours, labels):
    """Set the corners of a face, and neighbours and labels of the sides opposite them."""
    write_row(mesh.faces, face, corners)
    write_row(mesh.neighbours, face, neighbours)
    write_row(mesh.labels, face, labels)


@kernel
def side_towards(mesh, face, neighbour):
    """Return the side of a face across which a neighbour is."""
    for side in range(3):
        if mesh.neighbours[face, side] == neighbour:
            return side
    return -1


@kernel
def replace_neighbour(mesh, face, old, new):
    """Make a face the neighbour of another one in place of the old one; face -1 stands for none."""
    if face >= 0:
        mesh.neighbours[face, side_towards(mesh, face, old)] = new
