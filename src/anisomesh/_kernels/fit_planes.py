"""Faces of a fitted mesh whose samples lie in a plane, and points in these planes."""

from .compiled import kernel
from .vectors import coordinates, cross, dot, length, subtract, subtract_share

_PARALLEL_SINE = 1e-3  # between normals of facets of one plane: the ones of slivers are rounded
_MIN_SAMPLES = 3  # of a face in a plane
_MIN_SINE = 0.03  # between a plane and the ones that a point is in, to move it there in these


@kernel
def face_planes(points, faces, samples, order, bounds, tolerance, planes):
    """Write the plane (F, 4) in which the samples of each face lie: its unit normal, and its distance from 0.

    Parameters
    ----------
    points, faces
        The mesh.
    samples
        Points, normals and weights of the samples.
    order, bounds
        Samples in the order of their faces (S,), and where each face begins there (F + 1,).
    tolerance
        Distance of samples from a plane that they lie in.
    planes
        Zeros, written where samples lie in a plane and are at least three.

    Notes
    -----
    The normal is the mean over the samples with about the same normal as the one that agrees best with the face. Others
    may be on the other side of a crease; they need not agree, but to lie in the plane.
    """
    places, normals, weights = samples
    for face in range(len(planes)):
        first, end = bounds[face], bounds[face + 1]
        if end - first < _MIN_SAMPLES:
            continue
        corner = coordinates(points, faces[face, 0])
        upright = cross(
            subtract(coordinates(points, faces[face, 1]), corner),
            subtract(coordinates(points, faces[face, 2]), corner),
        )
        best, steepest = -float("inf"), upright
        for k in range(first, end):
            normal = coordinates(normals, order[k])
            if dot(normal, upright) > best:
                best, steepest = dot(normal, upright), normal
        x = y = z = height = total = 0.0
        for k in range(first, end):
            sample = order[k]
            normal, weight = coordinates(normals, sample), weights[sample]
            if length(subtract(normal, steepest)) < _PARALLEL_SINE:
                x, y, z = x + weight * normal[0], y + weight * normal[1], z + weight * normal[2]
        size = length((x, y, z))
        mean = x / size, y / size, z / size
        for k in range(first, end):
            sample = order[k]
            if length(subtract(coordinates(normals, sample), steepest)) < _PARALLEL_SINE:
                height += weights[sample] * dot(mean, coordinates(places, sample))
                total += weights[sample]
        height /= total
        flat = True
        for k in range(first, end):
            flat = flat and abs(dot(mean, coordinates(places, order[k])) - height) < tolerance
        if flat:
            planes[face, 0], planes[face, 1], planes[face, 2], planes[face, 3] = mean[0], mean[1], mean[2], height


@kernel
def place_on_planes(starts, planes, order, bounds, limits, places):
    """Write the places (V, 3) of points in the planes of faces around them, the first planes first.

    Parameters
    ----------
    starts
        The points (V, 3).
    planes
        Unit normal and distance from 0 of the plane of each face (F, 4).
    order, bounds
        Faces by point, the ones that count more first (n,), and where each point begins there (V + 1,).
    limits
        How far each point may move (V,).
    places
        Written.

    Notes
    -----
    A point goes to one plane after the other, in the planes that it is in already. A plane that it cannot reach so, or
    not within its limit, is left out: on a rim, one of the many planes of a wall that is round.
    """
    for point in range(len(starts)):
        start = place = coordinates(starts, point)
        first = second = (0.0, 0.0, 0.0)
        n_axes = 0
        for k in range(bounds[point], bounds[point + 1]):
            if n_axes == 3:
                break
            normal, height = coordinates(planes, order[k]), planes[order[k], 3]
            way = subtract_share(subtract_share(normal, dot(normal, first), first), dot(normal, second), second)
            size = length(way)
            if size < _MIN_SINE:
                continue
            axis = way[0] / size, way[1] / size, way[2] / size
            off = height - dot(normal, place)
            moved = subtract_share(place, -off / size, axis)
            if not length(subtract(moved, start)) < limits[point]:
                continue
            place = moved
            if n_axes == 0:
                first = axis
            elif n_axes == 1:
                second = axis
            n_axes += 1
        places[point, 0], places[point, 1], places[point, 2] = place
