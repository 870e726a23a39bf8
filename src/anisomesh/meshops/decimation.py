"""Quadric decimation: a surface with fewer points, near it and of the same topology."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh._arrays import EdgeEnds, EdgeLabels, PointMask
from anisomesh._kernels import decimate as kernels
from anisomesh._kernels.heap import EdgeHeap
from anisomesh._kernels.stars import Stars
from anisomesh.execution.deadline import NO_DEADLINE, Deadline
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.mesh.validity import inverted_faces
from anisomesh.meshops.held import points_near_faces
from anisomesh.working.marked_surface import MarkedSurface

_STAR_ROOM = 4_096  # faces around a point; a point with more, as in the middle of a fan, stays
_MAX_REPEATS = 4  # with points held where triangles were inverted
_LEAST_EVENNESS, _EVENNESS = 1e-9, 1e-3  # weight of squared lengths where points move, and where not; heuristic
_SHAPE_LIMITS = kernels.ShapeLimits(cosine=0.2, thickness=1e-4)  # heuristic
_HEAP_ROOM = 12  # entries for each point, half of which are all edges at the start


@dataclass(frozen=True, kw_only=True, eq=False)
class Decimated:
    """A decimated surface.

    Attributes
    ----------
    surface
        The surface.
    crease_edges
        Ends of its edges along creases (n, 2).
    """

    surface: Surface
    crease_edges: EdgeEnds


def decimate(
    surface: Surface,
    n_points: int,
    *,
    held: PointMask | None = None,
    crease_edges: EdgeEnds | None = None,
    moves: bool = True,
) -> Decimated:
    """Collapse edges, the cheapest first, until a number of points is left or none can go.

    Parameters
    ----------
    surface
        An oriented manifold surface.
    n_points
        Number of points wanted.
    held
        Points (V,) that stay.
    crease_edges
        Ends of edges along creases (n, 2): points on them only go along them, and stay where they end, meet or reach
        the boundary.
    moves
        Whether new points may be anywhere; if not, they are points of the surface, and short edges go first where
        distances are small: the mesh has good triangles that are to stay so.

    Notes
    -----
    Edges are collapsed in the order of their quadrics, sums of squared distances to the planes of the faces and, at
    the boundary and creases, to walls on the edges. The new point is where these are lowest; without moves, and on the
    boundary and on creases, it is one of the two before. A collapse is made if it fulfils the link condition, tilts no
    triangle by more than 78 degrees, and makes none thin. So topology, orientation and boundary loops stay, but
    triangles may intersect each other.

    References
    ----------
    Garland, Heckbert, "Surface simplification using quadric error metrics", 1997. Dey, Edelsbrunner, Guha, Nekhayev,
    "Topology preserving edge contraction", 1999.
    """
    creases = np.zeros((0, 2), dtype=np.int64) if crease_edges is None else crease_edges
    stays = np.zeros(surface.n_points, dtype=bool) if held is None else held
    return _collapsed(surface, n_points, stays, creases, moves=moves)


def decimate_facing(
    surface: Surface,
    n_points: int,
    reference: ClosestPoints,
    *,
    held: PointMask,
    crease_edges: EdgeEnds,
    deadline: Deadline = NO_DEADLINE,
) -> Decimated:
    """Collapse edges as :func:`decimate` does without moves, such that few triangles are inverted against a reference.

    Where some are, the points there are held, more each time, and all is done again, at most four times and as long as
    the number of points is reached. The deadline is asked before each repetition.
    """
    stays = np.array(held)
    best = result = _collapsed(surface, n_points, stays, crease_edges, moves=False)
    least = np.count_nonzero(inverted_faces(surface, reference))
    inverted = fewest = inverted_faces(result.surface, reference)
    for repeat in range(_MAX_REPEATS):
        if np.count_nonzero(fewest) <= least or result.surface.n_points > best.surface.n_points or deadline.passed():
            break
        stays |= points_near_faces(surface, result.surface, inverted, rings=repeat)
        result = _collapsed(surface, n_points, stays, crease_edges, moves=False)
        inverted = inverted_faces(result.surface, reference)
        if result.surface.n_points <= best.surface.n_points and inverted.sum() < fewest.sum():
            best, fewest = result, inverted
    return best


def _collapsed(surface: Surface, n_points: int, held: PointMask, creases: EdgeEnds, *, moves: bool) -> Decimated:
    """Return a surface with edges collapsed until a number of points is left or none can go."""
    surplus = surface.n_points - n_points
    if surplus <= 0:
        return Decimated(surface=surface, crease_edges=creases)
    labels = np.isin(edge_keys(surface.edges), edge_keys(creases)).astype(np.int32)
    ends = ends_of_creases(creases, surface.n_points)
    state = decimation_arrays(surface, held | ends, labels, moves=moves, heap_room=_HEAP_ROOM * surface.n_points)
    kernels.set_quadrics(state)
    kernels.decimate(state, surplus)
    alive = state.mesh.faces[:, 0] >= 0
    used, position = np.unique(state.mesh.faces[alive], return_inverse=True)
    result = Surface(state.mesh.points[used], position.reshape(-1, 3).astype(np.int32))
    labels = MarkedSurface.of(result, state.mesh, alive).labels
    return Decimated(surface=result, crease_edges=result.edges[labels != 0].astype(np.int64))


def ends_of_creases(crease_edges: EdgeEnds, n_points: int) -> PointMask:
    """Return which points (n_points,) creases (n, 2) end at or meet in, so that no collapse takes them."""
    count = np.bincount(crease_edges.ravel(), minlength=n_points)
    return np.asarray((count != 0) & (count != 2))


def decimation_arrays(
    surface: Surface,
    held: PointMask,
    labels: EdgeLabels,
    *,
    moves: bool,
    heap_room: int = 0,
    limits: kernels.ShapeLimits = _SHAPE_LIMITS,
) -> kernels.Decimation:
    """Return the arrays that the kernels work on, with room for entries in the heap of edges.

    Edges (E,) of another label than 0 form creases; ``held`` points (V,) stay, and so do points of the boundary on
    creases inside.
    """
    n = surface.n_points
    on_crease = np.zeros(n, dtype=bool)
    on_crease[surface.edges[(labels != 0) & (surface.edge_face_count != 1)]] = True
    face_at = np.zeros(n, dtype=np.int32)
    face_at[surface.faces] = np.arange(surface.n_faces, dtype=np.int32)[:, None]
    faces, corners, other_faces, other_corners = np.zeros((4, _STAR_ROOM), dtype=np.int32)
    return kernels.Decimation(
        mesh=MarkedSurface.unmoved(surface, labels).triangulation(surface.n_faces),
        quadrics=np.zeros((n + 1, 10)),
        held=((surface.on_boundary & on_crease) | held).astype(np.uint8),
        on_line=(surface.on_boundary | on_crease).astype(np.uint8),
        moves=moves,
        evenness=_LEAST_EVENNESS if moves else _EVENNESS,
        limits=limits,
        face_at=face_at,
        origin=np.arange(n, dtype=np.int32),
        changed=np.zeros(n, dtype=np.int64),
        heap=EdgeHeap(
            np.empty(heap_room), np.empty((heap_room, 2), dtype=np.int32), np.empty(heap_room, dtype=np.int64)
        ),
        stars=Stars(faces, corners, other_faces, other_corners, np.zeros(n, dtype=np.uint8)),
    )
