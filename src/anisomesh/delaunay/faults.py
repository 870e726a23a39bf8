"""New sites near the faults of a mesh."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from anisomesh._arrays import EmbeddedPoints, Sites
from anisomesh.delaunay.creases import MIN_SITE_DISTANCE
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.embedded_surface import EmbeddedSurface


def points_at_faults(
    corners: npt.NDArray[np.float64],
    reference: ClosestPoints,
    embedded: EmbeddedSurface,
    sites: Sites,
    spacing: float,
) -> EmbeddedPoints:
    """Return points of the embedded surface (m, d) at faulty triangles, to become sites.

    Parameters
    ----------
    corners
        The triangles in space (n, 3, 3).
    reference
        Closest points of the embedded surface in space.
    embedded
        The embedded surface.
    sites
        Present sites (S, d).
    spacing
        Distance between them.

    Notes
    -----
    The points are the ones closest to corners, edge midpoints and barycentres; points too near to others are left out.
    """
    places = np.concatenate([corners, 0.5 * (corners + corners[:, [1, 2, 0]]), corners.mean(axis=1, keepdims=True)], 1)
    facet, weights = reference.locate(places.reshape(-1, 3))
    points = embedded.at(facet, weights)
    points = points[cKDTree(sites).query(points)[0] > MIN_SITE_DISTANCE * spacing]
    near = cKDTree(points).query_pairs(MIN_SITE_DISTANCE * spacing, output_type="ndarray")
    return np.delete(points, near[:, 1], axis=0)  # the later one of each pair
