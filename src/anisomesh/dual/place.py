"""Where the vertex of a cell on a crease or corner goes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh.cvt.diagram import Diagram
from anisomesh.cvt.voronoi import RestrictedVoronoi
from anisomesh.dual.cells import Cells
from anisomesh.surface import geometry
from anisomesh.surface.closest import ClosestPoints
from anisomesh.surface.features import corners
from anisomesh.surface.mesh import Surface

_SHARPNESS = 100.0
_SNAP = 0.05  # mean edge lengths by which a point may move to be exactly on a corner or crease
_FAR_SNAP = 0.45  # the same where the crease goes through the cell for a longer way,
_TINY_SNAP = 1e-3  # the same where the creases in the cell are not straight
_LONG = 0.05  # of so many mean edge lengths
_SAME_PLANE = 1e-9  # by which the normals of facets in one plane may differ, and directions of one line
_MISSED = 0.05  # mean edge lengths between a corner and the mesh, from which on it counts as missed


def creased_cells(
    diagram: Diagram, cells: Cells, surface: Surface, sharp: npt.NDArray[np.bool_]
) -> npt.NDArray[np.int64]:
    """Return the cells (n,) that hold a piece of a sharp edge; ``surface`` has its faces in the diagram's order."""
    return np.unique(cells.of_polygon[diagram.polygon_of[_on_creases(diagram, surface, sharp)[0]]]).astype(np.int64)


def _on_creases(
    diagram: Diagram, surface: Surface, sharp: npt.NDArray[np.bool_]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int32]]:
    """Return the edges of polygons (n,) that are on a sharp edge of the surface, and which that is (n,)."""
    side = np.flatnonzero(diagram.label < 0)
    edge = surface.face_edges[diagram.facet[diagram.polygon_of[side]], -1 - diagram.label[side]]
    return side[sharp[edge]], edge[sharp[edge]]


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


def put_on_creases(
    diagram: Diagram, cells: Cells, surface: Surface, points: Points, faces: Faces, sharp: npt.NDArray[np.bool_]
) -> Points:
    """Return the points of the dual (V, 3), those near a crease or corner in their cell exactly on it.

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

    Notes
    -----
    A point no farther than a twentieth of an edge from a corner in its cell goes there, another to the closest point of
    the creases in its cell, if these are straight and that is as near. Where a twentieth of an edge length of crease or
    more between two planes is in the cell it may be farther: the neighbours on both sides along the crease are then too
    far apart to be joined by an edge. On a curved crease points stay a little outside, where they are best for its
    chords.
    """
    edge = float(Surface(points, faces).edge_lengths.mean())
    side, crease = _on_creases(diagram, surface, sharp)
    cell = cells.of_polygon[diagram.polygon_of[side]].astype(np.int64)
    ends = [_in_space(diagram, surface, vertex) for vertex in (side, diagram.following[side])]
    along = ends[1] - ends[0]
    length = (along**2).sum(axis=1)
    share = np.einsum("nx,nx->n", points[cell] - ends[0], along)
    share = np.clip(np.divide(share, length, out=np.zeros_like(share), where=length > 0.0), 0.0, 1.0)
    whole = surface.points[surface.edges[crease]]
    direction = geometry.unit(whole[:, 1] - whole[:, 0])
    names, first, place = np.unique(cell, return_index=True, return_inverse=True)
    bent = np.abs(np.einsum("nx,nx->n", direction, direction[first][place])) < 1.0 - _SAME_PLANE
    straight = np.zeros(len(points), dtype=bool)
    straight[names] = np.bincount(place, bent) == 0
    moved = np.array(points)
    through = np.bincount(cell, np.sqrt(length), minlength=len(points)) > _LONG * 2.0 * edge  # from both facets
    through[: len(cells.site)] &= _planes(diagram, cells, surface) <= 2
    limit = edge * np.where(straight, np.where(through, _FAR_SNAP, _SNAP), _TINY_SNAP)
    _move_to_nearest(moved, points, cell, ends[0] + share[:, None] * along, limit)
    owner = _owners(diagram, cells, surface)
    corner = np.flatnonzero(corners(surface, sharp) & (owner >= 0))
    _move_to_nearest(moved, points, owner[corner], surface.points[corner], np.full(len(points), _SNAP * edge))
    return moved


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


def _in_space(diagram: Diagram, surface: Surface, vertex: npt.NDArray[np.integer]) -> Points:
    """Return where vertices of the diagram (n,) are on the surface in space (n, 3)."""
    corner = surface.points[surface.faces[diagram.facet[diagram.polygon_of[vertex]]]]
    return np.asarray(np.einsum("nc,ncx->nx", diagram.barycentric[vertex], corner))


def _move_to_nearest(
    moved: Points, points: Points, cell: npt.NDArray[np.int64], places: Points, limit: npt.NDArray[np.float64]
) -> None:
    """Move the point of each cell named (n,) to the nearest of its places (n, 3) that is within its limit (V,)."""
    distance = np.linalg.norm(places - points[cell], axis=1)
    order = np.argsort(-distance, kind="stable")
    order = order[distance[order] <= limit[cell[order]]]
    moved[cell[order]] = places[order]  # of several the last, the nearest, stays


def _owners(diagram: Diagram, cells: Cells, surface: Surface) -> npt.NDArray[np.int64]:
    """Return the cell that each point of the surface (V,) is in, -1 for points without faces."""
    before, after = diagram.label[diagram.previous], diagram.label
    at_point = np.flatnonzero((before < 0) & (after < 0))
    polygon = diagram.polygon_of[at_point]
    owner = np.full(surface.n_points, -1, dtype=np.int64)
    owner[diagram.faces[diagram.facet[polygon], 5 + before[at_point] + after[at_point]]] = cells.of_polygon[polygon]
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
