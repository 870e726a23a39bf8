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


@kernel
def corner_of(mesh, face, point):
    """Return the corner of a face that is a point."""
    corner = 0
    while mesh.faces[face, corner] != point:
        corner += 1
    return corner


@kernel
def faces_around(mesh, face, corner, faces, corners):
    """Write the faces around a corner and the corners in them, counter-clockwise; return their number and closedness.

    Around a point inside they start at the face, around a point of the boundary at the boundary. The number is -1 if
    they exceed the workspace.
    """
    point, start = mesh.faces[face, corner], face
    closed = False
    while not closed:
        before = mesh.neighbours[face, (corner + 2) % 3]
        if before < 0:
            break
        face, corner = before, corner_of(mesh, before, point)
        closed = face == start
    first, n = face, 0
    while n < len(faces):
        faces[n], corners[n] = face, corner
        n += 1
        after = mesh.neighbours[face, (corner + 1) % 3]
        if after < 0 or after == first:
            return n, closed
        face, corner = after, corner_of(mesh, after, point)
    return -1, closed


@kernel
def has_edge(mesh, face, corner, other):
    """Return whether there is an edge from a corner of a face to another point."""
    point = mesh.faces[face, corner]
    for turn in range(1, 3):
        current = face
        while current >= 0:
            i = 0
            while mesh.faces[current, i] != point:
                i += 1
            if mesh.faces[current, (i + 1) % 3] == other or mesh.faces[current, (i + 2) % 3] == other:
                return True
            current = mesh.neighbours[current, (i + turn) % 3]
            if current == face:
                return False
    return False


@kernel
def flip_side(mesh, f, i, j):
    """Flip side i of a face, which is side j of the face across: side x y of a x y and b y x becomes a b.

    The face becomes a x b and the one across a b y; the new side has the label 0.
    """
    g = mesh.neighbours[f, i]
    fy, fx, gx, gy = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3  # sides y a, a x, x b, b y
    a, x, y, b = mesh.faces[f, i], mesh.faces[f, fy], mesh.faces[f, fx], mesh.faces[g, j]
    across_ya, across_ax = mesh.neighbours[f, fy], mesh.neighbours[f, fx]
    across_xb, across_by = mesh.neighbours[g, gx], mesh.neighbours[g, gy]
    label_ya, label_ax = mesh.labels[f, fy], mesh.labels[f, fx]
    label_xb, label_by = mesh.labels[g, gx], mesh.labels[g, gy]
    write_face(mesh, f, (a, x, b), (across_xb, g, across_ax), (label_xb, 0, label_ax))
    write_face(mesh, g, (a, b, y), (across_by, across_ya, f), (label_by, label_ya, 0))
    replace_neighbour(mesh, across_xb, g, f)
    replace_neighbour(mesh, across_ya, f, g)


@kernel
def split_side(mesh, f, i, point, new_f, new_g):
    """Split side x y of a face a x y at a point: the face becomes a x point, and ``new_f`` a point y.

    The face b y x across becomes b point x, and ``new_g`` b y point; at the boundary ``new_g`` is not used. The halves
    of the side have its label, the two new sides the label 0.
    """
    g = mesh.neighbours[f, i]
    if g < 0:
        new_g = -1
    fy, fx = (i + 1) % 3, (i + 2) % 3
    a, x, y = mesh.faces[f, i], mesh.faces[f, fy], mesh.faces[f, fx]
    label = mesh.labels[f, i]
    across, label_across = mesh.neighbours[f, fy], mesh.labels[f, fy]
    write_face(mesh, new_f, (a, point, y), (new_g, across, f), (label, label_across, 0))
    write_face(mesh, f, (a, x, point), (g, new_f, mesh.neighbours[f, fx]), (label, 0, mesh.labels[f, fx]))
    replace_neighbour(mesh, across, f, new_f)
    if g < 0:
        return
    j = side_towards(mesh, g, f)
    gx, gy = (j + 1) % 3, (j + 2) % 3
    b = mesh.faces[g, j]
    across, label_across = mesh.neighbours[g, gy], mesh.labels[g, gy]
    write_face(mesh, new_g, (b, y, point), (new_f, g, across), (label, 0, label_across))
    write_face(mesh, g, (b, point, x), (f, mesh.neighbours[g, gx], new_g), (label, mesh.labels[g, gx], 0))
    replace_neighbour(mesh, across, g, new_g)


@kernel
def _glue(mesh, face, across, end, other_end, label):
    """Set what is across a side of a face, given by its ends, and its label; face -1 is none."""
    if face >= 0:
        side = 3 - corner_of(mesh, face, end) - corner_of(mesh, face, other_end)
        mesh.neighbours[face, side] = across
        mesh.labels[face, side] = label


@kernel
def join_across(mesh, face, point, other):
    """Remove a face at the collapsing edge: what is across its two other sides become neighbours."""
    i, j = corner_of(mesh, face, point), corner_of(mesh, face, other)
    inner, outer = mesh.neighbours[face, j], mesh.neighbours[face, i]
    label = max(mesh.labels[face, i], mesh.labels[face, j])
    third = mesh.faces[face, 3 - i - j]
    _glue(mesh, inner, outer, third, point, label)
    _glue(mesh, outer, inner, third, other, label)
    mesh.faces[face, 0] = -1
