"""Delaunay refinement of a triangle mesh: flips of edges within a tolerance, and splits of longest edges.

The arrays of the :class:`~anisomesh._kernels.triangulation.Triangulation` have room for the faces and points that are
added at their ends.
"""

from .compiled import kernel
from .triangulation import difference, flip_side, has_edge, side_towards, split_side
from .vectors import cross, dot, length

_MIN_NORMAL_COSINE = 0.8  # between the normal of a new triangle and the area vector of the two; heuristic
_DELAUNAY_MARGIN = 1e-9  # sine of the sum of the opposite angles that counts as zero, above rounding
_LONGER = 1.0 + 1e-9  # ratio of squared lengths from which a side is longer: of equal sides, the path ends at the first


@kernel
def _area(mesh, face):
    """Return the area of a face."""
    a, b, c = mesh.faces[face, 0], mesh.faces[face, 1], mesh.faces[face, 2]
    return 0.5 * length(cross(difference(mesh.points, b, a), difference(mesh.points, c, a)))


@kernel
def _longest_side(mesh, face):
    """Return the longest side of a face, the first of equal ones, and its squared length."""
    longest = -1.0
    side = 0
    for i in range(3):
        along = difference(mesh.points, mesh.faces[face, (i + 2) % 3], mesh.faces[face, (i + 1) % 3])
        square = dot(along, along)
        if square > longest:
            longest = square
            side = i
    return side, longest


@kernel
def _flip_if_better(mesh, f, i, tolerance):
    """Flip side i of a face if that makes it Delaunay, and return whether it was flipped.

    Side x y of the triangles a x y and b y x becomes a b, if the angles at a and b add up to more than two right
    angles, the deviation stays within the tolerance, no triangle turns far, and a b is not an edge yet. A flip moves
    the surface by at most the distance between the lines a b and x y.
    """
    g = mesh.neighbours[f, i]
    if g < 0 or mesh.labels[f, i] != 0:
        return False
    j = side_towards(mesh, g, f)
    fy, fx = (i + 1) % 3, (i + 2) % 3  # sides y a, a x
    if mesh.neighbours[f, fy] == g or mesh.neighbours[f, fx] == g:
        return False  # a has two faces only
    a, x, y, b = mesh.faces[f, i], mesh.faces[f, fy], mesh.faces[f, fx], mesh.faces[g, j]
    points = mesh.points
    ax, ay = difference(points, x, a), difference(points, y, a)
    bx, by = difference(points, x, b), difference(points, y, b)
    area_f, area_g = cross(ax, ay), cross(by, bx)
    sine = length(area_f) * dot(bx, by) + length(area_g) * dot(ax, ay)
    if sine >= -_DELAUNAY_MARGIN * length(ax) * length(ay) * length(bx) * length(by):
        return False
    ab = difference(points, b, a)
    across = cross(ab, difference(points, y, x))
    if length(across) == 0.0:
        return False
    deviation = max(mesh.deviation[f], mesh.deviation[g]) + abs(dot(ax, across)) / length(across)
    if deviation > tolerance:
        return False
    whole = (area_f[0] + area_g[0], area_f[1] + area_g[1], area_f[2] + area_g[2])
    new_f, new_g = cross(ax, ab), cross(ab, ay)
    least = _MIN_NORMAL_COSINE * length(whole)
    if dot(new_f, whole) <= least * length(new_f) or dot(new_g, whole) <= least * length(new_g):
        return False
    if has_edge(mesh, f, i, b):
        return False
    flip_side(mesh, f, i, j)
    mesh.deviation[f] = deviation
    mesh.deviation[g] = deviation
    return True


@kernel
def flip_to_delaunay(mesh, n_stacked, tolerance):
    """Flip sides of the first ``n_stacked`` faces on the stack, and of the faces that change, until none is better.

    In a plane that ends, as every flip raises the least angle of the two triangles; elsewhere the deviation grows with
    every flip, up to the tolerance. If the stack is full, sides may stay that are not Delaunay.
    """
    while n_stacked > 0:
        n_stacked -= 1
        face = mesh.stack[n_stacked]
        side = 0
        while side < 3:
            other = mesh.neighbours[face, side]
            if not _flip_if_better(mesh, face, side, tolerance):
                side += 1
                continue
            side = 0
            if n_stacked < len(mesh.stack):
                mesh.stack[n_stacked] = other
                n_stacked += 1


@kernel
def _split_side(mesh, n_points, n_faces, f, i):
    """Split side i of a face at its middle, which becomes point ``n_points``; return the new number of faces."""
    g = mesh.neighbours[f, i]
    x, y = mesh.faces[f, (i + 1) % 3], mesh.faces[f, (i + 2) % 3]
    for k in range(3):
        mesh.points[n_points, k] = 0.5 * (mesh.points[x, k] + mesh.points[y, k])
    mesh.parents[n_points, 0] = x
    mesh.parents[n_points, 1] = y
    split_side(mesh, f, i, n_points, n_faces, n_faces + 1)
    mesh.deviation[n_faces] = mesh.deviation[f]
    if g < 0:
        return n_faces + 1
    mesh.deviation[n_faces + 1] = mesh.deviation[g]
    return n_faces + 2


@kernel
def refine(mesh, n_points, n_faces, min_thickness, min_square, tolerance):
    """Split longest sides until no face thinner than the bound, area over squared side, has one of a higher square.

    From a thin face a path leads across longest sides to a side that is the longest one of both its faces (Rivara);
    that one is split, and the faces around it are made Delaunay.

    Returns
    -------
    tuple
        Numbers of points and faces; fewer than two free rows of faces or none of points end the refinement early.
    """
    face = 0
    passed = 0  # faces in a row that need no split, up to the present one
    while passed < n_faces and n_faces + 2 <= len(mesh.faces) and n_points < len(mesh.points):
        face %= n_faces
        side, square = _longest_side(mesh, face)
        if square <= min_square or _area(mesh, face) >= min_thickness * square:
            face += 1
            passed += 1
            continue
        passed = 0
        last = face
        while mesh.neighbours[last, side] >= 0:
            other_side, other_square = _longest_side(mesh, mesh.neighbours[last, side])
            if other_square <= _LONGER * square:
                break
            last = mesh.neighbours[last, side]
            side, square = other_side, other_square
        other = mesh.neighbours[last, side]
        first = n_faces
        n_faces = _split_side(mesh, n_points, n_faces, last, side)
        n_points += 1
        mesh.stack[0] = last
        n_stacked = 1
        for added in range(first, n_faces):
            mesh.stack[n_stacked] = added
            n_stacked += 1
        if other >= 0:
            mesh.stack[n_stacked] = other
            n_stacked += 1
        flip_to_delaunay(mesh, n_stacked, tolerance)
    return n_points, n_faces
