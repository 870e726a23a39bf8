"""Finite-element gradients in orthonormal frames of the faces, and closed forms for symmetric 2x2 tensors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import sparse

from anisomesh._arrays import CornerTensors, FaceMask, FaceScalars, PointTensors
from anisomesh.mesh.geometry import unit
from anisomesh.mesh.surface import Surface

_MIN_GRADIENT_HEIGHT = 1e-10  # height over longest side of a face with a gradient; heuristic, above rounding

FaceFrames = npt.NDArray[np.float64]
"""Two orthonormal vectors in the plane of each face (F, 2, 3)."""
FaceTensors = npt.NDArray[np.float64]
"""Symmetric tensors in the frames of the faces (F, 2, 2)."""


@dataclass(frozen=True, eq=False)
class FaceGradient:
    """The gradient of functions that are linear on each face.

    Attributes
    ----------
    operator
        Sparse (2F, V): rows ``2 f`` and ``2 f + 1`` give the two components of the gradient in the frame of face f.
    areas
        Areas (F,), zero for degenerate faces.
    frames
        Orthonormal vectors (F, 2, 3) in the plane of each face; zero for degenerate faces.
    regular
        Which faces are not degenerate (F,).
    """

    operator: sparse.csr_matrix
    areas: FaceScalars
    frames: FaceFrames
    regular: FaceMask


def regular_faces(surface: Surface) -> FaceMask:
    """Return which faces (F,) have a height above 1e-10 of their longest side, so are not degenerate."""
    longest = surface.edge_lengths[surface.face_edges].max(axis=1)
    return np.asarray(2.0 * surface.face_areas > _MIN_GRADIENT_HEIGHT * longest**2)


def face_frames(surface: Surface) -> FaceFrames:
    """Return orthonormal vectors (F, 2, 3) in the plane of each face, the first along side 0 1; zero if degenerate."""
    first = unit(surface.points[surface.faces[:, 1]] - surface.points[surface.faces[:, 0]])
    frames = np.stack([first, np.cross(surface.face_normals, first)], axis=1)
    frames[~regular_faces(surface)] = 0.0
    return frames


def face_gradient(surface: Surface) -> FaceGradient:
    """Return the gradient operator of piecewise linear functions on a surface.

    Notes
    -----
    The gradient of the hat function of a corner is the cross product of the unit normal and the opposite side, divided
    by twice the area. The rows of degenerate faces are zero.

    References
    ----------
    Botsch et al., "Polygon Mesh Processing", section 3.3.
    """
    frames, regular = face_frames(surface), regular_faces(surface)
    points, faces = surface.points, surface.faces
    sides = np.stack([points[faces[:, (c + 2) % 3]] - points[faces[:, (c + 1) % 3]] for c in range(3)], axis=1)
    across = np.cross(surface.face_normals[:, None, :], sides)
    double = np.where(regular, 2.0 * surface.face_areas, np.inf)
    hats = np.einsum("fkx,fcx->fkc", frames, across) / double[:, None, None]
    columns = np.repeat(faces, 2, axis=0).ravel()
    starts = np.arange(0, 6 * surface.n_faces + 1, 3)
    operator = sparse.csr_matrix((hats.ravel(), columns, starts), shape=(2 * surface.n_faces, surface.n_points))
    return FaceGradient(operator, np.where(regular, surface.face_areas, 0.0), frames, regular)


def face_tensors(surface: Surface, tensors: PointTensors | CornerTensors, frames: FaceFrames) -> FaceTensors:
    """Return tensors averaged over the corners and restricted to the planes of the faces (F, 2, 2).

    The tensors are given at the points (V, 3, 3) or at the corners (F, 3, 3, 3).
    """
    mean = (tensors[surface.faces] if tensors.ndim == 3 else tensors).mean(axis=1)
    return np.asarray(frames @ mean @ frames.transpose(0, 2, 1))


def larger_eigenvalue(tensors: FaceTensors) -> FaceScalars:
    """Return the larger eigenvalue (F,) of symmetric 2x2 tensors."""
    half_difference = 0.5 * (tensors[:, 0, 0] - tensors[:, 1, 1])
    return 0.5 * (tensors[:, 0, 0] + tensors[:, 1, 1]) + np.hypot(half_difference, tensors[:, 0, 1])


def eigen_2x2(tensors: FaceTensors) -> tuple[npt.NDArray[np.float64], FaceTensors]:
    """Return the eigenvalues (F, 2), larger first, and the eigenvectors as columns (F, 2, 2) of symmetric tensors.

    Notes
    -----
    The angle of the eigenvector is half the angle of (xx - yy, 2 xy), which stays accurate if the eigenvalues are
    nearly equal.
    """
    angle = 0.5 * np.arctan2(2.0 * tensors[:, 0, 1], tensors[:, 0, 0] - tensors[:, 1, 1])
    cosine, sine = np.cos(angle), np.sin(angle)
    vectors = np.stack([np.stack([cosine, -sine], axis=1), np.stack([sine, cosine], axis=1)], axis=1)
    larger = larger_eigenvalue(tensors)
    return np.stack([larger, tensors[:, 0, 0] + tensors[:, 1, 1] - larger], axis=1), vectors
