"""From a mesh to be fitted to the arrays that kernels work on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, FaceLabels, PointMask
from anisomesh._kernels import fit_arrays
from anisomesh.features.detect import sharp_edges
from anisomesh.fitting.samples import SurfaceSamples
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.working.marked_surface import MarkedSurface

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


def fit_arrays_of(task: FitTask, samples: SurfaceSamples, n_spare: int) -> fit_arrays.Fit:
    """Return the arrays of a fit, every sample on the face nearest to it."""
    mesh = task.mesh
    n_points, n_faces = mesh.n_points + 2 * n_spare, mesh.n_faces + 2 * n_spare
    triangulation = MarkedSurface.unmoved(mesh, task.kept.astype(np.int32)).triangulation(n_faces)
    triangulation.faces[mesh.n_faces :] = -1
    creases = sharp_edges(mesh, task.crease_angle) | task.kept
    freedom = np.full(n_points, FREE, dtype=np.uint8)
    freedom[mesh.edges[creases]] = SLIDES
    freedom[: mesh.n_points][task.held | mesh.on_boundary] = STAYS
    face_at = np.full(n_points, -1, dtype=np.int32)
    face_at[mesh.faces] = np.arange(mesh.n_faces, dtype=np.int32)[:, None]
    return fit_arrays.Fit(
        mesh=triangulation,
        samples=fit_arrays.Samples(
            points=samples.points,
            normals=samples.normals,
            weights=samples.weights,
            roots=samples.roots,
            first=np.full(n_faces, -1, dtype=np.int32),
            following=np.full(samples.count, -1, dtype=np.int32),
            owner=_nearest_faces(mesh, samples),
        ),
        roots=np.tile(np.eye(3), (n_faces, 1, 1)),
        face_at=face_at,
        freedom=freedom,
        active=np.ones(n_points, dtype=np.uint8),
        patch=workspace(n_points),
        place=np.zeros(3),
    )


def workspace(n_points: int) -> fit_arrays.Patch:
    """Return workspace for one thread, for a mesh of this many points."""
    faces, corners, other_faces, other_corners = np.zeros((4, _FACE_ROOM), dtype=np.int32)
    before, normals, sums = np.zeros((3, _FACE_ROOM, 3))
    members, owners, trial = np.zeros((3, _SAMPLE_ROOM), dtype=np.int32)
    return fit_arrays.Patch(
        faces=faces,
        corners=corners,
        triangles=np.zeros((_FACE_ROOM, 3), dtype=np.int32),
        before=before,
        normals=normals,
        sums=sums,
        members=members,
        owners=owners,
        trial=trial,
        other_faces=other_faces,
        other_corners=other_corners,
        marks=np.zeros(n_points, dtype=np.uint8),
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
