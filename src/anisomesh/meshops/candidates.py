"""Changes to try for a fault: flips, moves of points, collapses and splits of edges, splits of faces, smoothing."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from anisomesh._arrays import Points
from anisomesh.mesh import geometry
from anisomesh.meshops.change import Change, Floats, Ints, Patch
from anisomesh.meshops.collapse import collapsible_edges
from anisomesh.meshops.flip import possible_flips
from anisomesh.meshops.split import edge_split, face_split

_NUDGES = (0.02, 0.05, 0.1, 0.2, 0.4)  # steps of a point, in lengths of the edges there; heuristic
_LIFTS = (-0.15, -0.05, 0.05, 0.15)  # steps of a point along its normal, in mean lengths of the edges there; heuristic
_SPLIT_HEIGHTS = (0.0, 0.1, 0.25, 0.5, 1.0)  # of a new point, in lengths of the edge or face; heuristic
_SMOOTHING_SWEEPS = 10  # heuristic


def flips(patch: Patch) -> list[Change]:
    """Return the flips of the edges of the fault, those with the thickest triangles first."""
    found = possible_flips(patch.surface, patch.fault_edges)
    corners = patch.surface.points[found.triangles].reshape(-1, 3, 3)
    thinnest = geometry.thickness(corners).reshape(-1, 2).min(axis=1)
    return [found.change(k) for k in np.argsort(-thinnest, kind="stable")]


def moves_to_average(patch: Patch) -> Iterator[Change]:
    """Yield moves of a corner to the average of its neighbours on the surface, off it, and half the way."""
    points, corners = patch.surface.points, patch.movable
    average = np.array([points[_ring(patch, corner)].mean(axis=0) for corner in corners]).reshape(-1, 3)
    nearest = on_surface(patch, average)
    for k, corner in enumerate(corners):
        yield from _moves(patch, corner, [nearest[k], average[k], 0.5 * (average[k] + points[corner])])


def moves_on_side(patch: Patch) -> Iterator[Change]:
    """Yield moves of a corner to its side of the surface, to the average of its neighbours, and along the normal."""
    points, corners = patch.surface.points, patch.movable
    rings = [points[_ring(patch, corner)] for corner in corners]
    average = np.array([ring.mean(axis=0) for ring in rings]).reshape(-1, 3)
    normals = patch.surface.point_normals[corners]
    on_side = points_on_side(patch, np.concatenate([points[corners], average]), np.tile(normals, (2, 1)))
    for k, corner in enumerate(corners):
        here, length = points[corner], np.linalg.norm(rings[k] - points[corner], axis=1).mean()
        lifted = [here + lift * length * normals[k] for lift in _LIFTS]
        middle = 0.5 * (here + average[k])
        yield from _moves(patch, corner, [on_side[k], on_side[len(corners) + k], middle, *lifted])


def nudges(patch: Patch) -> Iterator[Change]:
    """Yield small moves of a corner: towards each neighbour, the same off the surface, and along the normal."""
    for point in patch.movable:
        here = patch.surface.points[point]
        to_ring = patch.surface.points[_ring(patch, point)] - here
        normal = patch.surface.point_normals[point] * np.linalg.norm(to_ring, axis=1).mean()
        steps = np.concatenate([to_ring, to_ring + normal, to_ring - normal, [normal, -normal]])
        yield from _moves(patch, point, np.concatenate([here + share * steps for share in _NUDGES]))


def collapses(patch: Patch) -> Iterator[Change]:
    """Yield the collapses of the edges of the fault that take away a point that need not stay."""
    surface = patch.surface
    edges = patch.fault_edges[collapsible_edges(surface)[patch.fault_edges]]
    for gone, into in np.concatenate([surface.edges[edges], surface.edges[edges][:, ::-1]]).tolist():
        if not patch.stays[gone]:
            star = patch.star(gone)
            faces = surface.faces[star].astype(np.int64)
            yield Change(star, np.where(faces == gone, into, faces)[(faces != into).all(axis=1)])


def splits(patch: Patch) -> Iterator[Change]:
    """Yield splits of the faulty faces and their edges at points of the side of the surface that the mesh is on.

    On a thin sheet the middle of an edge can be closer to the other side, so the search starts at several heights.
    """
    surface = patch.surface
    for face in patch.fault.tolist():
        normal = surface.face_normals[face] * np.sqrt(surface.face_areas[face])
        for place in on_surface(patch, patch.corners[face].mean(axis=0) + np.outer(_SPLIT_HEIGHTS, normal)):
            yield face_split(surface, face, place)
    for edge in patch.fault_edges[surface.edge_face_count[patch.fault_edges] == 2].tolist():
        ends = surface.edges[edge]
        normal = geometry.unit(surface.point_normals[ends].sum(axis=0)) * surface.edge_lengths[edge]
        for place in on_surface(patch, surface.points[ends].mean(axis=0) + np.outer(_SPLIT_HEIGHTS, normal)):
            yield edge_split(surface, edge, place)


def edge_splits(patch: Patch) -> Iterator[Change]:
    """Yield splits of the edges of the fault at the point of the surface closest to the middle."""
    surface = patch.surface
    edges = patch.fault_edges[surface.edge_face_count[patch.fault_edges] == 2]
    middles, normals = (
        surface.points[surface.edges[edges]].mean(axis=1),
        surface.face_normals[surface.edge_faces[edges]],
    )
    places = points_on_side(patch, middles, normals.sum(axis=1))
    return (edge_split(surface, edge, place) for edge, place in zip(edges.tolist(), places, strict=True))


def smoothing(patch: Patch) -> Iterator[Change]:
    """Yield moves of all points that need not stay: one to ten sweeps of smoothing on the surface."""
    surface = patch.surface
    inner = np.flatnonzero(~patch.stays)
    if len(inner) == 0:
        return
    ends = np.concatenate([surface.edges, surface.edges[:, ::-1]])
    matrix = np.zeros((surface.n_points, surface.n_points))
    matrix[ends[:, 0], ends[:, 1]] = 1.0
    matrix = matrix[inner] / matrix[inner].sum(axis=1, keepdims=True)
    gone = np.flatnonzero(~patch.stays[surface.faces].all(axis=1))
    points = surface.points.copy()
    for _ in range(_SMOOTHING_SWEEPS):
        points[inner] = on_surface(patch, matrix @ points)
        yield Change(gone, surface.faces[gone].astype(np.int64), inner, points[inner])


def on_surface(patch: Patch, points: Points) -> Points:
    """Return the closest points (n, 3) of the reference."""
    facet, weights = patch.reference.locate(points)
    corners = patch.reference.surface.points[patch.reference.surface.faces[facet]]
    return np.asarray(np.einsum("nc,ncx->nx", weights, corners))


def points_on_side(patch: Patch, points: Points, normals: Floats) -> Points:
    """Return the closest points of the reference, or the points (n, 3) themselves where it faces the other way."""
    facet, weights = patch.reference.locate(points)
    corners = patch.reference.surface.points[patch.reference.surface.faces[facet]]
    facing = np.einsum("nx,nx->n", patch.reference.normals_at(facet, weights), normals) > 0.0
    return np.where(facing[:, None], np.einsum("nc,ncx->nx", weights, corners), points)


def _ring(patch: Patch, point: int) -> Ints:
    return np.array(sorted({*patch.surface.faces[patch.star(point)].ravel().tolist()} - {point}))


def _moves(patch: Patch, point: int, places: Floats | list[Floats]) -> Iterator[Change]:
    star = patch.star(point)
    faces = patch.surface.faces[star].astype(np.int64)
    for place in places:
        yield Change(star, faces, np.array([point]), place[None])
