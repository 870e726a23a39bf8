"""Quadric decimation: edges are collapsed, the cheapest first, until as many points are gone as wanted."""

from typing import Any, NamedTuple

from .compiled import kernel
from .heap import pop, push
from .quadrics import add_plane, quadric_step, quadric_trace, quadric_value
from .stars import keeps_topology
from .triangulation import corner_of, faces_around, join_across
from .vectors import coordinates, cross, dot, length, squared_length, subtract, subtract_share

_PULL = 1e-6  # towards the middle of an edge, where the planes leave the place open
_MAX_STEP = 1.0  # edge lengths from the middle of an edge to the place of its point
_WALL_WEIGHT = 3.0  # of an edge of the boundary or a crease, in squared lengths; heuristic


class ShapeLimits(NamedTuple):
    """What a collapse may do to a triangle.

    Attributes
    ----------
    cosine
        Least cosine between its normals before and after.
    thickness
        Least area over squared longest side, unless there was a thinner triangle.
    """

    cosine: float
    thickness: float


class Decimation(NamedTuple):
    """A mesh that is decimated.

    Attributes
    ----------
    mesh
        The mesh; sides of another label than 0 form creases. Faces that are gone have -1 as their first corner.
    quadrics
        A quadric for each point, and a last row for workspace (V + 1, 10).
    held
        1 for points that stay (V,).
    on_line
        1 for points of the boundary and of creases (V,), which only go along these, to other points there.
    moves
        Whether other points go to where their quadrics are lowest, and not to one of two.
    evenness
        Weight of squared lengths beside squared distances: short edges go first.
    limits
        What a collapse may do to triangles.
    face_at
        One of the faces at each point (V,).
    origin
        The point (V,) at whose place each one was at the start; without moves it is there now.
    changed
        The number of collapses after which each point was changed last (V,); -1 if it is gone.
    heap
        Heap of edges, made at the number of collapses before.
    stars
        Workspace.
    """

    mesh: Any
    quadrics: Any
    held: Any
    on_line: Any
    moves: Any
    evenness: Any
    limits: Any
    face_at: Any
    origin: Any
    changed: Any
    heap: Any
    stars: Any


@kernel
def _push(state, size, p, q, now):
    """Enter the edge p q into the heap, and return the new size."""
    if state.held[p] and state.held[q]:
        return size
    return push(state.heap, size, place_between(state, p, q)[0], p, q, now)


@kernel
def place_between(state, p, q):
    """Return the cost of the collapse of the edge p q, and the place of its point."""
    points, quadrics = state.mesh.points, state.quadrics
    total = quadrics[len(quadrics) - 1]
    for k in range(10):
        total[k] = quadrics[p, k] + quadrics[q, k]
    start, end = coordinates(points, p), coordinates(points, q)
    along = subtract(end, start)
    even = state.evenness * quadric_trace(total) * squared_length(along)
    if state.held[p] or (state.on_line[p] and not state.on_line[q]):
        return quadric_value(total, start) + even, start
    if state.held[q] or (state.on_line[q] and not state.on_line[p]):
        return quadric_value(total, end) + even, end
    best_place, best = start, float("inf")
    if state.moves and not state.on_line[p]:
        middle = subtract_share(start, -0.5, along)
        step = quadric_step(total, middle, _PULL)
        best_place, best = middle, quadric_value(total, middle)
        if squared_length(step) <= _MAX_STEP * _MAX_STEP * squared_length(along):
            best_place = subtract_share(middle, -1.0, step)
            best = quadric_value(total, best_place)
    for k in range(2):
        place = start if k == 0 else end
        value = quadric_value(total, place)
        if value < best:
            best, best_place = value, place
    return max(best, 0.0) + even, best_place


@kernel
def _thickness(a, b, c):
    """Return the normal of a triangle scaled by twice its area, and its area over its squared longest side."""
    u, v = subtract(b, a), subtract(c, a)
    normal = cross(u, v)
    longest = max(squared_length(u), squared_length(v), squared_length(subtract(v, u)))
    if not longest > 0.0:
        return normal, 0.0
    return normal, 0.5 * length(normal) / longest


@kernel
def _keeps_shapes(state, faces, corners, n, other, place):
    """Return whether no triangle around a point, without the other one, turns or gets thin if it goes to a place."""
    mesh = state.mesh
    point = coordinates(mesh.points, mesh.faces[faces[0], corners[0]])
    for k in range(n):
        first, second = mesh.faces[faces[k], (corners[k] + 1) % 3], mesh.faces[faces[k], (corners[k] + 2) % 3]
        if first == other or second == other:
            continue
        a, b = coordinates(mesh.points, first), coordinates(mesh.points, second)
        old, thin = _thickness(point, a, b)
        new, thickness = _thickness(place, a, b)
        if not thickness >= min(thin, state.limits.thickness):
            return False
        if not dot(old, new) >= state.limits.cosine * length(old) * length(new) or not thickness > 0.0:
            return False
    return True


@kernel
def _joined_by_line(state, n, into):
    """Return whether the side between two points is one of the boundary or of a crease; the faces are in the stars."""
    mesh, stars = state.mesh, state.stars
    for k in range(n):
        face = stars.faces[k]
        for turn in range(1, 3):
            side = (stars.corners[k] + 3 - turn) % 3
            on_line = mesh.labels[face, side] != 0 or mesh.neighbours[face, side] < 0
            if on_line and mesh.faces[face, (stars.corners[k] + turn) % 3] == into:
                return True
    return False


@kernel
def _keeps_lines(state, n, into):
    """Return whether no two creases become one: none of the faces that go has creases on both its other sides."""
    mesh, stars = state.mesh, state.stars
    for k in range(n):
        face, corner = stars.faces[k], stars.corners[k]
        for turn in range(1, 3):
            other = (corner + turn) % 3
            if mesh.faces[face, other] == into and mesh.labels[face, corner] != 0 and mesh.labels[face, other] != 0:
                return False
    return True


@kernel
def _may_collapse(state, gone, n, closed, into):
    """Return the number of faces around the point that another one may go to, or -1; its own are in the stars."""
    mesh, stars = state.mesh, state.stars
    face = state.face_at[into]
    n_into, closed_into = faces_around(mesh, face, corner_of(mesh, face, into), stars.other_faces, stars.other_corners)
    if n < 0 or n_into < 0 or not keeps_topology(mesh, stars, n, closed, n_into, closed_into):
        return -1
    if state.on_line[gone] and not _joined_by_line(state, n, into):
        return -1
    return n_into if _keeps_lines(state, n, into) else -1


@kernel
def collapse(state, p, q):
    """Collapse the edge p q if that is allowed, and return the point that is left, or -1."""
    mesh, stars = state.mesh, state.stars
    gone, into = (q, p) if state.held[p] or (state.on_line[p] and not state.on_line[q]) else (p, q)
    if state.held[gone]:
        return -1
    face = state.face_at[gone]
    n_gone, closed = faces_around(mesh, face, corner_of(mesh, face, gone), stars.faces, stars.corners)
    n_into = _may_collapse(state, gone, n_gone, closed, into)
    if n_into < 0:
        return -1
    place = place_between(state, p, q)[1]
    if not _keeps_shapes(state, stars.faces, stars.corners, n_gone, into, place):
        return -1
    if not _keeps_shapes(state, stars.other_faces, stars.other_corners, n_into, gone, place):
        return -1
    for k in range(n_gone):
        face, corner = stars.faces[k], stars.corners[k]
        if mesh.faces[face, (corner + 1) % 3] == into or mesh.faces[face, (corner + 2) % 3] == into:
            join_across(mesh, face, gone, into)
    for k in range(n_gone):
        if mesh.faces[stars.faces[k], 0] >= 0:
            mesh.faces[stars.faces[k], stars.corners[k]] = into
            _note_face(state, stars.faces[k])
    for k in range(n_into):
        if mesh.faces[stars.other_faces[k], 0] >= 0:
            _note_face(state, stars.other_faces[k])
    for k in range(10):
        state.quadrics[into, k] += state.quadrics[gone, k]
    if place == coordinates(mesh.points, gone):
        state.origin[into] = state.origin[gone]
    mesh.points[into, 0], mesh.points[into, 1], mesh.points[into, 2] = place
    state.changed[gone] = -1
    return into


@kernel
def _note_face(state, face):
    """Note a face as one at its corners."""
    for corner in range(3):
        state.face_at[state.mesh.faces[face, corner]] = face


@kernel
def set_quadrics(state):
    """Set the quadric of each point: planes of its faces, weighted by area, and walls on boundary and creases."""
    mesh, quadrics = state.mesh, state.quadrics
    for face in range(len(mesh.faces)):
        for corner in range(3):
            p = mesh.faces[face, corner]
            q, r = mesh.faces[face, (corner + 1) % 3], mesh.faces[face, (corner + 2) % 3]
            start, end = coordinates(mesh.points, q), coordinates(mesh.points, r)
            apex = coordinates(mesh.points, p)
            normal = cross(subtract(start, apex), subtract(end, apex))
            size = length(normal)
            if not size > 0.0:
                continue
            unit = normal[0] / size, normal[1] / size, normal[2] / size
            add_plane(quadrics[p], 0.5 * size, unit, apex)
            if mesh.neighbours[face, corner] < 0 or mesh.labels[face, corner] != 0:
                along = subtract(end, start)
                across = cross(unit, along)
                reach = length(across)
                wall = across[0] / reach, across[1] / reach, across[2] / reach
                weight = _WALL_WEIGHT * squared_length(along)
                add_plane(quadrics[q], weight, wall, start)
                add_plane(quadrics[r], weight, wall, start)


@kernel
def _push_all(state, now):
    """Enter all edges into the empty heap, and return its size."""
    mesh, size = state.mesh, 0
    for face in range(len(mesh.faces)):
        for side in range(3):
            if mesh.faces[face, 0] >= 0 and face > mesh.neighbours[face, side]:
                size = _push(state, size, mesh.faces[face, (side + 1) % 3], mesh.faces[face, (side + 2) % 3], now)
    return size


@kernel
def _push_around(state, size, point, now):
    """Enter the edges at a point into a heap of this size, and return the size."""
    mesh, faces, corners = state.mesh, state.stars.faces, state.stars.corners
    face = state.face_at[point]
    n, closed = faces_around(mesh, face, corner_of(mesh, face, point), faces, corners)
    for k in range(n):
        size = _push(state, size, point, mesh.faces[faces[k], (corners[k] + 1) % 3], now)
    if n > 0 and not closed:
        size = _push(state, size, point, mesh.faces[faces[n - 1], (corners[n - 1] + 2) % 3], now)
    return size


@kernel
def decimate(state, wanted):
    """Collapse the cheapest edges until as many points are gone as wanted, and return how many are.

    An edge that was refused is looked at again when one of its ends has changed, or all others have been looked at.
    """
    count, progress = 0, True
    while progress and count < wanted:
        progress, size = False, _push_all(state, count)
        while size > 0 and count < wanted:
            size = pop(state.heap, size)
            p, q, made = state.heap.ends[size, 0], state.heap.ends[size, 1], state.heap.made[size]
            if min(state.changed[p], state.changed[q]) < 0 or made < max(state.changed[p], state.changed[q]):
                continue
            point = collapse(state, p, q)
            if point < 0:
                continue
            progress, count = True, count + 1
            state.changed[point] = count
            size = _push_around(state, size, point, count)
    return count
