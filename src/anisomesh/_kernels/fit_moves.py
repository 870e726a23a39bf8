"""Moves of points and flips of edges that lower error and quality of a fitted mesh together."""

from math import sqrt

from .compiled import kernel
from .fit_patch import (
    fit_system,
    follows_samples,
    gather_members,
    off_samples,
    patch_error,
    quality,
    relist,
    remember_normal,
    set_point,
    set_triangle,
    shape_loss,
    triangle_corners,
    unit_normal,
)
from .triangulation import corner_of, faces_around, flip_side, has_edge, side_towards
from .vectors import coordinates, dot, length, mapped, solve_symmetric, subtract, subtract_share

_PULLS = (1e-12, 1e-3, 0.03, 0.3)  # weight of the pull towards good shapes, over the trace of the fit's matrix
_N_SLIDING = 2  # first ones of these, with which a point stays on its crease
_MIN_MOVE_COSINE = 0.5  # between normals before and after a move
_MIN_FLIP_COSINE = 0.1  # between normals of triangles after a flip and the mean before
_MAX_FOLD_COSINE = -0.2  # between the normals of the two triangles after a flip
_MAX_STEP = 0.7  # mean edge lengths at the point
_MIN_GAIN = 1e-6  # of the energy of the patch, by which a later place has to be better than an earlier one
_MIN_ACTIVE_GAIN = 1e-2  # of the energy of the patch, from which on a point and its neighbours are looked at again
_MAX_COLOURS = 60  # bits that tell the colours of neighbours; a point with more neighbours stays
_MIN_QUALITY = 0.05  # of a triangle after a move, unless there was a worse one


@kernel
def _shape_target(fit, n, point):
    """Return the mean of the places of the point at which each of the n triangles around it is equilateral."""
    x = y = z = 0.0
    count = 0
    place = coordinates(fit.mesh.points, point)
    for k in range(n):
        root = fit.roots[fit.patch.faces[k]]
        _, a, b = triangle_corners(fit, k)
        middle = subtract_share(a, -0.5, subtract(b, a))
        side, upright = mapped(root, subtract(b, a)), mapped(root, subtract(place, middle))
        square = dot(side, side)
        if not square > 0.0:
            continue
        upright = subtract_share(upright, dot(upright, side) / square, side)
        height = length(upright)
        if not height > 0.0:
            continue
        factor = 0.5 * sqrt(3.0 * square) / height
        offset = solve_symmetric(
            (root[0, 0], root[0, 1], root[0, 2], root[1, 1], root[1, 2], root[2, 2]),
            0.0,
            (factor * upright[0], factor * upright[1], factor * upright[2]),
        )
        x, y, z = x + middle[0] + offset[0], y + middle[1] + offset[1], z + middle[2] + offset[2]
        count += 1
    if count == 0:
        return place
    return x / count, y / count, z / count


@kernel
def _move(fit, point, price, max_square):
    """Move a point to the best of some places, and return whether it has moved."""
    mesh, patch = fit.mesh, fit.patch
    face = fit.face_at[point]
    n, closed = faces_around(mesh, face, corner_of(mesh, face, point), patch.faces, patch.corners)
    if not closed or n < 3:
        return False
    m = gather_members(fit, n)
    if m <= 0:
        return False
    start = coordinates(mesh.points, point)
    reach = 0.0
    for k in range(n):
        face, corner = patch.faces[k], patch.corners[k]
        set_triangle(fit, k, point, mesh.faces[face, (corner + 1) % 3], mesh.faces[face, (corner + 2) % 3])
        remember_normal(fit, k)
        reach += length(subtract(coordinates(mesh.points, patch.triangles[k, 1]), start)) / n
    error = patch_error(fit, n, m, patch.owners, float("inf"))
    loss, lowest = shape_loss(fit, n)
    before = error + price * loss
    matrix, right = fit_system(fit, m, patch.owners, point)
    trace = matrix[0] + matrix[3] + matrix[5]
    if not trace > 0.0:
        return False
    target = subtract(_shape_target(fit, n, point), start)
    best, best_place = before, start
    for candidate in range(_N_SLIDING if fit.freedom[point] == 1 else len(_PULLS)):
        pull = _PULLS[candidate] * trace
        pulled = subtract_share(right, -pull, target)
        step = solve_symmetric(matrix, pull, pulled)
        if not length(step) <= _MAX_STEP * reach:
            continue
        place = (start[0] + step[0], start[1] + step[1], start[2] + step[2])
        if off_samples(fit, m, place, start, max_square):
            continue
        set_point(fit, point, place)
        loss, low = shape_loss(fit, n)
        bound = best - _MIN_GAIN * before
        if price * loss < bound and low >= min(_MIN_QUALITY, lowest):
            error = patch_error(fit, n, m, patch.trial, bound - price * loss)
            if error + price * loss < bound and follows_samples(fit, n, m, patch.trial, _MIN_MOVE_COSINE):
                best, best_place = error + price * loss, place
        set_point(fit, point, start)
    moved = best < before
    if moved:
        set_point(fit, point, best_place)
        patch_error(fit, n, m, patch.owners, float("inf"))
        if best < (1.0 - _MIN_ACTIVE_GAIN) * before:
            for k in range(n):
                fit.active[patch.triangles[k, 1]] = 1
            fit.active[point] = 1
    relist(fit, n, m, patch.owners)
    return moved


@kernel
def colour_points(fit, colours):
    """Give each point to be moved a colour (V,) that no neighbour has, -1 to others; return the number of colours.

    Points of one colour have no face in common, so they can be moved in any order or at the same time.
    """
    mesh, patch, count = fit.mesh, fit.patch, 0
    for point in range(len(colours)):
        colours[point] = -1
    for point in range(len(colours)):
        face = fit.face_at[point]
        if not fit.active[point] or fit.freedom[point] == 0 or face < 0:
            continue
        n, _ = faces_around(mesh, face, corner_of(mesh, face, point), patch.faces, patch.corners)
        if n > _MAX_COLOURS:
            continue
        taken = 0
        for k in range(n):
            for turn in range(1, 3):
                colour = colours[mesh.faces[patch.faces[k], (patch.corners[k] + turn) % 3]]
                if colour >= 0:
                    taken |= 1 << colour
        colour = 0
        while taken & (1 << colour):
            colour += 1
        colours[point] = colour
        count = max(count, colour + 1)
    return count


@kernel
def move_points(fit, points, price, max_square):
    """Move each of some points (n,) to the place that lowers the energy most; return how many have moved.

    Parameters
    ----------
    fit
        Mesh and samples. Points that are not worth another look are inactive afterwards.
    points
        Points of one colour.
    price
        Energy of a triangle of quality 0.
    max_square
        Squared distance of a place from the surface, up to which it is allowed in any case.
    """
    count = 0
    for k in range(len(points)):
        fit.active[points[k]] = 0
        count += _move(fit, points[k], price, max_square)
    return count


@kernel
def _flip(fit, f, i, price):
    """Flip side i of a face if that lowers the energy, and return whether it was flipped."""
    mesh, patch = fit.mesh, fit.patch
    g = mesh.neighbours[f, i]
    if g < f or mesh.labels[f, i] != 0:
        return False
    j = side_towards(mesh, g, f)
    fy, fx = (i + 1) % 3, (i + 2) % 3
    if mesh.neighbours[f, fy] == g or mesh.neighbours[f, fx] == g:
        return False
    a, x, y, b = mesh.faces[f, i], mesh.faces[f, fy], mesh.faces[f, fx], mesh.faces[g, j]
    patch.faces[0], patch.faces[1] = f, g
    set_triangle(fit, 0, a, x, y)
    set_triangle(fit, 1, b, y, x)
    first, second = remember_normal(fit, 0), remember_normal(fit, 1)
    loss, _ = shape_loss(fit, 2)
    for k in range(3):
        mean = first * patch.before[0, k] + second * patch.before[1, k]
        patch.before[0, k] = patch.before[1, k] = mean
    pa, px = coordinates(mesh.points, a), coordinates(mesh.points, x)
    py, pb = coordinates(mesh.points, y), coordinates(mesh.points, b)
    cosine = dot(unit_normal(pa, px, pb)[0], unit_normal(pa, pb, py)[0])
    if cosine < _MAX_FOLD_COSINE:
        return False
    new_loss = 2.0
    for k in range(2):
        root = fit.roots[patch.faces[k]]
        new_loss -= 0.5 * (quality(root, pa, px, pb) + quality(root, pa, pb, py))
    m = gather_members(fit, 2)
    if m < 0:
        return False
    energy = patch_error(fit, 2, m, patch.owners, float("inf")) + price * loss
    bound = energy * (1.0 - _MIN_GAIN) - price * new_loss
    if not bound > 0.0 or has_edge(mesh, f, i, b):
        return False
    set_triangle(fit, 0, a, x, b)
    set_triangle(fit, 1, a, b, y)
    if not patch_error(fit, 2, m, patch.trial, bound) < bound:
        return False
    if not follows_samples(fit, 2, m, patch.trial, _MIN_FLIP_COSINE):
        return False
    flip_side(mesh, f, i, j)
    for row in range(3):
        for column in range(3):
            mean = 0.5 * (fit.roots[f, row, column] + fit.roots[g, row, column])
            fit.roots[f, row, column] = fit.roots[g, row, column] = mean
    fit.face_at[a] = fit.face_at[x] = fit.face_at[b] = f
    fit.face_at[y] = g
    fit.active[a] = fit.active[b] = fit.active[x] = fit.active[y] = 1
    relist(fit, 2, m, patch.trial)
    return True


@kernel
def flip_edges(fit, price):
    """Flip edges of faces with an active point, once, where that lowers the energy; return how many were flipped."""
    count, faces = 0, fit.mesh.faces
    for face in range(len(fit.roots)):
        if faces[face, 0] < 0:
            continue
        for side in range(3):
            if fit.active[faces[face, 0]] or fit.active[faces[face, 1]] or fit.active[faces[face, 2]]:
                count += _flip(fit, face, side, price)
    return count
