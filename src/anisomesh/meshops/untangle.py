"""Turning back the triangles that face away from the surface: edge flips, moves of points, collapses, splits."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceMask, Faces, Points
from anisomesh.deadline import NO_DEADLINE, Deadline
from anisomesh.mesh import geometry
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.meshops.collapse import collapsible_edges
from anisomesh.meshops.flip import do_flips, possible_flips
from anisomesh.meshops.moves import Failed, Mended, faces_around, nudge, relax, to_average, wander

MAX_ROUNDS = 100
_MAX_WANDERS = 40
_LIFTS = (0.0, 0.1, 0.25, 0.5, 1.0)  # trial heights over an edge, in edge lengths


def untangle(
    points: Points, faces: Faces, reference: ClosestPoints, *, deadline: Deadline = NO_DEADLINE
) -> tuple[Points, Faces, int]:
    """Mend triangles that face away from the reference, without changing the topology.

    Parameters
    ----------
    points, faces
        An oriented manifold mesh (V, 3), (F, 3).
    reference
        The surface that it stands for.
    deadline
        Asked before every round whether to end.

    Returns
    -------
    points, faces, left
        The mended mesh and the number of turned triangles left.

    Notes
    -----
    In each round turned triangles are given a flip of one of their edges, or else the move of a point to the average
    of its neighbours (on the surface or not), or else a small move, or else the collapse of one of their edges, or
    else a point more, in it or on an edge, lifted to the side of the surface that the mesh is on there (on a thin
    sheet a chord can come nearer to the other side), or else a few sweeps of smoothing around them. Taken is what
    leaves fewest turned triangles among those it changes, and only if their number falls. Where nothing helps, as
    between sheets that coincide or cross, a point makes a random small move that leaves as many; the number of these
    is bounded, and the best mesh met is returned.
    """
    best = points, faces, len(faces) + 1
    rng = np.random.default_rng(0)
    failed: Failed = set()
    wanders = 0
    for _ in range(MAX_ROUNDS):
        surface = Surface(points, faces)
        turned = reference.inverted(points[faces])
        left = int(turned.sum())
        if left < best[2]:
            best = points, faces, left
        if left == 0 or deadline.passed():
            break
        for mend in (_flip, to_average, nudge, _collapse, _split, relax):
            mended: Mended = mend(surface, turned, reference, failed)
            if mended is not None:
                points, faces = mended
                break
        else:
            if wanders == _MAX_WANDERS:
                break
            wanders += 1
            points = wander(surface, turned, reference, rng)
    return best


def _flip(surface: Surface, turned: FaceMask, reference: ClosestPoints, failed: Failed) -> Mended:
    """Return the mesh after edge flips that leave fewer turned triangles, None if there is none."""
    flips = possible_flips(surface, np.unique(surface.face_edges[turned]))
    corners = surface.points[flips.triangles].reshape(-1, 3, 3)
    change = reference.inverted(corners).reshape(-1, 2).sum(axis=1) - turned[flips.pair].sum(axis=1)
    shape = geometry.thickness(corners).reshape(-1, 2).min(axis=1)
    order = np.lexsort((-shape, change))
    order = order[(change < 0)[order]]
    return (surface.points, do_flips(surface.faces, flips, order)) if len(order) else None


def _collapse(surface: Surface, turned: FaceMask, reference: ClosestPoints, failed: Failed) -> Mended:
    """Return the mesh after one collapse that leaves fewer turned triangles, None if there is none."""
    edges = np.unique(surface.face_edges[turned])
    edges = edges[collapsible_edges(surface)[edges] & (surface.edge_face_count[edges] == 2)]
    around_point = faces_around(surface, np.unique(surface.edges[edges]))
    for gone, into in np.concatenate([surface.edges[edges], surface.edges[edges][:, ::-1]]).tolist():
        around = around_point[gone]
        key = "collapse", surface.points[[gone, into, *surface.faces[around].ravel()]].tobytes()
        if key in failed:
            continue
        changed = np.where(surface.faces[around] == gone, into, surface.faces[around])
        changed = changed[(changed != np.roll(changed, 1, axis=1)).all(axis=1)]
        if reference.inverted(surface.points[changed]).sum() < turned[around].sum():
            faces = np.concatenate([np.delete(surface.faces, around, axis=0), changed]).astype(np.int32)
            return np.delete(surface.points, gone, axis=0), (faces - (faces > gone)).astype(np.int32)
        failed.add(key)
    return None


def _split(surface: Surface, turned: FaceMask, reference: ClosestPoints, failed: Failed) -> Mended:
    """Return the mesh with points more, in faces or on edges, that leave fewer turned triangles, or None."""
    points, faces = list(surface.points), surface.faces.copy()
    kept, taken = np.ones(len(faces), dtype=bool), np.zeros(len(faces), dtype=bool)
    added: list[npt.NDArray[np.int32]] = []
    for gone, loop, start, lift in _stars(surface, turned):
        key = f"split {turned[gone].tolist()}", surface.points[loop].tobytes()
        if taken[gone].any() or key in failed:
            continue
        facet, weights = reference.locate(start + np.outer(_LIFTS, lift))
        places = np.einsum("nc,ncx->nx", weights, reference.surface.points[reference.surface.faces[facet]])
        ring = surface.points[[[u, v] for u, v in zip(loop, loop[1:] + loop[:1], strict=True)]]
        trials = np.stack(
            [np.concatenate([ring, np.broadcast_to(place, (len(loop), 1, 3))], axis=1) for place in places]
        )
        count = reference.inverted(trials.reshape(-1, 3, 3)).reshape(len(places), -1).sum(axis=1)
        best = int(np.argmin(count))
        if count[best] >= turned[gone].sum():
            failed.add(key)
            continue
        new = [[u, v, len(points)] for u, v in zip(loop, loop[1:] + loop[:1], strict=True)]
        added.append(np.array(new, dtype=np.int32))
        points.append(places[best])
        kept[gone] = False
        taken[gone] = True
    return (np.array(points), np.concatenate([faces[kept], *added])) if added else None


def _stars(
    surface: Surface, turned: FaceMask
) -> Iterator[tuple[list[int], list[int], npt.NDArray[np.float64], npt.NDArray[np.float64]]]:
    """Yield where a new point can go: faces it replaces, the loop around them, a place, and a way off the surface."""
    points = surface.points
    for face in np.flatnonzero(turned).tolist():
        loop = surface.faces[face].tolist()
        yield [face], loop, points[loop].mean(axis=0), surface.face_normals[face] * np.sqrt(surface.face_areas[face])
        for corner in range(3):
            other = int(surface.face_neighbours[face, corner])
            if other < 0:
                continue
            a, x, y = (loop[(corner + k) % 3] for k in range(3))
            b = int(surface.faces[other].sum()) - x - y
            out = geometry.unit(surface.point_normals[x] + surface.point_normals[y])
            yield [face, other], [a, x, b, y], points[[x, y]].mean(axis=0), out * np.linalg.norm(points[x] - points[y])
