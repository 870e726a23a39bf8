"""Closed components of the surface with too few cells for the dual to have their topology."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import EmbeddedPoints
from anisomesh.mesh.topology import connected_components
from anisomesh.voronoi.cells import CellComplex

MIN_CELLS = 4  # of a closed component: a tetrahedron; the dual of three is two triangles back to back


def points_in_small_components(cells: CellComplex) -> EmbeddedPoints:
    """Return points (n, d) to become sites, so that every closed component of the surface has at least four cells.

    Each is the point of the surface farthest from the sites on its component and from the points before it.
    """
    diagram, surface = cells.diagram, cells.embedded.surface
    count, component = connected_components(surface.faces, surface.n_points)
    cell_component = np.empty(cells.n_components, dtype=np.int64)
    cell_component[cells.of_polygon] = component[diagram.facet]
    n_cells = np.bincount(cell_component, minlength=count)
    is_open = np.bincount(component, (surface.face_neighbours < 0).any(axis=1), minlength=count) > 0
    chosen = []
    for name in np.flatnonzero(~is_open & (n_cells < MIN_CELLS)).tolist():
        points = diagram.points[np.unique(surface.faces[component == name])]
        present = diagram.sites[cells.site[cell_component == name]]
        distance = np.linalg.norm(points[:, None] - present[None], axis=2).min(axis=1)
        for _ in range(MIN_CELLS - len(present)):
            chosen.append(points[np.argmax(distance)])
            distance = np.minimum(distance, np.linalg.norm(points - chosen[-1], axis=1))
    return np.array(chosen).reshape(-1, cells.embedded.dimension)
