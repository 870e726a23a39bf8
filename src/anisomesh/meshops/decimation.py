"""Quadric decimation: a surface with fewer points, near it and of the same topology."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from anisomesh._arrays import PointMask
from anisomesh._kernels import decimate as kernels
from anisomesh._kernels.heap import EdgeHeap
from anisomesh._kernels.stars import Stars
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.marked_surface import MarkedSurface
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.mesh.validity import inverted_faces

_STAR_ROOM = 4_096  # faces around a point; a point with more, as in the middle of a fan, stays
_MAX_REPEATS = 4  # with points held where triangles were inverted
_HEAP_ROOM = 12  # entries for each point, half of which are all edges at the start

EdgeEnds = npt.NDArray[np.int64]


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
    reference: ClosestPoints | None = None,
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
        Ends of edges along creases (n, 2): points on them only go along them, and stay where they end or meet.
    reference
        A surface against which no more triangles are to be inverted than there are.

    Notes
    -----
    Edges are collapsed in the order of their quadrics, sums of squared distances to the planes of the faces and, at
    the boundary and creases, to walls on the edges; the new point is where these are lowest. A collapse is made if it
    fulfils the link condition, tilts no triangle by more than 78 degrees, and makes none thin. So topology,
    orientation and boundary loops stay, but triangles may intersect each other. Where some are inverted against the
    reference, the points there are held, and all is done again, at most four times.

    References
    ----------
    Garland, Heckbert, "Surface simplification using quadric error metrics", 1997. Dey, Edelsbrunner, Guha, Nekhayev,
    "Topology preserving edge contraction", 1999.
    """
    creases = np.zeros((0, 2), dtype=np.int64) if crease_edges is None else crease_edges
    stays = np.zeros(surface.n_points, dtype=bool) if held is None else np.array(held)
    result = _collapsed(surface, n_points, stays, creases)
    if reference is None:
        return result
    n_before = np.count_nonzero(inverted_faces(surface, reference))
    for _ in range(_MAX_REPEATS):
        inverted = inverted_faces(result.surface, reference)
        if np.count_nonzero(inverted) <= n_before:
            break
        places = result.surface.points[np.unique(result.surface.faces[inverted])]
        stays[cKDTree(surface.points).query(places)[1]] = True
        result = _collapsed(surface, n_points, stays, creases)
    return result


def _collapsed(surface: Surface, n_points: int, held: PointMask, creases: EdgeEnds) -> Decimated:
    """Return a surface with edges collapsed until a number of points is left or none can go."""
    surplus = surface.n_points - n_points
    if surplus <= 0:
        return Decimated(surface=surface, crease_edges=creases)
    state = _arrays(surface, held, creases)
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


def _arrays(surface: Surface, held: PointMask, creases: EdgeEnds) -> kernels.Decimation:
    """Return the arrays that the kernels work on."""
    n = surface.n_points
    labels = np.isin(edge_keys(surface.edges), edge_keys(creases)).astype(np.int32)
    on_line = np.array(surface.on_boundary)
    on_line[creases] = True
    face_at = np.zeros(n, dtype=np.int32)
    face_at[surface.faces] = np.arange(surface.n_faces, dtype=np.int32)[:, None]
    size = _HEAP_ROOM * n
    faces, corners, other_faces, other_corners = np.zeros((4, _STAR_ROOM), dtype=np.int32)
    return kernels.Decimation(
        mesh=MarkedSurface.unmoved(surface, labels).triangulation(surface.n_faces),
        quadrics=np.zeros((n + 1, 10)),
        held=(ends_of_creases(creases, n) | held).astype(np.uint8),
        on_line=on_line.astype(np.uint8),
        face_at=face_at,
        changed=np.zeros(n, dtype=np.int64),
        heap=EdgeHeap(np.empty(size), np.empty((size, 2), dtype=np.int32), np.empty(size, dtype=np.int64)),
        stars=Stars(faces, corners, other_faces, other_corners, np.zeros(n, dtype=np.uint8)),
    )
