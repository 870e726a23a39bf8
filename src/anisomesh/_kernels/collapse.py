"""Collapses of short edges within a tolerance; points only go to points that are there, and creases stay."""

from .compiled import kernel
from .stars import keeps_topology
from .triangulation import faces_around, join_across
from .vectors import coordinates, cross, dot, length, square_to_triangle, squared_length, subtract, subtract_share

_MIN_NORMAL_COSINE = 0.97  # between the normals of a triangle before and after a collapse; heuristic
_MIN_CREASE_COSINE = 0.7  # of the turn of a crease at a point that goes; sharper ones are corners
_SLIVER_THICKNESS = 0.125  # area over squared longest side, below which a triangle is a sliver; heuristic
_MIN_THICKNESS = 0.05  # area over squared longest side of a new triangle, unless there was a thinner one; heuristic


@kernel
def _crease_end(mesh, stars, n, closed, last):
    """Return where the crease goes on beyond the point that goes: -1 if there is none, -2 if the point has to stay."""
    first_face, first_corner = stars.faces[0], stars.corners[0]
    last_face, last_corner = stars.faces[n - 1], stars.corners[n - 1]
    if not closed:
        for k in range(1, n):
            if mesh.labels[stars.faces[k], (stars.corners[k] + 2) % 3] != 0:
                return -2
        if mesh.labels[first_face, (first_corner + 2) % 3] != mesh.labels[last_face, (last_corner + 1) % 3]:
            return -2
        if last:
            return mesh.faces[first_face, (first_corner + 1) % 3]
        return mesh.faces[last_face, (last_corner + 2) % 3]
    label = mesh.labels[first_face, (first_corner + 2) % 3]
    end, count = -1, 0
    for k in range(1, n):
        here = mesh.labels[stars.faces[k], (stars.corners[k] + 2) % 3]
        if here == 0:
            continue
        count += 1
        if here != label:
            return -2
        end = mesh.faces[stars.faces[k], (stars.corners[k] + 1) % 3]
    if count == 0 and label == 0:
        return -1
    return end if count == 1 and label != 0 else -2


@kernel
def _crease_deviation(mesh, point, other, end):
    """Return the distance of a point of a crease to the crease without it; infinite if it is a corner."""
    p, q, r = coordinates(mesh.points, point), coordinates(mesh.points, other), coordinates(mesh.points, end)
    there, onward, chord = subtract(p, q), subtract(r, p), subtract(r, q)
    if not dot(there, onward) >= _MIN_CREASE_COSINE * length(there) * length(onward):
        return float("inf")
    return length(cross(there, chord)) / length(chord)


@kernel
def _deviation(mesh, stars, first, end, n, other):
    """Return how far the surface moves if faces get another corner, or infinity if one turns or gets too thin.

    The largest of the distance of the point that goes to the new faces, and of the middles of new edges to the old
    ones.
    """
    points = mesh.points
    infinite = float("inf")
    goes = coordinates(points, mesh.faces[stars.faces[0], stars.corners[0]])
    q = coordinates(points, other)
    thinnest, thinnest_new, nearest, farthest = infinite, infinite, infinite, 0.0
    for k in range(n):
        face, corner = stars.faces[k], stars.corners[k]
        a = coordinates(points, mesh.faces[face, (corner + 1) % 3])
        b = coordinates(points, mesh.faces[face, (corner + 2) % 3])
        side, old = subtract(b, a), cross(subtract(a, goes), subtract(b, goes))
        longest = max(squared_length(side), squared_length(subtract(a, goes)), squared_length(subtract(b, goes)))
        thinnest = min(thinnest, length(old) / longest)
        if k < first or k >= end:
            continue
        new = cross(subtract(a, q), subtract(b, q))
        longest = max(squared_length(side), squared_length(subtract(a, q)), squared_length(subtract(b, q)))
        thinnest_new = min(thinnest_new, length(new) / longest)
        if not dot(old, new) > _MIN_NORMAL_COSINE * length(old) * length(new):
            return infinite
        nearest = min(nearest, square_to_triangle(goes, q, a, b))
        if k == first:
            continue
        middle = subtract_share(q, -0.5, subtract(a, q))
        square = infinite
        for m in range(n):
            old_face, old_corner = stars.faces[m], stars.corners[m]
            u = coordinates(points, mesh.faces[old_face, (old_corner + 1) % 3])
            v = coordinates(points, mesh.faces[old_face, (old_corner + 2) % 3])
            square = min(square, square_to_triangle(middle, goes, u, v))
        farthest = max(farthest, square)
    if not thinnest_new >= min(thinnest, 2.0 * _MIN_THICKNESS):
        return infinite
    return max(nearest, farthest) ** 0.5


@kernel
def _collapse(mesh, stars, face, corner, last, tolerance):
    """Move a corner of a face to the next one, or to the one before if ``last``, and return whether that was done."""
    point = mesh.faces[face, corner]
    target = (corner + (2 if last else 1)) % 3
    other = mesh.faces[face, target]
    n, closed = faces_around(mesh, face, corner, stars.faces, stars.corners)
    if n < 0 or (not closed and (mesh.neighbours[face, (corner + (1 if last else 2)) % 3] >= 0)):
        return False
    end = _crease_end(mesh, stars, n, closed, last)
    if end == -2:
        return False
    n_other, closed_other = faces_around(mesh, face, target, stars.other_faces, stars.other_corners)
    if n_other < 0 or n == 1 or not keeps_topology(mesh, stars, n, closed, n_other, closed_other):
        return False
    first = 0 if last else 1
    limit = n - 1 if last or closed else n
    moved = _deviation(mesh, stars, first, limit, n, other)
    if end >= 0:
        moved = max(moved, _crease_deviation(mesh, point, other, end))
    before = 0.0
    for k in range(n):
        before = max(before, mesh.deviation[stars.faces[k]])
    if not before + moved <= tolerance:
        return False
    if first == 1:
        join_across(mesh, stars.faces[0], point, other)
    if limit == n - 1:
        join_across(mesh, stars.faces[n - 1], point, other)
    for k in range(first, limit):
        mesh.faces[stars.faces[k], stars.corners[k]] = other
        mesh.deviation[stars.faces[k]] = before + moved
    return True


@kernel
def collapse_short_edges(mesh, stars, first_movable, max_square, sliver_square, tolerance):
    """Collapse edges of no larger square once over all faces, as far as the surface moves within the tolerance.

    Faces that go have -1 as their first corner.

    Parameters
    ----------
    mesh
        The triangulation; its deviations grow with every collapse.
    stars
        Workspace.
    first_movable
        Points before this one stay.
    max_square, sliver_square
        Largest squared length, and the same for the edges of slivers.
    tolerance
        Largest deviation.

    Returns
    -------
    int
        Number of collapses.
    """
    count = 0
    for face in range(len(mesh.faces)):
        corner = 0
        while corner < 3 and mesh.faces[face, 0] >= 0:
            if mesh.faces[face, corner] < first_movable:
                corner += 1
                continue
            after, before = (corner + 1) % 3, (corner + 2) % 3
            p = coordinates(mesh.points, mesh.faces[face, corner])
            to_after = subtract(coordinates(mesh.points, mesh.faces[face, after]), p)
            to_before = subtract(coordinates(mesh.points, mesh.faces[face, before]), p)
            longest = max(
                squared_length(to_after), squared_length(to_before), squared_length(subtract(to_after, to_before))
            )
            is_sliver = length(cross(to_after, to_before)) < 2.0 * _SLIVER_THICKNESS * longest
            limit = sliver_square if is_sliver else max_square
            done = False
            if squared_length(to_after) <= limit:
                done = _collapse(mesh, stars, face, corner, False, tolerance)
            if not done and mesh.neighbours[face, after] < 0 and squared_length(to_before) <= limit:
                done = _collapse(mesh, stars, face, corner, True, tolerance)
            count += done
            corner = 0 if done else corner + 1
    return count
