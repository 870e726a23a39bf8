"""Turning back the triangles that face away from the surface: edge flips, moves of points, collapses."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh.dual.decimate import collapsible_edges
from anisomesh.dual.flip import do_flips, possible_flips
from anisomesh.surface import geometry
from anisomesh.surface.closest import ClosestPoints
from anisomesh.surface.mesh import Surface

MAX_ROUNDS = 60
_SWEEPS = 10
_LIFTS = (0.0, 0.1, 0.25, 0.5, 1.0)  # trial heights over an edge, in edge lengths
_NUDGES = (0.02, 0.05, 0.1, 0.2, 0.4)  # trial steps of a point, in lengths of the edges there

Ints = npt.NDArray[np.int64]


def untangle(points: Points, faces: Faces, reference: ClosestPoints) -> tuple[Points, Faces, int]:
    """Mend triangles that face away from the reference, without changing the topology.

    Parameters
    ----------
    points, faces
        An oriented manifold mesh (V, 3), (F, 3).
    reference
        The surface that it stands for.

    Returns
    -------
    points, faces, left
        The mended mesh and the number of turned triangles left.

    Notes
    -----
    In each round every turned triangle is given the flip of one of its edges, or else the move of one of its
    points to the average of its neighbours (on the surface or not) or by a small step, or else the collapse of one of
    its edges, or else a point in it or on one of its edges, lifted to the side of the surface that the mesh is on
    there (on a thin sheet a chord can come nearer to the other side), or else a few sweeps of smoothing around it.
    Taken is what leaves fewest turned triangles among those it changes, and only if their number falls, so the rounds
    end.
    """
    for _ in range(MAX_ROUNDS):
        surface = Surface(points, faces)
        turned = reference.turned(points[faces])
        if not turned.any():
            return points, faces, 0
        flipped = _flip(surface, turned, reference)
        if flipped is not None:
            faces = flipped
            continue
        moved = _move(surface, turned, reference, _averages)
        if moved is None:
            moved = _move(surface, turned, reference, _nudges)
        if moved is not None:
            points = moved
            continue
        changed = _collapse(surface, turned, reference) or _split(surface, turned, reference)
        if changed is not None:
            points, faces = changed
            continue
        relaxed = _relax(surface, turned, reference)
        if relaxed is None:
            break
        points = relaxed
    return points, faces, int(reference.turned(points[faces]).sum())


def _flip(surface: Surface, turned: npt.NDArray[np.bool_], reference: ClosestPoints) -> Faces | None:
    """Return the faces after edge flips that leave fewer turned triangles, None if there is none."""
    flips = possible_flips(surface, np.unique(surface.face_edges[turned]))
    corners = surface.points[flips.triangles].reshape(-1, 3, 3)
    change = reference.turned(corners).reshape(-1, 2).sum(axis=1) - turned[flips.pair].sum(axis=1)
    shape = geometry.thickness(corners).reshape(-1, 2).min(axis=1)
    order = np.lexsort((-shape, change))
    order = order[(change < 0)[order]]
    return do_flips(surface.faces, flips, order) if len(order) else None


def _averages(surface: Surface, point: int, ring: Ints, reference: ClosestPoints) -> Points:
    """Return places (n, 3) for a point: the average of its neighbours, half way there, and that on the surface."""
    average = surface.points[ring].mean(axis=0)
    facet, weights = reference.locate(average[None])
    on_surface = weights[0] @ reference.surface.points[reference.surface.faces[facet[0]]]
    return np.stack([on_surface, average, 0.5 * (average + surface.points[point])])


def _nudges(surface: Surface, point: int, ring: Ints, reference: ClosestPoints) -> Points:
    """Return places (n, 3) around a point, the nearest first: towards each neighbour, and along the normal."""
    to_ring = surface.points[ring] - surface.points[point]
    normal = surface.point_normals[point] * np.linalg.norm(to_ring, axis=1).mean()
    steps = np.concatenate([to_ring, [normal, -normal]])
    return np.concatenate([surface.points[point] + share * steps for share in _NUDGES])


def _move(
    surface: Surface, turned: npt.NDArray[np.bool_], reference: ClosestPoints, places_of: Callable[..., Points]
) -> Points | None:
    """Return the points after moves to other places that leave fewer turned triangles, None if there is none."""
    points = surface.points.copy()
    faces_at: dict[int, list[int]] = {}
    candidates = np.unique(surface.faces[turned])
    for face in np.flatnonzero(np.isin(surface.faces, candidates).any(axis=1)).tolist():
        for point in surface.faces[face].tolist():
            faces_at.setdefault(point, []).append(face)
    blocked: set[int] = set()
    for point in candidates.tolist():
        around = np.array(faces_at[point])
        ring = np.setdiff1d(surface.faces[around], [point])
        if blocked & {point, *ring.tolist()}:
            continue
        places = places_of(surface, point, ring, reference)
        at_point = (surface.faces[around] == point)[:, :, None]
        trials = np.stack([np.where(at_point, place, points[surface.faces[around]]) for place in places])
        count = reference.turned(trials.reshape(-1, 3, 3)).reshape(len(places), -1).sum(axis=1)
        best = int(np.argmin(count))
        if count[best] < turned[around].sum():
            points[point] = places[best]
            blocked |= {point, *ring.tolist()}
    return points if blocked else None


def _collapse(surface: Surface, turned: npt.NDArray[np.bool_], reference: ClosestPoints) -> tuple[Points, Faces] | None:
    """Return the mesh after one collapse that leaves fewer turned triangles, None if there is none."""
    edges = np.unique(surface.face_edges[turned])
    edges = edges[collapsible_edges(surface)[edges] & (surface.edge_face_count[edges] == 2)]
    best: tuple[int, Faces] | None = None
    for gone, into in np.concatenate([surface.edges[edges], surface.edges[edges][:, ::-1]]).tolist():
        around = (surface.faces == gone).any(axis=1)
        changed = np.where(surface.faces[around] == gone, into, surface.faces[around])
        changed = changed[(changed != np.roll(changed, 1, axis=1)).all(axis=1)]
        gain = int(turned[around].sum() - reference.turned(surface.points[changed]).sum())
        if gain > 0 and (best is None or gain > best[0]):
            faces = np.concatenate([surface.faces[~around], changed]).astype(np.int32)
            best = gain, (faces - (faces > gone)).astype(np.int32)
            points = np.delete(surface.points, gone, axis=0)
    return (points, best[1]) if best is not None else None


def _split(surface: Surface, turned: npt.NDArray[np.bool_], reference: ClosestPoints) -> tuple[Points, Faces] | None:
    """Return the mesh with a point more, in a face or on an edge, that leaves fewer turned triangles, or None."""
    best: tuple[int, Points, Faces] | None = None
    m = surface.n_points
    for gone, loop, start, lift in _stars(surface, turned):
        facet, weights = reference.locate(start + np.outer(_LIFTS, lift))
        places = np.einsum("nc,ncx->nx", weights, reference.surface.points[reference.surface.faces[facet]])
        new = np.array([[u, v, m] for u, v in zip(loop, loop[1:] + loop[:1], strict=True)])
        for place in places:
            points = np.concatenate([surface.points, place[None]])
            gain = int(turned[gone].sum() - reference.turned(points[new]).sum())
            if gain > 0 and (best is None or gain > best[0]):
                faces = np.concatenate([np.delete(surface.faces, gone, axis=0), new]).astype(np.int32)
                best = gain, points, faces
    return best[1:] if best is not None else None


def _stars(
    surface: Surface, turned: npt.NDArray[np.bool_]
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


def _relax(surface: Surface, turned: npt.NDArray[np.bool_], reference: ClosestPoints) -> Points | None:
    """Return the points after sweeps of smoothing around the turned triangles, None if none of them helps."""
    near = np.zeros(surface.n_points, dtype=bool)
    near[surface.faces[turned]] = True
    near[surface.faces[near[surface.faces].any(axis=1)]] = True
    rows, columns = np.concatenate([surface.edges, surface.edges[:, ::-1]]).T
    rows, columns = rows[near[rows]], columns[near[rows]]
    count = np.bincount(rows, minlength=surface.n_points)[near]
    around = near[surface.faces].any(axis=1)
    points = surface.points.copy()
    for _ in range(_SWEEPS):
        sums = [np.bincount(rows, points[columns, axis], minlength=surface.n_points)[near] for axis in range(3)]
        facet, weights = reference.locate(np.stack(sums, axis=1) / count[:, None])
        corners = reference.surface.points[reference.surface.faces[facet]]
        points[near] = np.einsum("nc,ncx->nx", weights, corners)
        if reference.turned(points[surface.faces[around]]).sum() < turned.sum():
            return points
    return None
