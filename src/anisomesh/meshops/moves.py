"""Moves of points within the boundary that turn back triangles that face away from the surface."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceMask, Faces, Points
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface

_NUDGES = (0.02, 0.05, 0.1, 0.2, 0.4)  # trial steps of a point, in lengths of the edges there
_SWEEPS = 10

Ints = npt.NDArray[np.int64]
Places = Callable[[Surface, int, Ints, ClosestPoints], Points]
Mended = tuple[Points, Faces] | None
Failed = set[tuple[str, bytes]]
"""Names of mends, and the places of what they were tried on in vain: it need not be tried again as it is."""


def to_average(surface: Surface, turned: FaceMask, reference: ClosestPoints, failed: Failed) -> Mended:
    """Return the mesh after moves of points to the average of their neighbours that leave fewer turned triangles."""
    return _move(surface, turned, reference, failed, _averages)


def nudge(surface: Surface, turned: FaceMask, reference: ClosestPoints, failed: Failed) -> Mended:
    """Return the mesh after small moves of points that leave fewer turned triangles, None if there is none."""
    return _move(surface, turned, reference, failed, _nudges)


def wander(surface: Surface, turned: FaceMask, reference: ClosestPoints, rng: np.random.Generator) -> Points:
    """Return the points after a random small move of one of them that leaves as many turned triangles as before."""
    for face in np.flatnonzero(turned).tolist():
        movable = surface.faces[face][~surface.on_boundary[surface.faces[face]]]
        if len(movable) == 0:
            continue
        point = int(rng.choice(movable))
        around = np.flatnonzero((surface.faces == point).any(axis=1))
        ring = np.setdiff1d(surface.faces[around], [point])
        places = _nudges(surface, point, ring, reference)
        same = np.flatnonzero(
            _turned_after(surface.points, surface.faces[around], point, places, reference) == turned[around].sum()
        )
        if len(same):
            points = surface.points.copy()
            points[point] = places[rng.choice(same)]
            return points
    return surface.points


def relax(surface: Surface, turned: FaceMask, reference: ClosestPoints, failed: Failed) -> Mended:
    """Return the mesh after sweeps of smoothing around the turned triangles, None if none of them helps."""
    near = np.zeros(surface.n_points, dtype=bool)
    near[surface.faces[turned]] = True
    near[surface.faces[near[surface.faces].any(axis=1)]] = True
    near &= ~surface.on_boundary
    key = "relax", surface.points[near].tobytes()
    if not near.any() or key in failed:
        return None
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
        if reference.inverted(points[surface.faces[around]]).sum() < turned.sum():
            return points, surface.faces
    failed.add(key)
    return None


def _move(surface: Surface, turned: FaceMask, reference: ClosestPoints, failed: Failed, places_of: Places) -> Mended:
    """Return the mesh after moves to other places that leave fewer turned triangles, None if there is none."""
    points = surface.points.copy()
    candidates = np.unique(surface.faces[turned])
    candidates = candidates[~surface.on_boundary[candidates]]
    around_point = faces_around(surface, candidates)
    blocked: set[int] = set()
    for point in candidates.tolist():
        around = around_point[point]
        ring = np.setdiff1d(surface.faces[around], [point])
        if blocked & {point, *ring.tolist()}:
            continue
        key = places_of.__name__, np.concatenate([points[point], points[surface.faces[around]].ravel()]).tobytes()
        if key in failed:
            continue
        places = places_of(surface, point, ring, reference)
        count = _turned_after(points, surface.faces[around], point, places, reference)
        best = int(np.argmin(count))
        if count[best] < turned[around].sum():
            points[point] = places[best]
            blocked |= {point, *ring.tolist()}
        else:
            failed.add(key)
    return (points, surface.faces) if blocked else None


def faces_around(surface: Surface, points: npt.NDArray[np.integer]) -> dict[int, Ints]:
    """Return the faces at each of these points (n,)."""
    wanted = np.zeros(surface.n_points, dtype=bool)
    wanted[points] = True
    corner = np.flatnonzero(wanted[surface.faces.ravel()])
    point = surface.faces.ravel()[corner]
    order = np.argsort(point, kind="stable")
    names, first = np.unique(point[order], return_index=True)
    if len(names) == 0:
        return {}
    return dict(zip(names.tolist(), np.split(corner[order] // 3, first[1:]), strict=True))


def _turned_after(points: Points, faces: Faces, point: int, places: Points, reference: ClosestPoints) -> Ints:
    """Return how many of the faces (F, 3) at a point are turned with the point at each of the places (n, 3)."""
    at_point = (faces == point)[:, :, None]
    trials = np.stack([np.where(at_point, place, points[faces]) for place in places])
    return np.asarray(reference.inverted(trials.reshape(-1, 3, 3)).reshape(len(places), -1).sum(axis=1))


def _averages(surface: Surface, point: int, ring: Ints, reference: ClosestPoints) -> Points:
    """Return places (n, 3) for a point: the average of its neighbours, half way there, and that on the surface."""
    average = surface.points[ring].mean(axis=0)
    facet, weights = reference.locate(average[None])
    on_surface = weights[0] @ reference.surface.points[reference.surface.faces[facet[0]]]
    return np.stack([on_surface, average, 0.5 * (average + surface.points[point])])


def _nudges(surface: Surface, point: int, ring: Ints, reference: ClosestPoints) -> Points:
    """Return places (n, 3) around a point: towards each neighbour, off that way, and along the normal."""
    to_ring = surface.points[ring] - surface.points[point]
    normal = surface.point_normals[point] * np.linalg.norm(to_ring, axis=1).mean()
    steps = np.concatenate([to_ring, to_ring + normal, to_ring - normal, [normal, -normal]])
    return np.concatenate([surface.points[point] + share * steps for share in _NUDGES])
