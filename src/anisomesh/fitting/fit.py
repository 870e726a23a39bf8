"""The fit of a mesh to a surface: error and shape of its triangles together, by moves of points and flips of edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, FaceLabels, PointMask
from anisomesh._kernels import fit_moves, fit_patch, fit_samples
from anisomesh.deadline import NO_DEADLINE, Deadline
from anisomesh.features.detect import sharp_edges
from anisomesh.fitting.samples import SurfaceSamples
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.marked_surface import MarkedSurface
from anisomesh.mesh.surface import Surface

QUALITY_PRICE = 5.0  # of a triangle of quality 0, over the mean error of a triangle at the start
_MAX_SWEEPS = 8
_MIN_SWEEP_GAIN = 5e-3  # of the energy in a sweep, below which it is the last
_MIN_RMS = 1e-6  # of the diagonal of the surface: an error that counts as exact
_MAX_DISTANCE = 5.0  # of a vertex from the surface, in root mean squared errors at the start; heuristic
_FACE_ROOM, _SAMPLE_ROOM = 1_024, 65_536  # around a point; points with more stay

STAYS, SLIDES, FREE = 0, 1, 2  # freedom of points


@dataclass(frozen=True, kw_only=True, eq=False)
class FitTask:
    """A mesh to be fitted.

    Attributes
    ----------
    mesh
        An oriented manifold mesh near the surface.
    held
        Points of the mesh that stay (V,), besides its boundary.
    kept
        Edges of the mesh that stay (E,).
    crease_angle
        Edges that bend by more degrees are creases, along which points only slide.
    """

    mesh: Surface
    held: PointMask
    kept: EdgeMask
    crease_angle: float


def fit_mesh(task: FitTask, samples: SurfaceSamples, *, deadline: Deadline = NO_DEADLINE) -> Surface:
    """Return a mesh with the points moved and the edges flipped such that it is nearer to a surface and better shaped.

    Parameters
    ----------
    task
        The mesh.
    samples
        Samples of the surface, at bounding-box diagonal 1.
    deadline
        Asked before every sweep.

    Notes
    -----
    The energy is sum w d^2 + price sum (1 - G): weight and squared distance of each sample to the mesh, and the quality
    of each triangle in the metric of its samples. The price is proportional to the error at the start, so it has no
    unit, and what is exact stays so. A point moves to the best of a few places: between the least squares fit of the
    planes of the samples around it, which is a 3 x 3 system, and the mean of the places at which each of its triangles
    is equilateral. Where the samples say nothing about a direction, as along a crease or in a plane, the shape decides.
    Every move and flip lowers the energy of the triangles around it, with their samples free to go to any of these, and
    none is made that inverts a triangle against its samples.

    References
    ----------
    Hoppe, DeRose, Duchamp, McDonald, Stuetzle, "Mesh optimization", 1993 (samples and local changes).
    """
    fit = _start(task, samples)
    n_faces = task.mesh.n_faces
    totals = np.zeros(n_faces)
    fit_samples.walk_samples(fit)
    fit_samples.average_roots(fit, totals)
    error = fit_samples.fit_error(fit)
    square = max(error / float(samples.weights.sum()), _MIN_RMS**2)
    price = QUALITY_PRICE * square * float(samples.weights.sum()) / n_faces
    order = np.arange(task.mesh.n_points, dtype=np.int32)
    before = _energy(fit, price)
    for _ in range(_MAX_SWEEPS):
        if deadline.passed():
            break
        fit_moves.move_points(fit, order, price, _MAX_DISTANCE**2 * square)
        fit_moves.flip_edges(fit, price)
        fit_samples.walk_samples(fit)
        fit_samples.average_roots(fit, totals)
        after = _energy(fit, price)
        if after > (1.0 - _MIN_SWEEP_GAIN) * before:
            break
        before = after
    return Surface(fit.mesh.points, fit.mesh.faces)


def _energy(fit: fit_patch.Fit, price: float) -> float:
    """Return the energy of a mesh."""
    total, count = fit_samples.quality_sum(fit)
    return float(fit_samples.fit_error(fit) + price * (count - total))


def _start(task: FitTask, samples: SurfaceSamples) -> fit_patch.Fit:
    """Return the arrays of a fit, every sample on the face nearest to it."""
    mesh = task.mesh
    creases = sharp_edges(mesh, task.crease_angle) | task.kept
    freedom = np.full(mesh.n_points, FREE, dtype=np.uint8)
    freedom[mesh.edges[creases]] = SLIDES
    freedom[task.held | mesh.on_boundary] = STAYS
    face_at = np.full(mesh.n_points, -1, dtype=np.int32)
    face_at[mesh.faces] = np.arange(mesh.n_faces, dtype=np.int32)[:, None]
    faces, corners = np.zeros((2, _FACE_ROOM), dtype=np.int32)
    before, normals, sums = np.zeros((3, _FACE_ROOM, 3))
    members, owners, trial = np.zeros((3, _SAMPLE_ROOM), dtype=np.int32)
    return fit_patch.Fit(
        mesh=MarkedSurface.unmoved(mesh, task.kept.astype(np.int32)).triangulation(mesh.n_faces),
        samples=fit_patch.Samples(
            points=samples.points,
            normals=samples.normals,
            weights=samples.weights,
            roots=samples.roots,
            first=np.full(mesh.n_faces, -1, dtype=np.int32),
            following=np.full(samples.count, -1, dtype=np.int32),
            owner=_nearest_faces(mesh, samples),
        ),
        roots=np.tile(np.eye(3), (mesh.n_faces, 1, 1)),
        face_at=face_at,
        freedom=freedom,
        patch=fit_patch.Patch(
            faces=faces,
            corners=corners,
            triangles=np.zeros((_FACE_ROOM, 3), dtype=np.int32),
            before=before,
            normals=normals,
            sums=sums,
            members=members,
            owners=owners,
            trial=trial,
        ),
    )


def _nearest_faces(mesh: Surface, samples: SurfaceSamples) -> FaceLabels:
    """Return the face (S,) nearest to each sample, if possible one that faces its way."""
    closest = ClosestPoints(mesh)
    face, weights = closest.locate(samples.points)
    opposed = np.flatnonzero(_cosines(mesh, face, samples.normals) < 0.0)
    place = np.einsum("nc,ncx->nx", weights[opposed], mesh.points[mesh.faces[face[opposed]]])
    distance = np.linalg.norm(samples.points[opposed] - place, axis=1)
    outside = samples.points[opposed] + 2.0 * distance[:, None] * samples.normals[opposed]
    other = closest.locate(outside)[0]
    agrees = _cosines(mesh, other, samples.normals[opposed]) > 0.0
    face[opposed[agrees]] = other[agrees]
    return face.astype(np.int32)


def _cosines(mesh: Surface, face: npt.NDArray[np.int64], normals: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the cosines (n,) between the normals of faces (n,) and unit vectors (n, 3)."""
    return np.asarray(np.einsum("nx,nx->n", mesh.face_normals[face], normals))
