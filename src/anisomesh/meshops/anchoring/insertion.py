"""Vertices of a mesh at prescribed places off its boundary."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from anisomesh._arrays import Points
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.meshops.anchoring.lined_mesh import LinedMesh, Step, disjoint
from anisomesh.meshops.anchors import Anchors
from anisomesh.meshops.change import Change, Floats, Ints
from anisomesh.meshops.engine import is_sound
from anisomesh.meshops.held import at_places
from anisomesh.meshops.split import face_split

_MAX_INSERTIONS = 30  # of insertions; each has at least one for every face that places are on
_NEAR_CORNER = 0.5  # barycentric coordinate of a place from which on the corner may move there
_NEAR_SIDE = 0.15  # barycentric coordinate up to which the side is split in place of the face; heuristic


def insert_places(mesh: LinedMesh, places: Points, anchors: Anchors, reference: ClosestPoints) -> LinedMesh:
    """Return a mesh with vertices at places.

    Parameters
    ----------
    mesh
        An oriented manifold mesh.
    places
        Points of the reference (n, 3) off its boundary.
    anchors
        Vertices at these do not move.
    reference
        The surface that the mesh approximates.

    Notes
    -----
    The nearest vertex moves to a place, if no triangle gets inverted or thin and it is neither held nor on a line or
    the boundary. Otherwise the side or the face that the place is on is split there.
    """
    for _ in range(_MAX_INSERTIONS):
        missing = places[~at_places(places, mesh.surface.points)]
        if len(missing) == 0:
            break
        held = anchors.held_in(mesh.surface.points) | mesh.on_line | mesh.surface.on_boundary
        facets, weights = _on_sheet(mesh, missing, reference)
        found = []
        for place, facet, weight in zip(missing, facets.tolist(), weights, strict=True):
            step = _step(mesh, place, facet, weight, held, reference)
            found.append((step, step.change.gone))
        mesh = mesh.after(disjoint(mesh, found))
    return mesh


def _on_sheet(mesh: LinedMesh, places: Points, reference: ClosestPoints) -> tuple[Ints, Floats]:
    """Return the face (n,) nearest to each place and the barycentric coordinates (n, 3) there.

    It is a face of the sheet that faces the way of the reference at the place, if that is found above it.
    """
    normals = reference.normals(places)
    closest = ClosestPoints(mesh.surface)
    facets, weights = closest.locate(places)
    opposed = np.flatnonzero(np.einsum("nx,nx->n", mesh.surface.face_normals[facets], normals) < 0.0)
    if len(opposed):
        distance = np.sqrt(closest.squared_distances(places[opposed]))
        above = places[opposed] + 2.0 * distance[:, None] * normals[opposed]
        other, other_weights = closest.locate(above)
        agrees = np.einsum("nx,nx->n", mesh.surface.face_normals[other], normals[opposed]) > 0.0
        facets[opposed[agrees]], weights[opposed[agrees]] = other[agrees], other_weights[agrees]
    return facets, weights


def _step(mesh: LinedMesh, place: Floats, facet: int, weights: Floats, held: Ints, reference: ClosestPoints) -> Step:
    """Return the step that brings a vertex to a place on a face: the first sound one, or else a split."""
    steps = list(_steps(mesh, place, facet, weights, held))
    for step in steps:
        if is_sound(*mesh.on_patch(step.change, reference)):
            return step
    return steps[-1]


def _steps(mesh: LinedMesh, place: Floats, facet: int, weights: Floats, held: Ints) -> Iterator[Step]:
    """Yield ways to bring a vertex to a place on a face: a move of its nearest corner, splits of a side and of it."""
    surface = mesh.surface
    corner = int(np.argmax(weights))
    point = int(surface.faces[facet, corner])
    if weights[corner] > _NEAR_CORNER and not held[point]:
        star = mesh.star(point)
        change = Change(star, surface.faces[star].astype(np.int64), np.array([point]), place[None])
        yield Step(change=change, replaced=point, place=place)
    side = int(np.argmin(weights))
    edge = int(surface.face_edges[facet, side])
    inside = surface.edge_face_count[edge] == 2
    if inside and weights[side] <= _NEAR_SIDE:
        yield mesh.split(edge, place)
    yield Step(change=face_split(surface, facet, place))
    if inside and weights[side] <= 0.0:
        yield mesh.split(edge, place)
