"""Edge and face splits, and edge splits that bring a mesh up to a number of vertices."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import EdgeEnds, Faces, Points, PointTensors
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.meshops.change import Change, Floats, apply_changes

_POOL = 8  # edges looked at for each point that is missing


def edge_split(surface: Surface, edge: int, place: Floats) -> Change:
    """Return the split of an edge, inside or on the boundary, at a place (3,)."""
    gone = surface.edge_faces[edge][: surface.edge_face_count[edge]].astype(np.int64)
    faces, number = surface.faces[gone].astype(np.int64), surface.n_points
    new = np.concatenate([np.where(faces == end, number, faces) for end in surface.edges[edge]])
    return Change(gone, new, np.array([number]), place[None])


def face_split(surface: Surface, face: int, place: Floats) -> Change:
    """Return the split of a face into three at a place (3,)."""
    number = surface.n_points
    new = np.tile(surface.faces[face].astype(np.int64), (3, 1))
    np.fill_diagonal(new, number)
    return Change(np.array([face]), new, np.array([number]), place[None])


def split_longest_edges(
    points: Points,
    faces: Faces,
    n_points: int,
    reference: ClosestPoints,
    roots: PointTensors,
    *,
    kept: EdgeEnds | None = None,
) -> tuple[Points, Faces]:
    """Split edges, the longest in the metric first, until there are ``n_points`` points, or no edge will do.

    Parameters
    ----------
    points, faces
        An oriented manifold mesh (V, 3), (F, 3).
    n_points
        Number of points wanted.
    reference
        The surface that the mesh approximates. A new point goes to the place on it closest to the middle of the edge,
        one on the boundary stays in the middle; no inverted triangle is made.
    roots
        Symmetric square roots of the metric at the points (V, 3, 3).
    kept
        Ends of edges that are not split (n, 2).
    """
    unsplit = np.zeros(0, dtype=np.int64) if kept is None else edge_keys(kept)
    while len(points) < n_points:
        surface = Surface(points, faces)
        ends = surface.edges.astype(np.int64)
        way = points[ends[:, 1]] - points[ends[:, 0]]
        length = np.linalg.norm(np.einsum("eij,ej->ei", roots[ends].mean(axis=1), way), axis=1)
        length[np.isin(edge_keys(ends), unsplit)] = -1.0
        pool = np.argsort(-length, kind="stable")[: np.count_nonzero(length >= 0.0)]
        pool = pool[: max(_POOL * (n_points - len(points)), 64)]
        middle = points[ends[pool]].mean(axis=1)
        facet, weights = reference.locate(middle)
        places = np.einsum("nc,ncx->nx", weights, reference.surface.points[reference.surface.faces[facet]])
        places = np.where(surface.edge_face_count[pool, None] == 2, places, middle)
        taken = np.zeros(len(faces), dtype=bool)
        changes, split = [], []
        for edge, place in zip(pool.tolist(), places, strict=True):
            change = edge_split(surface, edge, place)
            if not taken[change.gone].any() and reference.clearly_facing(change.corners(points)).all():
                taken[change.gone] = True
                changes.append(change)
                split.append(edge)
            if len(points) + len(changes) == n_points:
                break
        if not changes:
            break
        roots = np.concatenate([roots, roots[ends[split]].mean(axis=1)])
        points, faces = apply_changes(surface, changes)
    return points, faces
