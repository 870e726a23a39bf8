"""The boundary of a mesh brought onto anchors: prescribed vertices, and stretches with prescribed edges."""

from __future__ import annotations

import numpy as np

from anisomesh.mesh import geometry
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.meshops.anchoring.lined_mesh import LinedMesh, Step, disjoint
from anisomesh.meshops.anchoring.loops import Stops, SurfaceBoundary
from anisomesh.meshops.anchors import Anchors
from anisomesh.meshops.change import Change, Floats, Ints
from anisomesh.meshops.engine import is_sound_in_shape

_MAX_OUTLINE_ROUNDS = 60  # of insertions, and of collapses
_NEAR_STOP = 0.3  # of the distance to the next stop, up to which a point off the outline moves to an anchor; heuristic

Listed = list[tuple[Step, Ints]]


def conform_boundary(mesh: LinedMesh, anchors: Anchors, reference: ClosestPoints) -> LinedMesh:
    """Return a mesh whose boundary has the anchors that are on the boundary of a surface, and the outline.

    Parameters
    ----------
    mesh
        An oriented manifold mesh with the boundary loops of the surface.
    anchors
        The anchors.
    reference
        The surface.

    Notes
    -----
    Points and anchors are put in order along each loop. The point nearest to a missing anchor moves there, if no
    triangle gets inverted or thin; for the others the edge of the boundary is split. Then points between consecutive
    anchors of the outline are collapsed into their neighbours on the boundary. A collapse that the link condition
    forbids becomes possible when the edge in its way has been split.
    """
    boundary = SurfaceBoundary(reference.surface, anchors)
    for steps_of in (_insertions, _collapses):
        for _ in range(_MAX_OUTLINE_ROUNDS):
            listed = [each for stops in boundary.stops(mesh.surface) for each in steps_of(mesh, stops, reference)]
            if not listed:
                break
            mesh = mesh.after(disjoint(mesh, listed))
    return mesh


def _insertions(mesh: LinedMesh, stops: Stops, reference: ClosestPoints) -> Listed:
    """Return the steps that bring missing anchors of a loop into the mesh, each with the faces that it concerns."""
    found: Listed = []
    present = np.flatnonzero(~stops.missing)
    following = np.append(present[1:], len(stops.point))
    for start, end in zip(present.tolist(), following.tolist(), strict=True):
        if end - start == 1:
            continue
        tail, head = int(stops.point[start]), int(stops.point[end % len(stops.point)])
        step = _move(mesh, stops, start, start + 1, reference) or _move(mesh, stops, end, end - 1, reference)
        if step is None:
            step = _boundary_split(mesh, tail, head, stops.places[start + 1 : end])
        found.append((step, np.concatenate([mesh.star(tail), mesh.star(head)])))
    return found


def _move(mesh: LinedMesh, stops: Stops, stop: int, anchor: int, reference: ClosestPoints) -> Step | None:
    """Return the move of the point at a stop to the missing anchor beside it; None if another one should go there."""
    n = len(stops.point)
    here, point = stop % n, int(stops.point[stop % n])
    if stops.anchored[here]:
        return None
    distance = abs(stops.arc[stop] - stops.arc[anchor])
    other = stop + (stop - anchor)  # the stop on the other side
    turn = stops.arc[-1]
    beyond = abs(stops.arc[stop] - stops.arc[other % n] - turn * (other // n))
    room = 1.0 if stops.outlined[here] else _NEAR_STOP
    if distance > room * beyond:
        return None
    star, place = mesh.star(point), stops.places[anchor]
    change = Change(star, mesh.surface.faces[star].astype(np.int64), np.array([point]), place[None])
    if not is_sound_in_shape(*mesh.on_patch(change, reference)):
        return None
    return Step(change=change, replaced=point, place=place)


def _boundary_split(mesh: LinedMesh, tail: int, head: int, places: Floats) -> Step:
    """Return the split of the boundary edge from ``tail`` to ``head`` at places (n, 3), in this order."""
    star, faces = mesh.star(tail), mesh.surface.faces[mesh.star(tail)].astype(np.int64)
    side = (faces == tail) & (np.roll(faces, -1, axis=1) == head)
    face = int(np.flatnonzero(side.any(axis=1))[0])
    opposite = int(faces[face].sum() - tail - head)
    new = np.arange(len(places)) + mesh.surface.n_points
    chain = np.concatenate([[tail], new, [head]])
    triangles = np.stack([chain[:-1], chain[1:], np.full(len(chain) - 1, opposite)], axis=1)
    return Step(change=Change(star[face : face + 1], triangles, new, places))


def _collapses(mesh: LinedMesh, stops: Stops, reference: ClosestPoints) -> Listed:
    """Return the steps that take surplus points of a loop away, each with the faces that it concerns."""
    found: Listed = []
    n = len(stops.point)
    for k in np.flatnonzero(stops.surplus).tolist():
        gone, sides = int(stops.point[k]), (int(stops.point[k - 1]), int(stops.point[(k + 1) % n]))
        options = [(into, _collapse(mesh, gone, into)) for into in sides]
        possible = [(into, change) for into, change in options if change is not None]
        if not possible:
            step = _way_made(mesh, gone, sides)
            if step is not None:
                around = [mesh.star(point) for point in (gone, *sides)]
                found.append((step, np.concatenate(around)))
            continue
        best = max(possible, key=lambda option: _merit(mesh, option[1], reference))
        into, change = best
        step = Step(change=change, replaced=gone, place=mesh.surface.points[into])
        found.append((step, np.concatenate([mesh.star(gone), mesh.star(into)])))
    return found


def _collapse(mesh: LinedMesh, gone: int, into: int) -> Change | None:
    """Return the collapse of a point of the boundary into its neighbour there; None if that is impossible."""
    star = mesh.star(gone)
    faces = mesh.surface.faces[star].astype(np.int64)
    left = faces[(faces != into).all(axis=1)]
    common = mesh.neighbours(gone) & mesh.neighbours(into)
    if len(common) != 1 or len(faces) - len(left) != 1 or len(mesh.star(into)) + len(faces) <= 2:
        return None
    if len(left) == 0:  # an ear: the face behind it is listed, so that its corners count as used
        behind = int(mesh.surface.face_neighbours[star[0], np.argmax(faces[0] == gone)])
        return Change(np.append(star, behind), mesh.surface.faces[[behind]].astype(np.int64))
    return Change(star, np.where(left == gone, into, left))


def _merit(mesh: LinedMesh, change: Change, reference: ClosestPoints) -> tuple[bool, float]:
    """Return whether a change is sound, and the thickness of its thinnest triangle."""
    thinnest = geometry.thickness(change.corners(mesh.surface.points)).min(initial=np.inf)
    return is_sound_in_shape(*mesh.on_patch(change, reference)), float(thinnest)


def _way_made(mesh: LinedMesh, gone: int, sides: tuple[int, int]) -> Step | None:
    """Return the split of an edge in the way of both collapses of a point, None if no edge is in the way."""
    surface = mesh.surface
    for into in sides:
        triangle = surface.faces[mesh.star(gone)]
        beside = set(triangle[(triangle == into).any(axis=1)].ravel().tolist())
        for other in (mesh.neighbours(gone) & mesh.neighbours(into)) - beside:
            for edge in (mesh.edge(gone, other), mesh.edge(into, other)):
                if surface.edge_face_count[edge] == 2:
                    return mesh.split(edge, surface.points[surface.edges[edge]].mean(axis=0))
    return None
