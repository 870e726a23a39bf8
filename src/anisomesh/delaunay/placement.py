"""Vertex placement: where the vertices of the dual go in space."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, EmbeddedPoints, Faces, PointMask, Points
from anisomesh._groups import first_of_each
from anisomesh.delaunay.creases import CreaseCells
from anisomesh.features.detect import corners
from anisomesh.features.network import FeatureNetwork
from anisomesh.mesh import geometry
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.voronoi.cells import CellComplex
from anisomesh.voronoi.intervals import BoundaryIntervals

_CREASE_SHARPNESS = 100.0  # factor s of the normal metric that places vertices of cells with a crease
_MAX_CREASE_OFFSET = 0.1  # mean edge lengths by which a vertex may be off a curved crease; heuristic
_SAME_NORMAL = 1e-9  # by which components of the unit normals of coplanar facets may differ: rounding
_NEAR_PLANE = 1e-3  # roots of the area of a cell, up to which a vertex is put into the cell's main plane; heuristic
_MISSED_CORNER = 0.05  # mean edge lengths between a corner and the mesh, from which on it counts as missed; heuristic

Ints = npt.NDArray[np.int64]


def place_vertices(
    cells: CellComplex,
    features: FeatureNetwork,
    boundary: BoundaryIntervals,
    creased: CreaseCells,
    points: EmbeddedPoints,
    faces: Faces,
) -> Points:
    """Return the vertices of the dual in space (V, 3), at bounding-box diagonal 1.

    Parameters
    ----------
    cells
        The cell components, which are the first vertices.
    features, boundary, creased
        Boundary and creases, and what the cells have of them.
    points, faces
        The dual in the embedding (V, d), (F, 3).

    Notes
    -----
    Vertices of cells in one plane are put into it; vertices of cells at boundary and creases onto these, at a curved
    crease slightly outside, where its chords are nearest to it; vertices of other cells with a crease where the planes
    of the cell meet.
    """
    scale = cells.embedded.scale
    on_boundary, fixed = _onto_boundary(points, boundary, cells)
    space = project_to_planes(cells, points[:, :3] / scale)
    sharp = cells_with_crease(cells, features.sharp)
    meeting = plane_intersections(cells, sharp)
    space[sharp] = project_to_main_planes(cells, sharp, meeting)
    space[fixed] = on_boundary[fixed, :3] / scale
    space[creased.cell] = creased.place[:, :3] / scale
    curved = creased.curved & ~creased.corner
    limit = _MAX_CREASE_OFFSET * float(Surface(space, faces).edge_lengths.mean())
    offset = meeting[np.searchsorted(sharp, creased.cell[curved])] - space[creased.cell[curved]]
    along = geometry.unit(creased.chord[curved, :3])
    offset -= np.einsum("nx,nx->n", offset, along)[:, None] * along
    size = np.linalg.norm(offset, axis=1)
    space[creased.cell[curved]] += np.where((size < limit)[:, None], offset, 0.0)
    fixed[creased.cell] = True
    return snap_to_missed_corners(cells, space, faces, features, ~fixed[: cells.n_components])


def cells_with_crease(cells: CellComplex, sharp: EdgeMask) -> Ints:
    """Return the components (n,) that contain a piece of a sharp edge of the surface (E,)."""
    diagram = cells.diagram
    side = np.flatnonzero(diagram.label < 0)
    polygon = diagram.polygon_of[side]
    edge = cells.embedded.surface.face_edges[diagram.facet[polygon], -1 - diagram.label[side]]
    return np.unique(cells.of_polygon[polygon[sharp[edge]]]).astype(np.int64)


def plane_intersections(cells: CellComplex, chosen: Ints) -> Points:
    """Return where the planes of the facets in each of the chosen components (n,) meet, in space (n, 3).

    Notes
    -----
    The position minimises the normal-metric energy of the cell as it is, with s = 100 instead of the s that the sites
    were optimised with: on a crease the pull of the centroid, which at s = 7 keeps a vertex some per cent of its
    distance away from a corner, falls below 1e-3. Elsewhere the site keeps its place, because the same minimum moves
    the vertices of smooth cells about without bringing them nearer to the surface.
    """
    diagram, embedded = cells.diagram, cells.embedded
    area, normal = cells.polygon_areas, embedded.facets.normal[diagram.facet]
    corner = diagram.points[diagram.faces[diagram.facet, 0], :3] / embedded.scale
    height = np.einsum("px,px->p", normal, corner)
    quadric = cells.sums(area[:, None, None] * normal[:, :, None] * normal[:, None, :])[chosen]
    pull = cells.sums((area * height)[:, None] * normal)[chosen]
    mass = np.maximum(cells.area[chosen], np.finfo(np.float64).tiny)
    factor = _CREASE_SHARPNESS**2 - 1.0
    matrix = mass[:, None, None] * np.eye(3) + factor * quadric
    right = mass[:, None] * cells.centroid[chosen, :3] / embedded.scale + factor * pull
    return np.asarray(np.linalg.solve(matrix, right[:, :, None])[:, :, 0])


def project_to_planes(cells: CellComplex, points: Points) -> Points:
    """Return the vertices (V, 3), the ones of cells in one plane projected into it."""
    surface, diagram = cells.embedded.surface, cells.diagram
    first = np.unique(cells.of_polygon, return_index=True)[1]
    normal = surface.face_normals[diagram.facet[first]]
    flat = _count_planes(cells) == 1
    start = surface.points[surface.faces[diagram.facet[first], 0]]
    height = np.einsum("cx,cx->c", points[: len(flat)] - start, normal)
    moved = np.array(points)
    moved[: len(flat)][flat] -= (height[:, None] * normal)[flat]
    return moved


def project_to_main_planes(cells: CellComplex, chosen: Ints, points: Points) -> Points:
    """Return the vertices of the chosen components (n, 3), projected into the plane of the largest piece if near it.

    Only for components in two planes: a sliver beyond a crease pulls the vertex slightly out of the plane of all the
    rest, without bringing it to the crease.
    """
    surface, diagram = cells.embedded.surface, cells.diagram
    area = diagram.fractions * surface.face_areas[diagram.facet]
    _, largest = first_of_each(cells.of_polygon, np.argsort(-area, kind="stable"))
    facet = diagram.facet[largest][chosen]
    normal, start = surface.face_normals[facet], surface.points[surface.faces[facet, 0]]
    height = np.einsum("nx,nx->n", points - start, normal)
    size = np.sqrt(np.bincount(cells.of_polygon, area)[chosen])
    near = (np.abs(height) < _NEAR_PLANE * size) & (_count_planes(cells)[chosen] == 2)
    return np.where(near[:, None], points - height[:, None] * normal, points)


def snap_to_missed_corners(
    cells: CellComplex, points: Points, faces: Faces, features: FeatureNetwork, movable: PointMask
) -> Points:
    """Return the vertices (V, 3), some of them moved to corners of the surface that the mesh misses.

    Parameters
    ----------
    cells
        The cell components, which are the first vertices.
    points, faces
        The dual in space (V, 3), (F, 3).
    features
        Creases and apexes of the surface.
    movable
        Components whose vertex may move (C,).

    Notes
    -----
    Where a cell contains little more than the tip of a corner, the planes there weigh next to nothing, and the corner
    is cut off by a tenth of an edge or more. The vertex of a cell moves to the corner in it that the mesh is farthest
    from, and back if that increases the distance to the mesh in the cells around. The apex of a cone or a fixed point
    is such a corner in any case, even where little is cut off, and the vertex stays there.
    """
    surface = cells.embedded.surface
    owner = _owners(cells)
    mesh = Surface(points, faces)
    missed = (_MISSED_CORNER * float(mesh.edge_lengths.mean())) ** 2
    squared = ClosestPoints(mesh).squared_distances(surface.points)
    apex = np.zeros(surface.n_points, dtype=bool)
    apex[features.apexes] = True
    apex &= (points[owner] != surface.points).any(axis=1)
    far = (corners(surface, features.sharp) & (squared > missed)) | apex
    candidate = np.flatnonzero(far & (owner >= 0) & movable[owner])
    candidate = candidate[np.argsort(squared[candidate], kind="stable")[::-1]]
    vertex, farthest = first_of_each(owner, candidate)
    moved = np.array(points)
    moved[vertex] = surface.points[farthest]
    after_squared = ClosestPoints(Surface(moved, faces)).squared_distances(surface.points)
    change = np.bincount(owner[owner >= 0], (after_squared - squared)[owner >= 0], minlength=len(points))
    around = np.zeros(len(points))
    for corner in range(3):
        np.add.at(around, faces[:, corner], change[faces].sum(axis=1))
    worse = around > 0.0
    worse[vertex[apex[farthest]]] = False
    moved[worse] = points[worse]
    return moved


def _onto_boundary(
    points: EmbeddedPoints, intervals: BoundaryIntervals, cells: CellComplex
) -> tuple[Points, PointMask]:
    """Return the vertices (V, d), the ones of cells at the boundary on their longest intervals, and which these are."""
    component = cells.of_polygon[intervals.polygon]
    vertex, longest = first_of_each(component, np.argsort(intervals.length, kind="stable")[::-1])
    moved, mask = np.array(points), np.zeros(len(points), dtype=bool)
    moved[vertex] = intervals.place[longest]
    mask[vertex] = True
    return moved, mask


def _count_planes(cells: CellComplex) -> Ints:
    """Return how many directions the facets of each component have (C,): 1, 2, or 3 for more."""
    normal, cell = cells.embedded.surface.face_normals[cells.diagram.facet], cells.of_polygon
    first = np.unique(cell, return_index=True)[1]
    off_first = np.abs(normal - normal[first][cell]).max(axis=1)
    _, second = first_of_each(cell, np.argsort(-off_first, kind="stable"))  # differs most from the first
    off_both = np.minimum(off_first, np.abs(normal - normal[second][cell]).max(axis=1))
    more = [np.bincount(cell, off > _SAME_NORMAL, minlength=cells.n_components) > 0 for off in (off_first, off_both)]
    return 1 + more[0].astype(np.int64) + more[1]


def _owners(cells: CellComplex) -> Ints:
    """Return the component that each point of the surface (V,) is in, -1 for points without faces."""
    diagram = cells.diagram
    side = np.flatnonzero(diagram.label < 0)
    point = diagram.point_at(side)
    owner = np.full(cells.embedded.surface.n_points, -1, dtype=np.int64)
    owner[point[point >= 0]] = cells.of_polygon[diagram.polygon_of[side[point >= 0]]]
    return owner
