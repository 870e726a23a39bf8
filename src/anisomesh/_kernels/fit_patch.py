"""The energy of a patch of faces of a fitted mesh, and the samples on them; arrays as in :mod:`fit_arrays`."""

from math import sqrt

from .compiled import inlined, kernel
from .vectors import (
    closest_weights,
    combine,
    coordinates,
    cross,
    dot,
    length,
    mapped,
    solve_symmetric,
    square_to_triangle,
    squared_length,
    subtract,
)

OPPOSED_COSINE = -0.2  # between normals of a sample and a triangle, below which the sample belongs to another sheet
_OPPOSED_FACTOR = 4.0  # of squared distances to triangles of another sheet; heuristic
_SMOOTH_COSINE = 0.9  # between the normals of a patch, above which the nearest triangle is the one below; heuristic
_MIN_SAMPLE_COSINE = 0.3  # between the normal of a triangle and the sum over its samples; heuristic
_MAX_AREA_FACTOR = 2.0  # area of a triangle over the area that its samples stand for; heuristic
_PULL = 1e-3  # of a new place towards the one before it, over the trace of the matrix of the fit
_MAX_GAP = 6.25  # squared distance of a place on the surface from the nearest sample, over the area of one; heuristic
_AREA_SLACK = 3.0  # samples that this leaves out: a triangle between samples; heuristic


@inlined
def triangle_corners(fit, k):
    """Return the coordinates of the corners of triangle k of the patch."""
    points, row = fit.mesh.points, fit.patch.triangles
    return coordinates(points, row[k, 0]), coordinates(points, row[k, 1]), coordinates(points, row[k, 2])


@inlined
def unit_normal(a, b, c):
    """Return the unit normal of a triangle and twice its area; zero if it has none."""
    normal = cross(subtract(b, a), subtract(c, a))
    size = length(normal)
    if size == 0.0:
        return normal, size
    return (normal[0] / size, normal[1] / size, normal[2] / size), size


@kernel
def set_triangle(fit, k, a, b, c):
    """Set the corners of triangle k of the patch to these points."""
    row = fit.patch.triangles
    row[k, 0], row[k, 1], row[k, 2] = a, b, c


@kernel
def remember_normal(fit, k):
    """Note the normal of triangle k of the patch as the one before a change, and return twice its area."""
    a, b, c = triangle_corners(fit, k)
    normal, size = unit_normal(a, b, c)
    before = fit.patch.before
    before[k, 0], before[k, 1], before[k, 2] = normal
    return size


@kernel
def gather_members(fit, n):
    """Write the samples of the first n faces of the patch, and which face each is on as its owner; return their number.

    The number is -1 if they exceed the workspace.
    """
    patch, count = fit.patch, 0
    for k in range(n):
        sample = fit.samples.first[patch.faces[k]]
        while sample >= 0:
            if count == len(patch.members):
                return -1
            patch.members[count] = sample
            patch.owners[count] = k
            count += 1
            sample = fit.samples.following[sample]
    return count


@kernel
def patch_error(fit, n, m, owners, limit):
    """Return the sum of the weighted squared distances of the m members to the n triangles, and write the nearest.

    In a smooth patch a sample whose closest point on its present owner, in ``Patch.owners``, is inside that triangle
    stays there; others go to the nearest of all triangles. Beyond the limit the sum is not finished.
    """
    patch, samples = fit.patch, fit.samples
    normals, present, smooth = patch.normals, patch.owners, True
    for k in range(n):
        a, b, c = triangle_corners(fit, k)
        normal, _ = unit_normal(a, b, c)
        normals[k, 0], normals[k, 1], normals[k, 2] = normal
        smooth = smooth and dot(normal, coordinates(normals, 0)) > _SMOOTH_COSINE
    total = 0.0
    for q in range(m):
        sample, owner = patch.members[q], present[q]
        p, upright = coordinates(samples.points, sample), coordinates(samples.normals, sample)
        best, searching = float("inf"), True
        if owner < n and dot(upright, coordinates(normals, owner)) >= OPPOSED_COSINE:
            a, b, c = triangle_corners(fit, owner)
            u, v, w = closest_weights(p, a, b, c)
            offset = combine((u, v, w), subtract(a, p), subtract(b, p), subtract(c, p))
            best = squared_length(offset)
            searching = not (smooth and u > 0.0 and v > 0.0 and w > 0.0)
            if not best >= 0.0:  # a triangle without area
                best = float("inf")
        k = 0
        while searching and k < n:
            a, b, c = triangle_corners(fit, k)
            normal = coordinates(normals, k)
            factor = _OPPOSED_FACTOR if dot(upright, normal) < OPPOSED_COSINE else 1.0
            height = dot(normal, subtract(p, a))
            if factor * height * height < best:
                square = factor * square_to_triangle(p, a, b, c)
                if square < best:
                    best, owner = square, k
            k += 1
        owners[q] = owner
        total += samples.weights[sample] * best
        if total > limit:
            break
    return total


@kernel
def _nearest_member(fit, m, place):
    """Return the sample nearest to a place, of the m members."""
    nearest, best = -1, float("inf")
    for q in range(m):
        offset = subtract(coordinates(fit.samples.points, fit.patch.members[q]), place)
        square = dot(offset, offset)
        if square < best:
            nearest, best = fit.patch.members[q], square
    return nearest


@kernel
def follows_samples(fit, n, m, owners, min_cosine):
    """Return whether the n triangles face the way of their samples and of the triangles before, and have samples.

    Triangles without a normal before, a zero vector, are not compared with it. A triangle that is much larger than what
    its samples stand for is a spike or a fold.
    """
    patch, samples = fit.patch, fit.samples
    sums = patch.sums
    for k in range(n):
        sums[k, 0] = sums[k, 1] = sums[k, 2] = 0.0
    for q in range(m):
        sample, k = patch.members[q], owners[q]
        for axis in range(3):
            sums[k, axis] += samples.weights[sample] * samples.normals[sample, axis]
    for k in range(n):
        a, b, c = triangle_corners(fit, k)
        normal, size = unit_normal(a, b, c)
        if not size > 0.0:
            return False
        before, total = coordinates(patch.before, k), coordinates(sums, k)
        if dot(normal, before) < min_cosine * length(before):
            return False
        if dot(normal, total) < _MIN_SAMPLE_COSINE * length(total):
            return False
        if 0.5 * size > _MAX_AREA_FACTOR * length(total) + _AREA_SLACK * samples.weights[0]:
            return False
        centre = combine((1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0), a, b, c)
        if not dot(normal, coordinates(samples.normals, _nearest_member(fit, m, centre))) > 0.0:
            return False
    return True


@kernel
def relist(fit, n, m, owners):
    """Put the m members on the lists of the first n faces of the patch, as ``owners`` says."""
    patch, samples = fit.patch, fit.samples
    for k in range(n):
        samples.first[patch.faces[k]] = -1
    for q in range(m):
        sample, face = patch.members[q], patch.faces[owners[q]]
        samples.following[sample] = samples.first[face]
        samples.first[face] = sample
        samples.owner[sample] = face


@kernel
def quality(root, a, b, c):
    """Return the quality G of a triangle in a metric, see :mod:`anisomesh.metric.quality`."""
    u, v = mapped(root, subtract(b, a)), mapped(root, subtract(c, a))
    w = subtract(v, u)
    first, second, third = length(u), length(v), length(w)
    longest = max(first, second, third)
    if not longest > 0.0:
        return 0.0
    return 2.0 * sqrt(3.0) * length(cross(u, v)) / (longest * (first + second + third))


@kernel
def fit_system(fit, m, owners, point):
    """Return matrix and right side of the step of a point that fits it to the members, in the least squares sense.

    For samples p with normal n whose closest point on their triangle is sum b_i x_i the sum of w (n . (p - sum b_i
    x_i))^2 is quadratic in the point: matrix sum w b^2 n n^t as (xx, xy, xz, yy, yz, zz), right side sum w b r n.
    """
    samples, patch = fit.samples, fit.patch
    xx = xy = xz = yy = yz = zz = 0.0
    rx = ry = rz = 0.0
    for q in range(m):
        sample, k = patch.members[q], owners[q]
        a, b, c = triangle_corners(fit, k)
        p, normal = coordinates(samples.points, sample), coordinates(samples.normals, sample)
        weights = closest_weights(p, a, b, c)
        share = 0.0
        for corner in range(3):
            if patch.triangles[k, corner] == point:
                share = weights[corner]
        if share <= 0.0:
            continue
        x, y, z = normal
        residual = dot(normal, subtract(p, combine(weights, a, b, c)))
        right, weight = samples.weights[sample] * share * residual, samples.weights[sample] * share * share
        rx, ry, rz = rx + right * x, ry + right * y, rz + right * z
        xx, xy, xz = xx + weight * x * x, xy + weight * x * y, xz + weight * x * z
        yy, yz, zz = yy + weight * y * y, yz + weight * y * z, zz + weight * z * z
    return (xx, xy, xz, yy, yz, zz), (rx, ry, rz)


@kernel
def off_samples(fit, m, place, before, max_square):
    """Return whether a place is farther than a distance from the plane of the sample nearest to it, or off all samples.

    A place that is nearer than the one before is not off. Beyond a tip the planes of the samples go on, but the samples
    do not.
    """
    square = _off_square(fit, m, place)
    return square > max_square and square > _off_square(fit, m, before)


@kernel
def _off_square(fit, m, place):
    """Return the squared distance of a place from the plane of the nearest of the members.

    If that is farther than samples are from each other it is the squared distance beyond.
    """
    samples, nearest = fit.samples, _nearest_member(fit, m, place)
    offset = subtract(coordinates(samples.points, nearest), place)
    height = dot(offset, coordinates(samples.normals, nearest))
    return max(height * height, squared_length(offset) - _MAX_GAP * samples.weights[0])


@kernel
def shape_loss(fit, n):
    """Return the sum of 1 - G over the n triangles of the patch, and their lowest G."""
    loss, lowest = 0.0, 1.0
    for k in range(n):
        a, b, c = triangle_corners(fit, k)
        g = quality(fit.roots[fit.patch.faces[k]], a, b, c)
        loss += 1.0 - g
        lowest = min(lowest, g)
    return loss, lowest


@kernel
def set_point(fit, point, place):
    """Move a point to a place."""
    points = fit.mesh.points
    points[point, 0], points[point, 1], points[point, 2] = place


@kernel
def fitted_place(fit, m, owners, point):
    """Return the place of a point that fits it to the members, near its present one."""
    place = coordinates(fit.mesh.points, point)
    matrix, right = fit_system(fit, m, owners, point)
    trace = matrix[0] + matrix[3] + matrix[5]
    if not trace > 0.0:
        return place
    step = solve_symmetric(matrix, _PULL * trace, right)
    return place[0] + step[0], place[1] + step[1], place[2] + step[2]
