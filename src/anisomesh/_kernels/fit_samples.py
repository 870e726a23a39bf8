"""Passes over the samples of a fitted mesh: the nearest faces, the metric of the faces, error and quality.

Passes over a part of the samples or the faces, from ``first`` to ``last``, may run at the same time. Sums over samples
are added in their order, so they do not depend on the parts.
"""

from .compiled import inlined, kernel
from .fit_patch import OPPOSED_COSINE, quality, unit_normal
from .quadrics import add_plane
from .vectors import coordinates, dot, square_to_triangle

_MIN_SAME_COSINE = 0.5  # between normals of sample and face, from which on its metric counts there; heuristic


@inlined
def face_points(mesh, face):
    """Return the coordinates of the corners of a face of the mesh."""
    points, faces = mesh.points, mesh.faces
    return (
        coordinates(points, faces[face, 0]),
        coordinates(points, faces[face, 1]),
        coordinates(points, faces[face, 2]),
    )


@kernel
def _nearer_face(fit, sample):
    """Return the face nearest to a sample that a walk finds, from face to face across sides.

    A face across a side is nearer only if it faces the way of the sample.
    """
    mesh, samples = fit.mesh, fit.samples
    p, upright = coordinates(samples.points, sample), coordinates(samples.normals, sample)
    face, best = samples.owner[sample], float("inf")
    came_from, searching = -1, True
    while searching:
        a, b, c = face_points(mesh, face)
        best = min(best, square_to_triangle(p, a, b, c))
        searching = False
        nearest = face
        for side in range(3):
            other = mesh.neighbours[face, side]
            if other < 0 or other == came_from:
                continue
            a, b, c = face_points(mesh, other)
            if dot(upright, unit_normal(a, b, c)[0]) < OPPOSED_COSINE:
                continue
            square = square_to_triangle(p, a, b, c)
            if square < best:
                best, nearest = square, other
                searching = True
        came_from, face = face, nearest
    return face


@kernel
def walk_samples(fit, everywhere, first, last):
    """Find the nearest faces of some samples, the ones of faces with an active point; the lists stay."""
    mesh, samples, active = fit.mesh, fit.samples, fit.active
    for sample in range(first, last):
        corners = mesh.faces[samples.owner[sample]]
        if everywhere or active[corners[0]] or active[corners[1]] or active[corners[2]]:
            samples.owner[sample] = _nearer_face(fit, sample)


@kernel
def list_samples(fit):
    """Put all samples on the lists of their faces."""
    samples = fit.samples
    for face in range(len(samples.first)):
        samples.first[face] = -1
    for sample in range(len(samples.points)):
        face = samples.owner[sample]
        samples.following[sample] = samples.first[face]
        samples.first[face] = sample


@kernel
def sample_errors(fit, errors, first, last):
    """Write the weighted squared distances of some samples to their faces (S,)."""
    mesh, samples = fit.mesh, fit.samples
    for sample in range(first, last):
        a, b, c = face_points(mesh, samples.owner[sample])
        errors[sample] = samples.weights[sample] * square_to_triangle(coordinates(samples.points, sample), a, b, c)


@kernel
def face_errors(fit, of_samples, errors):
    """Write the sum of the errors of the samples (S,) of each face (F,)."""
    owner = fit.samples.owner
    for face in range(len(errors)):
        errors[face] = 0.0
    for sample in range(len(owner)):
        errors[owner[sample]] += of_samples[sample]


@kernel
def sum_in_order(values):
    """Return the sum of values (n,), added one after the other."""
    total = 0.0
    for value in values:
        total += value
    return total


@kernel
def average_roots(fit, totals, first, last):
    """Set the metric of some faces to the mean over their samples that face their way; without any it stays.

    ``totals`` is workspace (F,).
    """
    mesh, samples, roots = fit.mesh, fit.samples, fit.roots
    for face in range(first, last):
        totals[face] = 0.0
    for sample in range(len(samples.points)):
        face = samples.owner[sample]
        if face < first or face >= last:
            continue
        a, b, c = face_points(mesh, face)
        if dot(coordinates(samples.normals, sample), unit_normal(a, b, c)[0]) < _MIN_SAME_COSINE:
            continue
        if totals[face] == 0.0:
            for i in range(3):
                for j in range(3):
                    roots[face, i, j] = 0.0
        totals[face] += samples.weights[sample]
        for i in range(3):
            for j in range(3):
                roots[face, i, j] += samples.weights[sample] * samples.roots[sample, i, j]
    for face in range(first, last):
        if totals[face] > 0.0:
            for i in range(3):
                for j in range(3):
                    roots[face, i, j] /= totals[face]


@kernel
def quality_sum(fit):
    """Return the sum of the qualities of all faces, and their number."""
    mesh = fit.mesh
    total, count = 0.0, 0
    for face in range(len(fit.roots)):
        if mesh.faces[face, 0] >= 0:
            a, b, c = face_points(mesh, face)
            total += quality(fit.roots[face], a, b, c)
            count += 1
    return total, count


@kernel
def face_quadrics(fit, quadrics):
    """Write for each face the sum of w (n . (x - p))^2 over its samples p with normals n, as a quadric (F, 10) in x."""
    samples = fit.samples
    for face in range(len(quadrics)):
        for k in range(10):
            quadrics[face, k] = 0.0
    for sample in range(len(samples.points)):
        place, normal = coordinates(samples.points, sample), coordinates(samples.normals, sample)
        add_plane(quadrics[samples.owner[sample]], samples.weights[sample], normal, place)
