"""Planes of the surface that a mesh was fitted to, and its points on them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceLabels, Faces, PointMask, Points
from anisomesh._kernels.fit_planes import face_planes, place_on_planes
from anisomesh.fitting.samples import SurfaceSamples

_SAME_PLANE = 1e-7  # distance at bounding-box diagonal 1: about as coordinates of single precision are rounded
_MAX_STEP = 0.02  # of the shortest edge at a point: what hardly changes shapes and distances


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
    A fit ends before all points are in planes: every sweep takes a part of the way. A point goes to the planes of the
    triangles around it, of large triangles first, as far as it can be in all of them, and if they are within a fiftieth
    of the shortest edge: farther off are points that stand for more than a plane, as where a crease has too few.
    """
    planes = _planes_of_faces(points, faces, samples, owner)
    flat = np.flatnonzero(planes[:, :3].any(axis=1))
    corner, face = faces[flat].ravel(), np.repeat(flat, 3)
    a, b, c = points[faces[face]].swapaxes(0, 1)
    order = np.lexsort((-np.linalg.norm(np.cross(b - a, c - a), axis=1), corner))
    bounds = np.searchsorted(corner[order], np.arange(len(points) + 1))
    limits = np.where(movable, _MAX_STEP * _shortest_edges(points, faces), 0.0)
    places = np.empty_like(points)
    place_on_planes(points, planes, face[order], bounds, limits, places)
    return places


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
