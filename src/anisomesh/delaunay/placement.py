"""Where the vertices of the dual go in space."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, EmbeddedPoints, Faces, Points
from anisomesh.cvt.boundary import BoundaryArcs
from anisomesh.cvt.features import Features
from anisomesh.delaunay.boundary import put_on_boundary
from anisomesh.delaunay.creases import CreasedCells
from anisomesh.features.detect import corners
from anisomesh.mesh import geometry
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.voronoi.cells import Cells
from anisomesh.voronoi.diagram import Diagram
from anisomesh.voronoi.restricted import RestrictedVoronoi

_SHARPNESS = 100.0
_MOST_OFF = 0.1  # mean edge lengths by which the vertex may be off a curved crease
_SAME_PLANE = 1e-9  # by which the normals of facets in one plane may differ
_NEAR_PLANE = 1e-3  # roots of the area of a cell
_MISSED = 0.05  # mean edge lengths between a corner and the mesh, from which on it counts as missed


def placed(
    voronoi: RestrictedVoronoi,
    diagram: Diagram,
    cells: Cells,
    surface: Surface,
    features: Features,
    rim: BoundaryArcs,
    creased: CreasedCells,
    points: EmbeddedPoints,
    faces: Faces,
    scale: float,
) -> Points:
    """Return the points of the dual in space (V, 3).

    Parameters
    ----------
    voronoi, diagram, cells
        The embedded surface, the diagram on it, and the components of its cells, which are the first points.
    surface
        The surface in space, its faces in the order of the diagram.
    features, rim, creased
        Boundary and creases, and what the cells have of them.
    points, faces
        The dual (V, d), (F, 3).
    scale
        The factor of the first three embedded coordinates.

    Notes
    -----
    Vertices of cells that lie in one plane are put in it; those at boundary and creases on these; at a curved crease
    a little outside, where its chords are nearest to it; those of other cells with a crease where their planes meet.
    """
    on_rim, fixed = put_on_boundary(points, rim, cells)
    space = put_on_planes(diagram, cells, surface, points[:, :3] / scale)
    sharp = cells_with_crease(diagram, cells, surface, features.sharp)
    where = crease_positions(voronoi, diagram, cells, scale, sharp)
    space[sharp] = on_main_planes(diagram, cells, surface, sharp, where)
    space[fixed] = on_rim[fixed, :3] / scale
    space[creased.cell] = creased.place[:, :3] / scale
    bent = creased.bent & ~creased.corner
    limit = _MOST_OFF * float(Surface(space, faces).edge_lengths.mean())
    off = where[np.searchsorted(sharp, creased.cell[bent])] - space[creased.cell[bent]]
    along = geometry.unit(creased.chord[bent, :3])
    off -= np.einsum("nx,nx->n", off, along)[:, None] * along
    size = np.linalg.norm(off, axis=1)
    space[creased.cell[bent]] += np.where((size < limit)[:, None], off, 0.0)
    fixed[creased.cell] = True
    return snap_to_missed(diagram, cells, surface, space, faces, features.sharp, ~fixed[: len(cells.site)])


def cells_with_crease(diagram: Diagram, cells: Cells, surface: Surface, sharp: EdgeMask) -> npt.NDArray[np.int64]:
    """Return the cells (n,) that hold a piece of a sharp edge."""
    side = np.flatnonzero(diagram.label < 0)
    polygon = diagram.polygon_of[side]
    edge = surface.face_edges[diagram.facet[polygon], -1 - diagram.label[side]]
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


def put_on_planes(diagram: Diagram, cells: Cells, surface: Surface, points: Points) -> Points:
    """Return the points of the dual (V, 3), those of cells that lie in one plane exactly in it."""
    first = np.unique(cells.of_polygon, return_index=True)[1]
    normal = surface.face_normals[diagram.facet[first]]
    flat = _planes(diagram, cells, surface) == 1
    start = surface.points[surface.faces[diagram.facet[first], 0]]
    height = np.einsum("cx,cx->c", points[: len(flat)] - start, normal)
    moved = np.array(points)
    moved[: len(flat)][flat] -= (height[:, None] * normal)[flat]
    return moved


def on_main_planes(
    diagram: Diagram, cells: Cells, surface: Surface, chosen: npt.NDArray[np.int64], points: Points
) -> Points:
    """Return the points of the chosen cells (n, 3), exactly in the plane of the largest piece of the cell if near it.

    That is for cells in two planes: a sliver beyond a crease pulls the vertex a little out of the plane that all the
    rest is in, without bringing it to the crease.
    """
    area = diagram.fractions * surface.face_areas[diagram.facet]
    order = np.lexsort((-area, cells.of_polygon))
    facet = diagram.facet[order[np.unique(cells.of_polygon[order], return_index=True)[1]]][chosen]
    normal, start = surface.face_normals[facet], surface.points[surface.faces[facet, 0]]
    height = np.einsum("nx,nx->n", points - start, normal)
    size = np.sqrt(np.bincount(cells.of_polygon, area)[chosen])
    near = (np.abs(height) < _NEAR_PLANE * size) & (_planes(diagram, cells, surface)[chosen] == 2)
    return np.where(near[:, None], points - height[:, None] * normal, points)


def _planes(diagram: Diagram, cells: Cells, surface: Surface) -> npt.NDArray[np.int64]:
    """Return how many directions the facets of each cell have (C,): 1, 2, or 3 for more."""
    normal, cell = surface.face_normals[diagram.facet], cells.of_polygon
    first = np.unique(cell, return_index=True)[1]
    off_first = np.abs(normal - normal[first][cell]).max(axis=1)
    order = np.lexsort((-off_first, cell))
    second = order[np.unique(cell[order], return_index=True)[1]]  # the facet that differs most from the first
    off_both = np.minimum(off_first, np.abs(normal - normal[second][cell]).max(axis=1))
    size = len(cells.site)
    more = [np.bincount(cell, off > _SAME_PLANE, minlength=size) > 0 for off in (off_first, off_both)]
    return 1 + more[0].astype(np.int64) + more[1]


def _owners(diagram: Diagram, cells: Cells, surface: Surface) -> npt.NDArray[np.int64]:
    """Return the cell that each point of the surface (V,) is in, -1 for points without faces."""
    side = np.flatnonzero(diagram.label < 0)
    point = diagram.point_at(side)
    owner = np.full(surface.n_points, -1, dtype=np.int64)
    owner[point[point >= 0]] = cells.of_polygon[diagram.polygon_of[side[point >= 0]]]
    return owner


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
    owner = _owners(diagram, cells, surface)
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
