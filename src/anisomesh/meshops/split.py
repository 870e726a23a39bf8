"""Splitting edges, to bring a mesh up to a number of vertices."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points, PointTensors
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface

_POOL = 8  # edges looked at for each point that is missing


def grow(
    points: Points, faces: Faces, n_points: int, reference: ClosestPoints, roots_of: PointTensors
) -> tuple[Points, Faces]:
    """Split edges, the longest in the metric first, until there are ``n_points`` points, or no edge will do.

    Parameters
    ----------
    points, faces
        An oriented manifold mesh (V, 3), (F, 3).
    n_points
        Number of points wanted.
    reference
        The surface that the mesh stands for. A new point goes to the place on it closest to the middle of the edge,
        those on the boundary stay in the middle; no triangle that is turned away is made.
    roots_of
        Symmetric square roots of the metric at the points (V, 3, 3).
    """
    while len(points) < n_points:
        surface = Surface(points, faces)
        ends = surface.edges.astype(np.int64)
        way = points[ends[:, 1]] - points[ends[:, 0]]
        length = np.linalg.norm(np.einsum("eij,ej->ei", roots_of[ends].mean(axis=1), way), axis=1)
        pool = np.argsort(-length, kind="stable")[: max(_POOL * (n_points - len(points)), 64)]
        middle = points[ends[pool]].mean(axis=1)
        facet, weights = reference.locate(middle)
        place = np.einsum("nc,ncx->nx", weights, reference.surface.points[reference.surface.faces[facet]])
        inner = surface.edge_face_count[pool] == 2
        place[~inner] = middle[~inner]
        taken = np.zeros(len(faces), dtype=bool)
        gone: list[npt.NDArray[np.int32]] = []
        new: list[list[int]] = []
        added: list[int] = []
        for k, edge in enumerate(pool.tolist()):
            around = surface.edge_faces[edge][: surface.edge_face_count[edge]]
            if len(points) + len(added) == n_points or taken[around].any():
                continue
            number = len(points) + len(added)
            halves = [(faces[face], faces[face] == end) for face in around for end in ends[edge]]
            corners = np.stack([np.where(split[:, None], place[k], points[face]) for face, split in halves])
            if not reference.clearly_facing(corners).all():
                continue
            taken[around] = True
            gone.append(around)
            new += [np.where(split, number, face).tolist() for face, split in halves]
            added.append(k)
        if not added:
            break
        kept = np.delete(faces, np.concatenate(gone), axis=0)
        faces = np.concatenate([kept, np.array(new, dtype=np.int32)])
        roots_of = np.concatenate([roots_of, roots_of[ends[pool[added]]].mean(axis=1)])
        points = np.concatenate([points, place[added]])
    return points, faces
