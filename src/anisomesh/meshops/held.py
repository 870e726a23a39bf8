"""Which points to hold where a changed mesh is faulty."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from anisomesh._arrays import FaceLabels, FaceMask, PointMask
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import with_neighbours


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
