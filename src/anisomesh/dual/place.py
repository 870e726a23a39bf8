"""Where the vertex of a cell on a crease or corner goes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Points
from anisomesh.cvt.diagram import Diagram
from anisomesh.cvt.voronoi import RestrictedVoronoi
from anisomesh.dual.cells import Cells

_SHARPNESS = 100.0


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
    return np.stack(sums, axis=1).reshape(len(cells.site), *values.shape[1:])
