"""From optimised sites to a valid mesh of the asked number of vertices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh._arrays import Faces, PointMask, Points, PointTensors, Sites
from anisomesh.cvt.arcs import Arcs, Boundary
from anisomesh.cvt.diagram import Diagram
from anisomesh.cvt.voronoi import RestrictedVoronoi
from anisomesh.dual.boundary import points_on_boundary, put_on_boundary
from anisomesh.dual.cells import Cells, cells_of
from anisomesh.dual.decimate import decimate
from anisomesh.dual.flip import flip_for_shape
from anisomesh.dual.insert import points_in_cells, points_in_components
from anisomesh.dual.place import crease_positions, creased_cells, put_on_creases, put_on_planes, snap_to_missed
from anisomesh.dual.separate import separate
from anisomesh.dual.simplicial import simplicial_mesh
from anisomesh.dual.triangulate import dual_mesh
from anisomesh.dual.untangle import untangle
from anisomesh.evaluation.quality import transfer_metric_roots
from anisomesh.metric.tensor import metric_root
from anisomesh.surface.closest import ClosestPoints
from anisomesh.surface.features import sharp_edges
from anisomesh.surface.mesh import Surface

MAX_ROUNDS = 10
_MAX_TRIMS = 3
_TRIM_TRIES = 50
MAX_SHARE = 0.25  # of cells that are no disks; with more the sites are too few for this surface
MAX_GROWTH, MAX_MORE = 4, 1_000  # the most sites are so many times the vertices asked for, and so many more


@dataclass(frozen=True, kw_only=True)
class Refined:
    """A valid mesh and what it took.

    Attributes
    ----------
    points, faces
        The mesh, in the space and units of the working surface.
    diagram, cells
        The restricted Voronoi diagram that it comes from.
    inserted
        Sites added because a cell was no disk, and points put on edges that were there twice.
    removed
        Points taken away again by edge collapses.
    from_input
        Whether the surface itself was coarsened, because its embedding asks for many more sites.
    """

    points: Points
    faces: Faces
    diagram: Diagram
    cells: Cells
    inserted: int
    removed: int
    from_input: bool


def refine(
    voronoi: RestrictedVoronoi,
    sites: Sites,
    surface: Surface,
    plain: Surface,
    boundary: Boundary,
    scale: float,
    *,
    n_vertices: int,
    crease_angle: float,
    tensors: PointTensors,
) -> Refined:
    """Return the dual of the diagram of these sites, made valid, with at most so many vertices where possible.

    Parameters
    ----------
    voronoi
        The diagram over the embedded surface.
    sites
        Optimised positions (S, d).
    surface
        The surface in space, its faces in the order of ``voronoi``.
    plain
        Another mesh of the same surface, to be coarsened if all else fails.
    boundary
        The boundary of the surface.
    scale
        The factor of the first three embedded coordinates.
    n_vertices
        Vertices asked for.
    crease_angle
        Edges of the surface whose faces differ by more than this many degrees are creases, onto which the vertices of
        their cells are put.
    tensors
        The metric at the points of the surface (V, 3, 3).

    Notes
    -----
    1. While a cell is no disk, new sites go where it is farthest from its site; also where a closed component has
       fewer than four cells, where a cell has two arcs of the boundary, and where a boundary curve has fewer than
       three. Nothing else moves, so little else breaks. The rounds are bounded; in practice one or two are enough.
    2. When all cells are disks with at most one arc the dual, glued along bisector chains, is homeomorphic to the
       surface (a regular cell complex; compare the closed ball property of Edelsbrunner and Shah 1997). Points on edges
       that occur twice make it a simplicial mesh.
    3. What this inserted is taken away by edge collapses with the link condition, cheapest first.
    4. Triangles that face away from the surface are turned back by edge flips and moves.
    5. Edges are flipped where that gives better triangles in the metric.
    6. Triangles that intersect where the surface does not are taken apart; points that this takes are made up for by
       collapses elsewhere.

    Where step 1 does not succeed (a tube thinner than the distance between sites) the surface itself, which is valid,
    is coarsened by the same collapses. The paper inserts sites for every defect and optimises again;
    that makes new defects as it mends old ones.
    """
    n_start = len(sites)
    diagram, cells, arcs, complete = _with_enough_sites(voronoi, sites, surface, boundary, n_vertices)
    if complete:
        points, faces, _ = simplicial_mesh(dual_mesh(diagram, cells, surface))
        points, rim = put_on_boundary(points, arcs, cells)
        space = _placed(voronoi, diagram, cells, surface, points[:, :3] / scale, faces, rim, scale, crease_angle)
    else:
        space, faces = plain.points, plain.faces
    n_first = len(space)
    reference = ClosestPoints(surface)
    space, faces, _ = untangle(space, faces, reference)
    if len(space) > n_vertices:
        space, faces = decimate(space, faces, n_vertices, reference)
        space, faces, _ = untangle(space, faces, reference)
    roots = transfer_metric_roots(reference, metric_root(tensors), space)
    faces = flip_for_shape(space, faces, roots, reference)
    space, faces = _without_crossings(space, faces, n_vertices, reference)
    return Refined(
        points=space,
        faces=faces,
        diagram=diagram,
        cells=cells,
        inserted=max(n_first - n_start, 0) if complete else 0,
        removed=max(n_first - len(space), 0),
        from_input=not complete,
    )


def _with_enough_sites(
    voronoi: RestrictedVoronoi, sites: Sites, surface: Surface, boundary: Boundary, n_vertices: int
) -> tuple[Diagram, Cells, Arcs, bool]:
    """Return diagram, cells and arcs with sites added until none is missing, and whether that was reached."""
    most = MAX_GROWTH * n_vertices + MAX_MORE
    for _ in range(MAX_ROUNDS):
        diagram = voronoi.diagram(sites)
        cells = cells_of(diagram, surface.face_neighbours, voronoi.facets.area)
        bad = cells.euler != 1
        arcs = boundary.arcs(diagram)
        missing = np.concatenate(
            [
                points_in_cells(diagram, cells, bad),
                points_in_components(diagram, cells, surface),
                points_on_boundary(arcs, boundary.curves, cells, sites),
            ]
        )
        if len(missing) == 0 or bad.mean() > MAX_SHARE or len(sites) + len(missing) > most:
            break
        sites = np.concatenate([sites, missing])
    return diagram, cells, arcs, len(missing) == 0


def _placed(
    voronoi: RestrictedVoronoi,
    diagram: Diagram,
    cells: Cells,
    surface: Surface,
    points: Points,
    faces: Faces,
    on_boundary: PointMask,
    scale: float,
    crease_angle: float,
) -> Points:
    """Return the points of the dual in space (V, 3), those within the boundary on planes, creases and corners."""
    sharp = sharp_edges(surface, crease_angle)
    placed = put_on_planes(diagram, cells, surface, points)
    creased = creased_cells(diagram, cells, surface, sharp)
    placed[creased] = crease_positions(voronoi, diagram, cells, scale, creased)
    placed = put_on_creases(diagram, cells, surface, placed, faces, sharp)
    placed[on_boundary] = points[on_boundary]
    return snap_to_missed(diagram, cells, surface, placed, faces, sharp, ~on_boundary[: len(cells.site)])


def _without_crossings(points: Points, faces: Faces, n_vertices: int, reference: ClosestPoints) -> tuple[Points, Faces]:
    """Return the mesh with intersecting triangles taken apart, and back at no more points than before if possible."""
    n_wanted = max(n_vertices, len(points))
    points, faces, crossing = separate(points, faces, reference)
    for _ in range(_MAX_TRIMS):
        if len(points) <= n_wanted:
            break
        kept = np.arange(len(points)) >= n_wanted
        coarser = separate(*decimate(points, faces, n_wanted, reference, kept=kept), reference, max_tries=_TRIM_TRIES)
        if coarser[2] > crossing:
            break
        points, faces, crossing = coarser
    return points, faces
