"""Where triangles of the dual are turned, flat or intersect, and sites there."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from anisomesh._arrays import EmbeddedPoints, Faces, Points, Sites
from anisomesh.delaunay.creases import APART
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.geometry import is_flat
from anisomesh.mesh.intersections import self_intersections
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import crossing_facets, new_intersections
from anisomesh.voronoi.diagram import Diagram


def faulty_faces(points: Points, faces: Faces, reference: ClosestPoints) -> npt.NDArray[np.int64]:
    """Return the faces (n,) of a mesh that are flat, turned against the reference, or intersect where it does not."""
    bad = np.flatnonzero(is_flat(points[faces]) | reference.inverted(points[faces]))
    mesh = Surface(points, faces)
    if len(self_intersections(mesh)) == 0:  # most often, and without a search for those of the reference
        return bad
    return np.union1d(bad, new_intersections(mesh, crossing_facets(reference.surface)))


def points_at_faults(
    corners: npt.NDArray[np.float64],
    reference: ClosestPoints,
    diagram: Diagram,
    sites: Sites,
    spacing: float,
) -> EmbeddedPoints:
    """Return points of the embedded surface (m, d) at triangles, to become sites.

    Parameters
    ----------
    corners
        The triangles in space (n, 3, 3).
    reference
        The surface in space, its faces in the order of the diagram.
    diagram
        A diagram over the embedded surface.
    sites
        Those that there are (S, d).
    spacing
        Distance between them.

    Notes
    -----
    The points are those closest to corners, middles of edges and barycentres, less those that would be near others.
    """
    places = np.concatenate([corners, 0.5 * (corners + corners[:, [1, 2, 0]]), corners.mean(axis=1, keepdims=True)], 1)
    facet, weights = reference.locate(places.reshape(-1, 3))
    points = diagram.at(facet, weights)
    points = points[cKDTree(sites).query(points)[0] > APART * spacing]
    near = cKDTree(points).query_pairs(APART * spacing, output_type="ndarray")
    return np.delete(points, near[:, 1], axis=0)  # the later one of each pair
