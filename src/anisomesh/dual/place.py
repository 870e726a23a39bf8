"""Where the vertex of a cell on a crease or corner goes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh.cvt.diagram import Diagram
from anisomesh.cvt.voronoi import RestrictedVoronoi
from anisomesh.dual.cells import Cells
from anisomesh.surface.closest import ClosestPoints
from anisomesh.surface.features import corners
from anisomesh.surface.mesh import Surface

_SHARPNESS = 100.0
_MISSED = 0.05  # mean edge lengths between a corner and the mesh, from which on it counts as missed


def creased_cells(
    diagram: Diagram, cells: Cells, surface: Surface, sharp: npt.NDArray[np.bool_]
) -> npt.NDArray[np.int64]:
    """Return the cells (n,) that hold a piece of a sharp edge; ``surface`` has its faces in the diagram's order."""
    on_side = np.flatnonzero(diagram.label < 0)
    polygon = diagram.polygon_of[on_side]
    edge = surface.face_edges[diagram.facet[polygon], -1 - diagram.label[on_side]]
    return np.unique(cells.of_polygon[polygon[sharp[edge]]]).astype(np.int64)


def crease_positions(
    voronoi: RestrictedVoronoi, diagram: Diagram, cells: Cells, scale: float, chosen: npt.NDArray[np.int64]
) -> Points:
    """Return where the planes in each of the chosen cells meet (n, 3).

    Parameters
    ----------
    voronoi, diagram, cells
        The embedded surface, the diagram on it, and the components of its cells.
    scale
        The factor of the first three embedded coordinates.
    chosen
        Numbers of the cells (n,), those with a crease.

    Notes
    -----
    The position minimises the normal-metric energy of the cell as it is, with s = 100 instead of the s that the
    sites were optimised with: on a crease the pull of the centroid, which at s = 7 holds a vertex some per cent of
    its distance away from a corner, falls below 1e-3. Elsewhere the site keeps its place, because the same
    minimum moves the vertices of smooth cells about without bringing them nearer to the surface.
    """
    area = diagram.fractions * voronoi.facets.area[diagram.facet]
    normal = voronoi.facets.normal[diagram.facet]
    corner = diagram.points[diagram.faces[diagram.facet, 0], :3] / scale
    height = np.einsum("px,px->p", normal, corner)
    quadric = _per_cell(cells, area[:, None, None] * normal[:, :, None] * normal[:, None, :])[chosen]
    pull = _per_cell(cells, (area * height)[:, None] * normal)[chosen]
    mass = np.maximum(cells.area[chosen], np.finfo(np.float64).tiny)
    factor = _SHARPNESS**2 - 1.0
    matrix = mass[:, None, None] * np.eye(3) + factor * quadric
    right = mass[:, None] * cells.centroid[chosen, :3] / scale + factor * pull
    return np.asarray(np.linalg.solve(matrix, right[:, :, None])[:, :, 0])


def _per_cell(cells: Cells, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the sum of the values of the polygons (P, ...) in each component (C, ...)."""
    flat = values.reshape(len(values), -1)
    sums = [np.bincount(cells.of_polygon, column, minlength=len(cells.site)) for column in flat.T]
    return np.stack(sums, axis=1).astype(np.float64).reshape(len(cells.site), *values.shape[1:])


def snap_to_missed(
    diagram: Diagram,
    cells: Cells,
    surface: Surface,
    points: Points,
    faces: Faces,
    sharp: npt.NDArray[np.bool_],
    movable: npt.NDArray[np.bool_],
) -> Points:
    """Return the points (V, 3), some of them moved to corners that the mesh misses.

    Parameters
    ----------
    diagram, cells
        The diagram and the components of its cells, which are the first points.
    surface
        The surface in space, its faces in the order of the diagram.
    points, faces
        The dual in space (V, 3), (F, 3).
    sharp
        Which edges of the surface (E,) are creases.
    movable
        Cells whose vertex may move (C,).

    Notes
    -----
    Where a cell holds little more than the tip of a corner the planes there weigh next to nothing, and the corner
    is cut off by a tenth of an edge or more. The vertex of a cell goes to the corner in it that the mesh is farthest
    from, and back if that takes the mesh farther from the surface in the cells around.
    """
    before, after = diagram.label[diagram.previous], diagram.label
    at_corner = np.flatnonzero((before < 0) & (after < 0))
    polygon = diagram.polygon_of[at_corner]
    owner = np.full(surface.n_points, -1)
    owner[diagram.faces[diagram.facet[polygon], 5 + before[at_corner] + after[at_corner]]] = cells.of_polygon[polygon]
    mesh = Surface(points, faces)
    missed = (_MISSED * float(mesh.edge_lengths.mean())) ** 2
    squared = ClosestPoints(mesh).squared_distances(surface.points)
    candidate = np.flatnonzero(corners(surface, sharp) & (owner >= 0) & movable[owner] & (squared > missed))
    candidate = candidate[np.argsort(squared[candidate], kind="stable")]
    moved = np.array(points)
    moved[owner[candidate]] = surface.points[candidate]  # of several in a cell the last, the farthest, stays
    after_squared = ClosestPoints(Surface(moved, faces)).squared_distances(surface.points)
    change = np.bincount(owner[owner >= 0], (after_squared - squared)[owner >= 0], minlength=len(points))
    around = np.zeros(len(points))
    for corner in range(3):
        np.add.at(around, faces[:, corner], change[faces].sum(axis=1))
    worse = around > 0.0
    moved[worse] = points[worse]
    return moved
