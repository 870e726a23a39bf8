"""Planes of the surface that a mesh was fitted to, and its points on them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceLabels, Faces, PointMask, Points
from anisomesh.fitting.samples import SurfaceSamples

_SAME_PLANE = 1e-9  # sine between normals, and distance at bounding-box diagonal 1
_MIN_SAMPLES = 3  # of a triangle in a plane
_MAX_STEP = 1e-5  # at bounding-box diagonal 1: nothing overlaps that did not before
_MIN_ANGLE_EIGENVALUE = 1e-3  # of a sum of n n^t: planes with a smaller angle leave a point where it is


def onto_planes(points: Points, faces: Faces, samples: SurfaceSamples, owner: FaceLabels, movable: PointMask) -> Points:
    """Return points (V, 3) such that triangles whose samples lie in a plane lie in it exactly.

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
    A fit moves points by steps that the shape of triangles has a small part in, so they end up near planes. A point
    goes to the nearest place in all planes of triangles around it, if that is within 1e-5 and in every one of them.
    """
    chosen, normals, offsets = _planes_of_triangles(samples, owner)
    corner = faces[chosen].ravel()
    normals, offsets = np.repeat(normals, 3, axis=0), np.repeat(offsets, 3)
    matrix, right = np.zeros((len(points), 3, 3)), np.zeros((len(points), 3))
    np.add.at(matrix, corner, normals[:, :, None] * normals[:, None, :])
    np.add.at(right, corner, (offsets - np.einsum("nx,nx->n", normals, points[corner]))[:, None] * normals)
    values, vectors = np.linalg.eigh(matrix)
    inverse = np.divide(1.0, values, out=np.zeros_like(values), where=values > _MIN_ANGLE_EIGENVALUE)
    step = np.einsum("vxk,vk,vyk,vy->vx", vectors, inverse, vectors, right)
    moved = points + step
    off = np.abs(np.einsum("nx,nx->n", normals, moved[corner]) - offsets)
    good = movable & (np.linalg.norm(step, axis=1) < _MAX_STEP)
    good[corner[off > _SAME_PLANE]] = False
    return np.where(good[:, None], moved, points)


def _planes_of_triangles(
    samples: SurfaceSamples, owner: FaceLabels
) -> tuple[FaceLabels, npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return triangles (n,) whose samples lie in a plane, and its unit normals (n, 3) and distances (n,) from 0."""
    order = np.argsort(owner, kind="stable")
    triangle, first, count = np.unique(owner[order], return_index=True, return_counts=True)
    normal = samples.normals[order[first]]
    offset = np.einsum("nx,nx->n", normal, samples.points[order[first]])
    own = np.repeat(np.arange(len(first)), count)
    apart = np.abs(np.einsum("nx,nx->n", normal[own], samples.points[order]) - offset[own])
    tilt = np.linalg.norm(np.cross(normal[own], samples.normals[order]), axis=1)
    flat = np.maximum.reduceat(np.maximum(apart, tilt), first) < _SAME_PLANE
    flat &= count >= _MIN_SAMPLES
    return triangle[flat], normal[flat], offset[flat]
