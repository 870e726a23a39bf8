"""Faces of a fitted mesh whose samples lie in a plane."""

from .compiled import kernel
from .vectors import coordinates, cross, dot, length, subtract

_PARALLEL_SINE = 1e-3  # between normals of facets of one plane: the ones of slivers are rounded
_MIN_SAMPLES = 3  # of a face in a plane


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
