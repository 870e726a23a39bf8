"""A mesh brought onto its anchors: the boundary first, then the places inside."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import EdgeEnds, Faces, Points
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.meshops.anchoring.insertion import insert_places
from anisomesh.meshops.anchoring.lined_mesh import LinedMesh
from anisomesh.meshops.anchoring.outline import conform_boundary
from anisomesh.meshops.anchors import Anchors
from anisomesh.meshops.held import at_places


def anchored(
    points: Points, faces: Faces, crease_edges: EdgeEnds, anchors: Anchors, reference: ClosestPoints
) -> tuple[Points, Faces, EdgeEnds] | None:
    """Return a mesh with vertices at all anchors and with the edges of the outline on its boundary.

    Parameters
    ----------
    points, faces
        An oriented manifold mesh (V, 3), (F, 3) of the topology of the reference.
    crease_edges
        Ends of its edges along creases (n, 2).
    anchors
        The anchors, which are points of the reference.
    reference
        The surface that the mesh approximates.

    Returns
    -------
    points, faces, crease_edges
        The mesh, which may have more points and inverted triangles; None if it has not all anchors.
    """
    if anchors.are_in(points, faces):
        return points, faces, crease_edges
    surface = reference.surface
    mesh = conform_boundary(LinedMesh.of(points, faces, crease_edges), anchors, reference)
    inside = anchors.places[~at_places(anchors.places, surface.points[surface.on_boundary])]
    mesh = insert_places(mesh, inside, anchors, reference)
    if not anchors.are_in(mesh.surface.points, mesh.surface.faces):
        return None
    return mesh.surface.points, mesh.surface.faces, np.unique(mesh.line_edges, axis=0)
