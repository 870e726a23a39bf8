"""Closed components with too few cells for the dual to have their topology."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import EmbeddedPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import connected_components
from anisomesh.voronoi.cells import Cells
from anisomesh.voronoi.diagram import Diagram

MIN_CELLS = 4  # of a closed component: with three the dual is two triangles back to back, with fewer it has none


def points_in_components(diagram: Diagram, cells: Cells, surface: Surface) -> EmbeddedPoints:
    """Return points (n, d) of the closed components with fewer than four cells, so that they have four.

    They are points of the surface, each the farthest from the sites there and those before it.
    """
    count, component = connected_components(surface.faces, surface.n_points)
    cell_component = np.empty(len(cells.site), dtype=np.int64)
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
    return np.array(chosen).reshape(-1, diagram.points.shape[1])
