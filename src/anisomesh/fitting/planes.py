"""Planes of the surface that a mesh was fitted to, and its points on them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceLabels, Faces, PointMask, Points
from anisomesh._kernels.fit_planes import face_planes
from anisomesh.fitting.samples import SurfaceSamples

_SAME_PLANE = 1e-7  # distance at bounding-box diagonal 1: about as coordinates of single precision are rounded
_MAX_STEP = 0.02  # of the shortest edge at a point: what hardly changes shapes and distances
_MIN_ANGLE_EIGENVALUE = 1e-3  # of a sum of n n^t: planes with a smaller angle leave a point where it is


def onto_planes(points: Points, faces: Faces, samples: SurfaceSamples, owner: FaceLabels, movable: PointMask) -> Points:
    """Return points (V, 3) such that triangles whose samples lie in a plane lie in it.

    Parameters
    ----------
    points, faces
        A mesh (V, 3), (F, 3) that was fitted to samples.
    samples
        The samples, at bounding-box diagonal 1.
    owner
        The face on which each sample lies (S,).
    movable
        Which points may move (V,).

    Notes
    -----
    A fit ends before all points are in planes: every sweep takes a part of the way. A point goes to the nearest place
    in all planes of triangles around it, if it lies in every one of them there, and if that is within a fiftieth of the
    shortest edge: farther off are points that stand for more than a plane, as where a crease has too few.
    """
    planes = _planes_of_faces(points, faces, samples, owner)
    flat = np.flatnonzero(planes[:, :3].any(axis=1))
    corner = faces[flat].ravel()
    normals, offsets = np.repeat(planes[flat, :3], 3, axis=0), np.repeat(planes[flat, 3], 3)
    matrix, right = np.zeros((len(points), 3, 3)), np.zeros((len(points), 3))
    np.add.at(matrix, corner, normals[:, :, None] * normals[:, None, :])
    np.add.at(right, corner, (offsets - np.einsum("nx,nx->n", normals, points[corner]))[:, None] * normals)
    values, vectors = np.linalg.eigh(matrix)
    inverse = np.divide(1.0, values, out=np.zeros_like(values), where=values > _MIN_ANGLE_EIGENVALUE)
    step = np.einsum("vxk,vk,vyk,vy->vx", vectors, inverse, vectors, right)
    moved = points + step
    good = movable & (np.linalg.norm(step, axis=1) < _MAX_STEP * _shortest_edges(points, faces))
    good[corner[np.abs(np.einsum("nx,nx->n", normals, moved[corner]) - offsets) > _SAME_PLANE]] = False
    return np.where(good[:, None], moved, points)


def _planes_of_faces(
    points: Points, faces: Faces, samples: SurfaceSamples, owner: FaceLabels
) -> npt.NDArray[np.float64]:
    """Return the unit normal and the distance from 0 (F, 4) of the plane of each face, zeros where there is none."""
    order = np.argsort(owner, kind="stable")
    bounds = np.searchsorted(owner[order], np.arange(len(faces) + 1))
    planes = np.zeros((len(faces), 4))
    arrays = samples.points, samples.normals, samples.weights
    face_planes(points, faces, arrays, order, bounds, _SAME_PLANE, planes)
    return planes


def _shortest_edges(points: Points, faces: Faces) -> npt.NDArray[np.float64]:
    """Return the length (V,) of the shortest edge at each point; infinite without faces. Faces with -1 are left out."""
    shortest = np.full(len(points), np.inf)
    used = faces[faces[:, 0] >= 0]
    for side in range(3):
        ends = used[:, [side, side - 1]]
        lengths = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
        np.minimum.at(shortest, ends, lengths[:, None])
    return shortest
