"""Splits of edges of a fitted mesh, and what they change its energy by."""

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
from .triangulation import side_towards, split_side
from .vectors import coordinates, dot, length, subtract, subtract_share

REFUSED = 1e300  # change of the energy by a split or collapse that is not allowed
MIN_COSINE = 0.2  # between normals of a triangle before and after a split or collapse
MAX_STEP = 0.7  # edge lengths by which a new point may be off the middle
MIN_QUALITY = 1e-3  # of new triangles


@kernel
def _split(fit, f, i, price, max_square, point):
    """Return what a split of side i of a face changes the energy by, with the new point at its best place.

    The triangles after the split, their samples and owners stay in the workspace, and the point at its place.
    """
    mesh, patch = fit.mesh, fit.patch
    g = mesh.neighbours[f, i]
    if g < 0 or mesh.labels[f, i] != 0:
        return REFUSED, 0
    a, x, y = mesh.faces[f, i], mesh.faces[f, (i + 1) % 3], mesh.faces[f, (i + 2) % 3]
    b = mesh.faces[g, side_towards(mesh, g, f)]
    patch.faces[0], patch.faces[1] = f, g
    set_triangle(fit, 0, a, x, y)
    set_triangle(fit, 1, b, y, x)
    m = gather_members(fit, 2)
    if m <= 0:
        return REFUSED, 0
    before = patch_error(fit, 2, m, patch.owners, REFUSED) + price * shape_loss(fit, 2)[0]
    remember_normal(fit, 0)
    remember_normal(fit, 1)
    for axis in range(3):
        patch.before[2, axis] = patch.before[0, axis]
        patch.before[3, axis] = patch.before[1, axis]
    set_triangle(fit, 0, a, x, point)
    set_triangle(fit, 1, b, point, x)
    set_triangle(fit, 2, a, point, y)
    set_triangle(fit, 3, b, y, point)
    patch.faces[2], patch.faces[3] = f, g
    start, end = coordinates(mesh.points, x), coordinates(mesh.points, y)
    middle = subtract_share(start, -0.5, subtract(end, start))
    set_point(fit, point, middle)
    for _ in range(2):
        patch_error(fit, 4, m, patch.owners, REFUSED)
        set_point(fit, point, fitted_place(fit, m, patch.owners, point))
    place = coordinates(mesh.points, point)
    if not length(subtract(place, middle)) <= MAX_STEP * length(subtract(end, start)):
        return REFUSED, 0
    if off_samples(fit, m, place, middle, max_square):
        return REFUSED, 0
    loss, lowest = shape_loss(fit, 4)
    error = patch_error(fit, 4, m, patch.owners, REFUSED)
    if lowest < MIN_QUALITY or not follows_samples(fit, 4, m, patch.owners, MIN_COSINE):
        return REFUSED, 0
    return error + price * loss - before, m


@kernel
def split_gains(fit, sides, price, max_square, point, gains):
    """Write what a split of some sides, 3 face + side (n,), changes the energy by (n,).

    ``point`` is a free point, for workspace.
    """
    for k in range(len(sides)):
        gains[k] = _split(fit, sides[k] // 3, sides[k] % 3, price, max_square, point)[0]


@kernel
def split_edges(fit, sides, settings, free_points, free_faces, touched):
    """Split sides in this order where nothing near has changed; return how many.

    Parameters
    ----------
    fit
        Mesh and samples.
    sides
        Three times the face plus the side (n,).
    settings
        Price, squared distance that is allowed in any case, cosine of the crease angle, and the largest change of the
        energy that a split is made for.
    free_points, free_faces
        Numbers of points (k,) and faces (2 k,) that are not used.
    touched
        1 for points around a split (V,), which are set here.
    """
    price, max_square, crease_cosine, largest = settings
    mesh, patch = fit.mesh, fit.patch
    count = 0
    for k in range(len(sides)):
        if count == len(free_points):
            break
        f, i = sides[k] // 3, sides[k] % 3
        g = mesh.neighbours[f, i]
        if g < 0:
            continue
        a, x, y = mesh.faces[f, i], mesh.faces[f, (i + 1) % 3], mesh.faces[f, (i + 2) % 3]
        b = mesh.faces[g, side_towards(mesh, g, f)]
        if touched[x] + touched[y] + touched[a] + touched[b] > 1:
            continue
        point = free_points[count]
        change, m = _split(fit, f, i, price, max_square, point)
        if not change < largest:
            continue
        bends = dot(coordinates(patch.before, 0), coordinates(patch.before, 1))
        fit.freedom[point] = 1 if bends < crease_cosine else 2
        new_f, new_g = free_faces[2 * count], free_faces[2 * count + 1]
        split_side(mesh, f, i, point, new_f, new_g)
        patch.faces[2], patch.faces[3] = new_f, new_g
        for row in range(3):
            for column in range(3):
                fit.roots[new_f, row, column] = fit.roots[f, row, column]
                fit.roots[new_g, row, column] = fit.roots[g, row, column]
        fit.samples.first[new_f] = fit.samples.first[new_g] = -1
        relist(fit, 4, m, patch.owners)
        fit.face_at[point] = fit.face_at[a] = fit.face_at[x] = f
        fit.face_at[b] = g
        fit.face_at[y] = new_f
        touched[a] = touched[b] = touched[x] = touched[y] = touched[point] = 1
        fit.active[a] = fit.active[b] = fit.active[x] = fit.active[y] = fit.active[point] = 1
        count += 1
    return count
