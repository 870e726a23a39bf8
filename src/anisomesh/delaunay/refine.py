"""From optimised sites to a valid mesh of the asked number of vertices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh._arrays import Faces, PointMask, Points, PointTensors, Sites
from anisomesh.cvt.boundary import BoundaryArcs
from anisomesh.cvt.features import Features
from anisomesh.deadline import Stop, never
from anisomesh.delaunay.boundary import points_on_boundary
from anisomesh.delaunay.creases import CreasedCells, creased_cells, join_along_creases
from anisomesh.delaunay.delta_complex import simplicial_mesh
from anisomesh.delaunay.dual import dual_mesh
from anisomesh.delaunay.faults import faulty_faces, points_at_faults
from anisomesh.delaunay.noncontractible_loops import points_on_loops
from anisomesh.delaunay.placement import placed
from anisomesh.delaunay.small_components import points_in_components
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys, half_edges
from anisomesh.meshops.collapse import Links, decimate, fixed_by
from anisomesh.meshops.flip import flip_for_shape
from anisomesh.meshops.inverted import remove_inverted_triangles
from anisomesh.meshops.self_intersections import remove_self_intersections
from anisomesh.meshops.split import split_longest_edges
from anisomesh.metric.quality import transfer_metric_roots
from anisomesh.metric.tensors import metric_root
from anisomesh.voronoi.cells import Cells, cells_of
from anisomesh.voronoi.diagram import Diagram
from anisomesh.voronoi.restricted import RestrictedVoronoi

_Linked = tuple[Points, Faces, Links, PointMask]
"""A mesh, its edges along creases, and which of its points are to be kept."""

MAX_ROUNDS = 20
_MAX_TRIMS = 3
_TRIM_TRIES = 50
_TRIES, _TRIES_COARSENED = 300, 1_000  # pairs of triangles looked at, and of those of coarsened input
_MAX_REPEATS = 4  # with more sites where triangles are turned, flat or intersect
MAX_SHARE = 0.25  # of cells that are no disks; with more the sites are too few for this surface
MAX_CREASE_SHARE = 0.5  # of the vertices asked for: sites added on creases
MAX_KEPT = 0.5  # of the vertices asked for: corners that collapses leave alone
MAX_FIXED = 0.6  # of the vertices asked for: points that creases let go nowhere
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
    features: Features,
    scale: float,
    *,
    n_vertices: int,
    tensors: PointTensors,
    stop: Stop = never,
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
    features
        Boundary and creases of the surface.
    scale
        The factor of the first three embedded coordinates.
    n_vertices
        Vertices asked for.
    tensors
        The metric at the points of the surface (V, 3, 3).
    stop
        Asked now and then whether to mend no more.

    Notes
    -----
    1. While a cell is no disk, new sites go on a loop in it that cannot be shrunk; also where a closed component has
       fewer than four cells, where a cell has two arcs of the boundary, and where a boundary curve has fewer than
       three; and, as far as there is room, to corners and long arcs of creases that no cell belongs to. Nothing else
       moves, so little else breaks.
    2. When all cells are disks with at most one arc the dual, glued along bisector chains, is homeomorphic to the
       surface (a regular cell complex; compare the closed ball property of Edelsbrunner and Shah 1997). Points on edges
       that occur twice make it a simplicial mesh.
    3. Flips join vertices that follow each other on a crease.
    4. What this inserted is taken away by edge collapses with the link condition, cheapest first. Where creases fix
       more than a share of the vertices asked for, as on a rough surface or with few vertices, collapses do not follow
       them: they would have to take all that is beside the creases.
    5. Triangles that face away from the surface are turned back by edge flips and moves.
    6. Edges are flipped where that gives better triangles in the metric, and the longest split if points are missing.
    7. Triangles that intersect where the surface does not are taken apart; points that this takes are made up for by
       collapses elsewhere.
    8. Where triangles are turned, flat or intersect all the same, more sites are put, and all is done once more, four
       times at most. So the mesh has more vertices there, and fewer elsewhere; more in all only if it is valid then.

    Where step 1 or 2 does not succeed (a tube thinner than the distance between sites) the surface itself, which is
    valid, is coarsened by the same collapses. The paper inserts sites for every defect and optimises again; that makes
    new defects as it mends old ones.

    This ends. Step 1 takes twenty rounds at most, none of which starts with more sites than a bound; step 2 as many as
    it says; each cut of step 3 shortens a path; each round of step 4 takes a point away; step 5 has a bound on rounds
    and keeps the best mesh met; each flip of step 6 raises a bounded sum, each split brings the number nearer; step 7
    has a bound on pairs looked at; of the repeats the best is kept. Steps 4 to 7 keep the topology, change by change.
    So the mesh is a manifold with the topology of the surface however they end; turned and flat triangles and
    intersections that they leave are counted by :func:`anisomesh.mesh.validity.check_validity`.
    """
    reference = ClosestPoints(surface)
    task = _Task(voronoi, surface, plain, features, scale, n_vertices, metric_root(tensors), reference, stop)
    n_start = len(sites)
    best = _refined(task, sites, n_start)
    faulty = faulty_faces(best.points, best.faces, reference)
    trial, bad = best, faulty
    for _ in range(_MAX_REPEATS):
        if len(bad) == 0 or trial.from_input or stop():
            break
        places = trial.points[trial.faces[bad]]
        more = points_at_faults(places, reference, trial.diagram, sites, features.creases.spacing)
        if len(more) == 0:
            break
        sites = np.concatenate([sites, more])
        trial = _refined(task, sites, n_start)
        bad = faulty_faces(trial.points, trial.faces, reference)
        as_few = len(trial.points) <= max(n_vertices, len(best.points))
        if len(bad) == 0 or (len(bad) < len(faulty) and as_few):
            best, faulty = trial, bad
    return best


@dataclass(frozen=True, eq=False)
class _Task:
    """What a mesh is made from besides sites, as for :func:`refine`; of the tensors the roots."""

    voronoi: RestrictedVoronoi
    surface: Surface
    plain: Surface
    features: Features
    scale: float
    n_vertices: int
    roots: PointTensors
    reference: ClosestPoints
    stop: Stop


def _refined(task: _Task, sites: Sites, n_start: int) -> Refined:
    """Return the mesh of these sites, of which the first were optimised: steps 1 to 7 of :func:`refine`."""
    n_vertices, reference, stop = task.n_vertices, task.reference, task.stop
    diagram, cells, mesh = _dual(task, sites)
    space, faces, links, kept = mesh or _from_input(task.plain)
    n_first = len(space)
    space, faces, links, kept = _untangled(space, faces, links, kept, reference, stop)
    if len(space) > n_vertices:
        if np.count_nonzero(kept | fixed_by(links, len(space))) <= MAX_FIXED * n_vertices:
            space, faces, links = decimate(space, faces, n_vertices, reference, kept=kept, creases=links)
        if len(space) > n_vertices:  # fewer than the creases need
            space, faces, links = decimate(space, faces, n_vertices, reference)
        space, faces, links, _ = _untangled(space, faces, links, np.zeros(len(space), dtype=bool), reference, stop)
    roots = transfer_metric_roots(reference, task.roots, space)
    faces = flip_for_shape(space, faces, roots, reference, kept=links)
    if len(space) < n_vertices:
        space, faces = split_longest_edges(space, faces, n_vertices, reference, roots)
    tries = _TRIES if mesh else _TRIES_COARSENED
    space, faces = _without_crossings(space, faces, links, n_vertices, reference, tries, stop)
    return Refined(
        points=space,
        faces=faces,
        diagram=diagram,
        cells=cells,
        inserted=max(n_first - n_start, 0) if mesh else 0,
        removed=max(n_first - len(space), 0),
        from_input=mesh is None,
    )


def _dual(task: _Task, sites: Sites) -> tuple[Diagram, Cells, _Linked | None]:
    """Return diagram, cells and the dual in space: steps 1 to 3; None where cells are no disks."""
    voronoi, surface, n_vertices = task.voronoi, task.surface, task.n_vertices
    diagram, cells, arcs, creased, complete = _with_enough_sites(voronoi, sites, surface, task.features, n_vertices)
    if complete:
        points, faces, complete = simplicial_mesh(dual_mesh(diagram, cells, surface))
    if not complete:
        return diagram, cells, None
    space = placed(voronoi, diagram, cells, surface, task.features, arcs, creased, points, faces, task.scale)
    faces = join_along_creases(space, faces, creased.bridges, task.reference)
    links = creased.links[np.isin(edge_keys(creased.links), edge_keys(half_edges(faces)))]
    kept = np.zeros(len(space), dtype=bool)
    kept[creased.cell[creased.corner][: int(MAX_KEPT * n_vertices)]] = True
    return diagram, cells, (space, faces, links, kept)


def _from_input(plain: Surface) -> _Linked:
    """Return the surface itself, of which nothing is to be kept."""
    return plain.points, plain.faces, np.zeros((0, 2), dtype=np.int64), np.zeros(plain.n_points, dtype=bool)


def _with_enough_sites(
    voronoi: RestrictedVoronoi, sites: Sites, surface: Surface, features: Features, n_vertices: int
) -> tuple[Diagram, Cells, BoundaryArcs, CreasedCells, bool]:
    """Return diagram, cells, arcs and creased cells with sites added until none is missing, and whether none is."""
    most = MAX_GROWTH * n_vertices + MAX_MORE
    room = int(MAX_CREASE_SHARE * n_vertices)
    for _ in range(MAX_ROUNDS):
        diagram = voronoi.diagram(sites)
        cells = cells_of(diagram, surface.face_neighbours, voronoi.facets.area)
        bad = cells.euler != 1
        arcs = features.boundary.arcs(diagram)
        creased = creased_cells(features.creases, features.creases.arcs(diagram), arcs, cells, sites)
        missing = np.concatenate(
            [
                points_on_loops(diagram, cells, surface),
                points_in_components(diagram, cells, surface),
                points_on_boundary(arcs, features.boundary.curves, cells, sites),
            ]
        )
        complete = len(missing) == 0 and not bad.any()
        on_creases = creased.missing[:room]
        if len(missing) + len(on_creases) == 0 or bad.mean() > MAX_SHARE or len(sites) + len(missing) > most:
            break
        room -= len(on_creases)
        sites = np.concatenate([sites, missing, on_creases])
    return diagram, cells, arcs, creased, complete


def _untangled(
    points: Points, faces: Faces, links: Links, kept: PointMask, reference: ClosestPoints, stop: Stop
) -> _Linked:
    """Return the mesh with turned triangles mended, and the links and points to be kept that have not moved."""
    after, faces, _ = remove_inverted_triangles(points, faces, reference, stop=stop)
    if after is points:
        return points, faces, links, kept
    places = {point.tobytes(): number for number, point in enumerate(after)}
    number = np.array([places.get(point.tobytes(), -1) for point in points], dtype=np.int64)
    links, still = number[links], np.zeros(len(after), dtype=bool)
    still[number[kept & (number >= 0)]] = True
    return after, faces, links[(links >= 0).all(axis=1)], still


def _without_crossings(
    points: Points, faces: Faces, links: Links, n_vertices: int, reference: ClosestPoints, tries: int, stop: Stop
) -> tuple[Points, Faces]:
    """Return the mesh with intersecting triangles taken apart, and back at no more points than before if possible."""
    n_wanted = max(n_vertices, len(points))
    points, faces, crossing = remove_self_intersections(points, faces, reference, max_tries=tries, stop=stop)
    for _ in range(_MAX_TRIMS):
        if len(points) <= n_wanted:
            break
        kept = np.arange(len(points)) >= n_wanted
        points_left, faces_left, links_left = decimate(points, faces, n_wanted, reference, kept=kept, creases=links)
        coarser = remove_self_intersections(points_left, faces_left, reference, max_tries=_TRIM_TRIES, stop=stop)
        if coarser[2] > crossing:
            break
        points, faces, crossing = coarser
        links = links_left
    return points, faces
