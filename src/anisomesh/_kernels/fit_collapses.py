"""Collapses of edges of a fitted mesh, and what they change its energy by."""

from .compiled import kernel
from .fit_patch import (
    fitted_place,
    follows_samples,
    gather_members,
    off_samples,
    patch_error,
    relist,
    remember_normal,
    set_point,
    set_triangle,
    shape_loss,
)
from .fit_splits import MAX_STEP, MIN_COSINE, MIN_QUALITY, REFUSED
from .quadrics import quadric_value
from .stars import keeps_topology
from .triangulation import faces_around, join_across
from .vectors import coordinates, length, subtract, subtract_share


@kernel
def _count_marked_sides(mesh, stars, n):
    """Return how many of the n sides that end at the point that goes have a label."""
    count = 0
    for k in range(n):
        count += mesh.labels[stars.faces[k], (stars.corners[k] + 1) % 3] != 0
    return count


@kernel
def _collapse_patch(fit, f, i):
    """Write the triangles around side i of a face, and return their number but for the two that a collapse removes.

    Also returned are the number of triangles that get another corner, which come first, the point that goes, and the
    one that it goes into. The first number is 0 if the edge may not be collapsed. The two triangles come last.
    """
    mesh, patch = fit.mesh, fit.patch
    at_into, at_gone = (i + 1) % 3, (i + 2) % 3
    if _first_goes(fit, f, i):
        at_into, at_gone = at_gone, at_into
    into, gone = mesh.faces[f, at_into], mesh.faces[f, at_gone]
    if fit.freedom[gone] == 0:
        return 0, 0, gone, into
    n_gone, closed = faces_around(mesh, f, at_gone, patch.faces, patch.corners)
    n_into, closed_into = faces_around(mesh, f, at_into, patch.other_faces, patch.other_corners)
    if not closed or n_into < 0 or n_gone < 3 or n_gone + n_into > len(patch.faces):
        return 0, 0, gone, into
    if _count_marked_sides(mesh, patch, n_gone) or not keeps_topology(mesh, patch, n_gone, closed, n_into, closed_into):
        return 0, 0, gone, into
    n, g = 0, mesh.neighbours[f, i]
    for k in range(n_gone):
        if patch.faces[k] != f and patch.faces[k] != g:
            patch.faces[n] = patch.faces[k]
            n += 1
    n_changed = n
    for k in range(n_into):
        if patch.other_faces[k] != f and patch.other_faces[k] != g:
            patch.faces[n] = patch.other_faces[k]
            n += 1
    patch.faces[n], patch.faces[n + 1] = f, g
    for k in range(n + 2):
        face = patch.faces[k]
        set_triangle(fit, k, mesh.faces[face, 0], mesh.faces[face, 1], mesh.faces[face, 2])
    return n, n_changed, gone, into


@kernel
def _replace_corners(fit, n, gone, into):
    """Put one point in the place of another in the first n triangles of the patch."""
    for k in range(n):
        for corner in range(3):
            if fit.patch.triangles[k, corner] == gone:
                fit.patch.triangles[k, corner] = into


@kernel
def _collapse(fit, f, i, price, max_square, limit):
    """Return what a collapse of side i of a face changes the energy by, if that is below a limit.

    The triangles after the collapse and their samples stay in the workspace, and the best place of the point in
    ``fit.place``; the second number is of triangles, the third of samples.
    """
    mesh, patch = fit.mesh, fit.patch
    n, n_changed, gone, into = _collapse_patch(fit, f, i)
    if n == 0:
        return REFUSED, 0, 0
    for k in range(n + 2):
        remember_normal(fit, k)
    m = gather_members(fit, n + 2)
    if m <= 0:
        return REFUSED, 0, 0
    before = patch_error(fit, n + 2, m, patch.owners, REFUSED) + price * shape_loss(fit, n + 2)[0]
    _replace_corners(fit, n_changed, gone, into)
    start, end = coordinates(mesh.points, into), coordinates(mesh.points, gone)
    middle = subtract_share(start, -0.5, subtract(end, start))
    best, best_place, found = before + limit, start, False
    same = fit.freedom[into] == fit.freedom[gone]
    for candidate in range(1 if fit.freedom[into] == 0 else 3):
        place = start
        if candidate == 1:
            place = middle if same else end
        elif candidate == 2:
            set_point(fit, into, best_place if found else middle)
            patch_error(fit, n, m, patch.trial, REFUSED)
            place = fitted_place(fit, m, patch.trial, into)
            set_point(fit, into, start)
            if not length(subtract(place, middle)) <= 2.0 * MAX_STEP * length(subtract(end, start)):
                continue
        if candidate > 0 and off_samples(fit, m, place, start, max_square):
            continue
        set_point(fit, into, place)
        loss, lowest = shape_loss(fit, n)
        if price * loss < best and lowest >= MIN_QUALITY:
            error = patch_error(fit, n, m, patch.trial, best - price * loss)
            if error + price * loss < best and follows_samples(fit, n, m, patch.trial, MIN_COSINE):
                best, best_place, found = error + price * loss, place, True
        set_point(fit, into, start)
    if not found:
        return REFUSED, 0, 0
    fit.place[0], fit.place[1], fit.place[2] = best_place
    return best - before, n, m


@kernel
def collapse_estimates(fit, price, quadrics, estimates, first, last):
    """Write about what a collapse of the sides of some faces changes the energy by (F, 3).

    A side of two faces is looked at in the lower one, and refused in the other. The error is estimated by the quadrics
    of the faces around the point that goes, at the point that it goes into.

    References
    ----------
    Garland, Heckbert, "Surface simplification using quadric error metrics", 1997.
    """
    mesh, patch = fit.mesh, fit.patch
    for face in range(first, last):
        for side in range(3):
            estimates[face, side] = REFUSED
            if mesh.faces[face, 0] < 0 or face > mesh.neighbours[face, side]:
                continue
            n, n_changed, gone, into = _collapse_patch(fit, face, side)
            if n == 0:
                continue
            change = -price * shape_loss(fit, n + 2)[0]
            place = coordinates(mesh.points, into)
            for k in range(n + 2):
                if k < n_changed or k >= n:
                    change += quadric_value(quadrics[patch.faces[k]], place)
            _replace_corners(fit, n_changed, gone, into)
            estimates[face, side] = change + price * shape_loss(fit, n)[0]


@kernel
def collapse_costs(fit, sides, price, max_square, costs):
    """Write what a collapse of some sides, 3 face + side (n,), changes the energy by (n,); faces may be gone.

    Points are moved meanwhile, and put back.
    """
    for k in range(len(sides)):
        f, i = sides[k] // 3, sides[k] % 3
        costs[k] = REFUSED
        if fit.mesh.faces[f, 0] >= 0 and fit.mesh.neighbours[f, i] >= 0:
            costs[k] = _collapse(fit, f, i, price, max_square, REFUSED)[0]


@kernel
def _first_goes(fit, f, i):
    """Return whether the first end of side i of a face goes in a collapse: the freer one, or the one added later."""
    x, y = fit.mesh.faces[f, (i + 1) % 3], fit.mesh.faces[f, (i + 2) % 3]
    if fit.freedom[x] != fit.freedom[y]:
        return fit.freedom[x] > fit.freedom[y]
    return x > y


@kernel
def collapse_edges(fit, sides, limits, settings, touched):
    """Collapse sides in this order where nothing near has changed, until enough points are gone; return how many.

    Parameters
    ----------
    fit
        Mesh and samples.
    sides
        Three times the face plus the side (n,).
    limits
        Changes of the energy (n,) below which the collapses are made.
    settings
        Price, squared distance that is allowed in any case, and how many points are to go.
    touched
        1 for points around a collapse (V,), which are set here.
    """
    price, max_square, wanted = settings
    mesh, patch = fit.mesh, fit.patch
    count = 0
    for k in range(len(sides)):
        if count >= wanted:
            break
        f, i = sides[k] // 3, sides[k] % 3
        if mesh.faces[f, 0] < 0 or mesh.neighbours[f, i] < 0:
            continue
        x, y = mesh.faces[f, (i + 1) % 3], mesh.faces[f, (i + 2) % 3]
        if touched[x] or touched[y]:
            continue
        gone, into = (x, y) if _first_goes(fit, f, i) else (y, x)
        change, n, m = _collapse(fit, f, i, price, max_square, limits[k])
        if not change < limits[k]:
            continue
        g = mesh.neighbours[f, i]
        set_point(fit, into, (fit.place[0], fit.place[1], fit.place[2]))
        patch_error(fit, n, m, patch.owners, REFUSED)
        join_across(mesh, f, gone, into)
        join_across(mesh, g, gone, into)
        fit.samples.first[f] = fit.samples.first[g] = -1
        for t in range(n):
            face = patch.faces[t]
            for corner in range(3):
                if mesh.faces[face, corner] == gone:
                    mesh.faces[face, corner] = into
                fit.face_at[mesh.faces[face, corner]] = face
                touched[mesh.faces[face, corner]] = 1
                fit.active[mesh.faces[face, corner]] = 1
        fit.face_at[gone] = -1
        relist(fit, n, m, patch.owners)
        count += 1
    return count
