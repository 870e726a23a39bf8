"""Where the vertex of a cell on a crease or corner goes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh.cvt.diagram import Diagram
from anisomesh.cvt.voronoi import RestrictedVoronoi
from anisomesh.dual.cells import Cells
from anisomesh.surface.closest import ClosestPoints
from anisomesh.surface.mesh import Surface

_SHARPNESS = 100.0
_MISSED = 0.05  # mean edge lengths between a corner and the mesh, from which on it counts as missed


def crease_positions(
    voronoi: RestrictedVoronoi, diagram: Diagram, cells: Cells, scale: float, angle: float
) -> tuple[npt.NDArray[np.int64], Points]:
    """Return the cells whose normals spread by more than an angle, and where the planes in each of them meet.

    Parameters
    ----------
    voronoi, diagram, cells
        The embedded surface, the diagram on it, and the components of its cells.
    scale
        The factor of the first three embedded coordinates.
    angle
        Degrees from the mean normal of a cell to the farthest of its normals.

    Returns
    -------
    cells, points
        Numbers of the cells (n,) and positions in space (n, 3).

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
    mean = _per_cell(cells, area[:, None] * normal)
    length = np.linalg.norm(mean, axis=1)
    cosine = np.einsum("px,px->p", normal, mean[cells.of_polygon])
    spread = np.full(len(cells.site), np.inf)
    np.minimum.at(spread, cells.of_polygon, cosine)
    chosen = np.flatnonzero(spread < length * np.cos(np.radians(angle)))
    quadric = _per_cell(cells, area[:, None, None] * normal[:, :, None] * normal[:, None, :])[chosen]
    pull = _per_cell(cells, (area * height)[:, None] * normal)[chosen]
    mass = cells.area[chosen]
    factor = _SHARPNESS**2 - 1.0
    matrix = mass[:, None, None] * np.eye(3) + factor * quadric
    right = mass[:, None] * cells.centroid[chosen, :3] / scale + factor * pull
    positive = mass > 0.0
    return chosen[positive], np.linalg.solve(matrix[positive], right[positive][:, :, None])[:, :, 0]


def _per_cell(cells: Cells, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the sum of the values of the polygons (P, ...) in each component (C, ...)."""
    flat = values.reshape(len(values), -1)
    sums = [np.bincount(cells.of_polygon, column, minlength=len(cells.site)) for column in flat.T]
    return np.stack(sums, axis=1).astype(np.float64).reshape(len(cells.site), *values.shape[1:])


def snap_to_missed(
    diagram: Diagram, cells: Cells, surface: Surface, points: Points, faces: Faces, creased: npt.NDArray[np.int64]
) -> Points:
    """Return the points (V, 3) with those of creased cells moved to the corner they miss.

    Parameters
    ----------
    diagram, cells
        The diagram and the components of its cells, which are the first points.
    surface
        The surface in space, its faces in the order of the diagram.
    points, faces
        The dual in space (V, 3), (F, 3).
    creased
        The cells (n,) whose vertex may move.

    Notes
    -----
    Where a cell holds little more than the tip of a corner the planes there weigh next to nothing, and the corner
    is cut off by a tenth of an edge or more. A vertex goes to the point of the input in its cell that the mesh is
    farthest from, and back if that leaves the mesh farther from the cell than before.
    """
    before, after = diagram.label[diagram.previous], diagram.label
    at_corner = np.flatnonzero((before < 0) & (after < 0))
    polygon = diagram.polygon_of[at_corner]
    owner = np.full(surface.n_points, -1)
    owner[diagram.faces[diagram.facet[polygon], 5 + before[at_corner] + after[at_corner]]] = cells.of_polygon[polygon]
    mesh = Surface(points, faces)
    missed = (_MISSED * float(mesh.edge_lengths.mean())) ** 2
    squared = ClosestPoints(mesh).squared_distances(surface.points)
    worst, value = _worst_of(owner, squared, len(points))
    may = np.zeros(len(points), dtype=bool)
    may[creased] = True
    moving = np.flatnonzero(may & (value > missed))
    moved = np.array(points)
    moved[moving] = surface.points[worst[moving]]
    left = _worst_of(owner, ClosestPoints(Surface(moved, faces)).squared_distances(surface.points), len(points))[1]
    back = moving[left[moving] >= value[moving]]
    moved[back] = points[back]
    return moved


def _worst_of(
    owner: npt.NDArray[np.int64], squared: npt.NDArray[np.float64], n: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Return, for each of n cells, the point it owns with the largest value, and that value (-1, 0 for none)."""
    order = np.argsort(squared, kind="stable")
    order = order[owner[order] >= 0]
    point, value = np.full(n, -1), np.zeros(n)
    point[owner[order]], value[owner[order]] = order, squared[order]
    return point, value
