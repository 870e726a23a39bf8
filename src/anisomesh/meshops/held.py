"""Which points of a mesh stay: at prescribed places, or where a changed mesh is faulty."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from anisomesh._arrays import FaceLabels, FaceMask, PointMask, Points
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import with_neighbours


@dataclass(frozen=True, eq=False)
class Held:
    """What stays of a mesh while it is changed.

    Attributes
    ----------
    places
        Places (n, 3) of points that stay.
    n_faces
        Number of faces that stay: the first ones.
    """

    places: Points = field(default_factory=lambda: np.zeros((0, 3)))
    n_faces: int = 0


def at_places(points: Points, places: Points) -> PointMask:
    """Return which points (V,) are at one of some places (n, 3), to the last digit."""
    if len(places) == 0:
        return np.zeros(len(points), dtype=bool)
    own, wanted = (
        np.ascontiguousarray(array + 0.0).view(np.dtype((np.void, 24))).ravel() for array in (points, places)
    )
    return np.asarray(np.isin(own, wanted))


def points_near_faces(before: Surface, after: Surface, faces: FaceLabels | FaceMask, *, rings: int) -> PointMask:
    """Return which points of a mesh (V,) are nearest to corners of some faces of a changed one, or near these.

    Parameters
    ----------
    before, after
        The mesh before and after the change.
    faces
        Faces after the change, as numbers (n,) or as a mask (F,).
    rings
        Rings of neighbours of the nearest points that are added.
    """
    near = np.zeros(before.n_points, dtype=bool)
    near[cKDTree(before.points).query(after.points[np.unique(after.faces[faces])])[1]] = True
    for _ in range(rings):
        near = with_neighbours(before.faces, near)
    return near
