"""Quadric decimation of a surface, as a start of a fit."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import PointMask
from anisomesh._kernels import decimate as kernels
from anisomesh.mesh.marked_surface import MarkedSurface
from anisomesh.mesh.surface import Surface

_STAR_ROOM = 4_096  # faces around a point; a point with more, as in the middle of a fan, stays
_HEAP_ROOM = 12  # entries for each point, half of which are all edges at the start


def decimated(surface: Surface, n_points: int, held: PointMask) -> Surface | None:
    """Return a surface decimated to this many points, None if that is not possible.

    Parameters
    ----------
    surface
        An oriented manifold surface.
    n_points
        Number of points of the result, at most as many as the surface has.
    held
        Points (V,) that stay.

    Notes
    -----
    Edges are collapsed in the order of their quadrics, sums of squared distances to the planes of the faces and, at
    the boundary, to walls on its edges. A collapse is made if it fulfils the link condition, tilts no triangle by more
    than 78 degrees, and makes none thin. Triangles may intersect each other.

    References
    ----------
    Garland, Heckbert, "Surface simplification using quadric error metrics", 1997. Dey, Edelsbrunner, Guha, Nekhayev,
    "Topology preserving edge contraction", 1999.
    """
    wanted = surface.n_points - n_points
    if wanted < 0:
        return None
    mesh = MarkedSurface.unmoved(surface, np.zeros(len(surface.edges), dtype=np.int32)).triangulation(surface.n_faces)
    face_at = np.zeros(surface.n_points, dtype=np.int32)
    face_at[surface.faces] = np.arange(surface.n_faces, dtype=np.int32)[:, None]
    size = _HEAP_ROOM * surface.n_points
    state = kernels.Decimation(
        mesh=mesh,
        quadrics=np.zeros((surface.n_points + 1, 10)),
        held=held.astype(np.uint8),
        at_boundary=surface.on_boundary.astype(np.uint8),
        face_at=face_at,
        changed=np.zeros(surface.n_points, dtype=np.int64),
        costs=np.empty(size),
        ends=np.empty((size, 2), dtype=np.int32),
        made=np.empty(size, dtype=np.int64),
        stars=np.zeros((4, _STAR_ROOM), dtype=np.int32),
        marks=np.zeros(surface.n_points, dtype=np.uint8),
    )
    kernels.set_quadrics(state)
    if kernels.decimate(state, wanted) < wanted:
        return None
    used, position = np.unique(mesh.faces[mesh.faces[:, 0] >= 0], return_inverse=True)
    return Surface(mesh.points[used], position.reshape(-1, 3).astype(np.int32))
