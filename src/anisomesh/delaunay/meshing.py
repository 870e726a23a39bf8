"""From optimised sites to a valid mesh with the number of vertices asked for."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from anisomesh._arrays import EdgeEnds, Faces, PointMask, Points, PointScalars, PointTensors, Sites
from anisomesh.delaunay.delta_complex import simplicial_mesh
from anisomesh.delaunay.dual import dual_mesh
from anisomesh.delaunay.faults import points_at_faults
from anisomesh.delaunay.feature_mesh import FeatureMesh, edges_left, renumbered
from anisomesh.delaunay.placement import place_vertices
from anisomesh.delaunay.search_trees import SearchTrees
from anisomesh.delaunay.topology_control import ControlledCells, control_topology
from anisomesh.execution.deadline import NO_DEADLINE, Deadline
from anisomesh.features.network import FeatureNetwork
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import faulty_faces
from anisomesh.meshops.anchoring.anchored import anchored
from anisomesh.meshops.anchors import Anchors
from anisomesh.meshops.decimation import decimate_facing, ends_of_creases
from anisomesh.meshops.edge_recovery import recover_edges
from anisomesh.meshops.flip import flip_for_shape
from anisomesh.meshops.held import Held, at_places
from anisomesh.meshops.inverted import remove_inverted_triangles
from anisomesh.meshops.self_intersections import remove_self_intersections
from anisomesh.meshops.split import split_longest_edges
from anisomesh.metric.tensors import metric_root
from anisomesh.metric.transfer import transfer_metric_roots
from anisomesh.voronoi.cells import CellComplex
from anisomesh.voronoi.restricted import RestrictedVoronoi

MAX_REPEATS = 4  # with more sites at faults; some procedural folds keep faults after two
_MAX_TRIMS = 3  # rounds of collapses after the removal of self-intersections has added points
_TRIM_TRIES = 50  # pairs looked at in each of these
_MAX_TRIES, _MAX_TRIES_COARSENED = 300, 1_000  # pairs of intersecting triangles looked at; for a coarsened input
MAX_LOCKED_SHARE = 0.5  # of the vertices asked for: corners that collapses leave alone
MAX_FIXED_SHARE = 0.6  # of the vertices asked for: points that creases fix; heuristic, chosen on training meshes


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshingTask:
    """What a mesh is made from, besides sites.

    Attributes
    ----------
    voronoi
        The diagram over the embedded surface.
    features
        Boundary and creases of the surface.
    surface
        The surface to mesh, against which faults are counted; the embedded one may differ by a tolerance.
    tensors
        The metric at the points of the embedded surface (V, 3, 3).
    n_vertices
        Vertices asked for.
    deadline
        When to stop repairing faults.
    error_weights
        Weights (V,) of squared distances, by which points that the dual misses are found; None for 1 everywhere.
    anchors
        Where the mesh has vertices, and edges of its boundary, in any case.
    trees
        Search trees, shared by tasks on the same surfaces.
    """

    voronoi: RestrictedVoronoi
    features: FeatureNetwork
    surface: Surface
    tensors: PointTensors
    n_vertices: int
    deadline: Deadline = NO_DEADLINE
    error_weights: PointScalars | None = None
    anchors: Anchors = field(default_factory=Anchors)
    trees: SearchTrees = field(default_factory=SearchTrees)

    @property
    def reference(self) -> ClosestPoints:
        """Closest points of the surface to mesh."""
        return self.trees.of(self.surface)

    @property
    def embedded_reference(self) -> ClosestPoints:
        """Closest points of the embedded surface in space, on which the metric is known."""
        return self.trees.of(self.voronoi.embedded.surface)

    @cached_property
    def corner_places(self) -> Points:
        """Points of the surface that are corners of creases or apexes (n, 3)."""
        places = self.features.corner_places(self.voronoi.embedded.surface)
        return places[renumbered(places, self.surface.points) >= 0]

    @cached_property
    def roots(self) -> PointTensors:
        """Symmetric square roots of the metric (V, 3, 3)."""
        return metric_root(self.tensors)

    def decimated(self, mesh: Surface, n: int, held: PointMask, creases: EdgeEnds) -> tuple[Surface, EdgeEnds]:
        """Return a mesh and its crease edges decimated to n points, which do not move, if possible."""
        fewer = decimate_facing(mesh, n, self.reference, held=held, crease_edges=creases, deadline=self.deadline)
        return fewer.surface, fewer.crease_edges


@dataclass(frozen=True, kw_only=True, eq=False)
class ValidMesh:
    """A valid mesh and how it was reached.

    Attributes
    ----------
    points, faces
        The mesh in space, in the units of the embedded surface.
    crease_edges
        Ends of its edges along creases (n, 2).
    cells
        The cell components of the diagram that it is dual to.
    inserted
        Points added: sites for the topology and creases, and points on duplicate edges.
    removed
        Points removed again by edge collapses.
    from_input
        Whether the surface was coarsened, because its topology needs many more sites.
    """

    points: Points
    faces: Faces
    crease_edges: EdgeEnds
    cells: CellComplex
    inserted: int
    removed: int
    from_input: bool


def mesh_from_sites(task: MeshingTask, sites: Sites) -> ValidMesh:
    """Return the dual of the diagram of these sites, made valid, with the vertices asked for where possible.

    Parameters
    ----------
    task
        What the mesh is made from.
    sites
        Optimised positions (S, d).

    Notes
    -----
    1. Topology control: while a cell is not a disk, new sites go on a noncontractible loop in it; also where a closed
       component has fewer than four cells, a cell has two boundary intervals, or a boundary loop has fewer than three;
       and, within a limit, to corners and long intervals of creases without a cell. Nothing else moves.
    2. When all cells are disks with at most one boundary interval the dual is homeomorphic to the surface. Points on
       edges that occur twice make the delta complex a simplicial mesh.
    3. Flips recover edges between vertices that follow each other on a crease. Vertices move to anchors, or are added
       there, and the outline becomes the boundary; no later step moves or removes these.
    4. Surplus points are removed by edge collapses with the link condition, cheapest first. Where creases fix more than
       a share of the vertices asked for, collapses do not follow them: they would remove all points beside the creases.
    5. Inverted triangles are repaired by flips, moves, collapses and splits.
    6. Edges are flipped where that improves triangles in the metric, and the longest split if points are missing.
    7. Self-intersections that the surface does not have are removed; added points are compensated by collapses.
    8. Where triangles are still inverted, flat or intersecting, sites are added and all is repeated, at most four
       times. The result has more vertices in all only if that makes it valid.

    If step 1 or 2 fails (a tube thinner than the distance between sites), the surface is coarsened by the same
    collapses. Every step is bounded, and steps 4 to 7 keep the topology, so the result is a manifold with its topology.

    References
    ----------
    NASM, refinement of the dual; Edelsbrunner, Shah, "Triangulating topological spaces", 1997.
    """
    reference, n_start = task.reference, len(sites)
    best = trial = _attempt(task, *_dual_of_sites(task, sites), n_start)
    faulty = bad = faulty_faces(Surface(best.points, best.faces), reference)
    for _ in range(MAX_REPEATS):
        if len(bad) == 0 or trial.from_input or task.deadline.passed():
            break
        corners = trial.points[trial.faces[bad]]
        more = points_at_faults(corners, task.embedded_reference, task.voronoi.embedded, sites, task.features.spacing)
        if len(more) == 0:
            break
        sites = np.concatenate([sites, more])
        trial = _attempt(task, *_dual_of_sites(task, sites), n_start)
        bad = faulty_faces(Surface(trial.points, trial.faces), reference)
        as_few = len(trial.points) <= max(task.n_vertices, len(best.points))
        if len(bad) == 0 or (len(bad) < len(faulty) and as_few):
            best, faulty = trial, bad
    return best


def mesh_of_dual(task: MeshingTask, sites: Sites) -> ValidMesh | None:
    """Return the mesh of steps 1 to 7 of :func:`mesh_from_sites`, None if the surface would have to be coarsened."""
    controlled, dual = _dual_of_sites(task, sites)
    return None if dual is None else _attempt(task, controlled, dual, len(sites))


def _attempt(task: MeshingTask, controlled: ControlledCells, dual: FeatureMesh | None, n_start: int) -> ValidMesh:
    """Return the mesh of cells, of which the first sites were optimised: steps 4 to 7 of :func:`mesh_from_sites`."""
    mesh = dual or _with_anchors(task, FeatureMesh.of(task.surface)) or FeatureMesh.of(task.surface)
    n_first = len(mesh.points)
    mesh = _coarsened(task, _without_inverted(task, mesh))
    roots = transfer_metric_roots(task.embedded_reference, task.roots, mesh.points)
    points = mesh.points
    faces = flip_for_shape(points, mesh.faces, roots, task.reference, kept=mesh.crease_edges)
    if len(points) < task.n_vertices:
        kept = np.concatenate([mesh.crease_edges, task.anchors.outline_in(Surface(points, faces))])
        points, faces = split_longest_edges(points, faces, task.n_vertices, task.reference, roots, kept=kept)
    found = FeatureMesh(points, faces, mesh.crease_edges, np.zeros(len(points), dtype=bool))
    points, faces, creases = _without_crossings(task, found, _MAX_TRIES if dual is not None else _MAX_TRIES_COARSENED)
    return ValidMesh(
        points=points,
        faces=faces,
        crease_edges=creases,
        cells=controlled.cells,
        inserted=max(n_first - n_start, 0) if dual is not None else 0,
        removed=max(n_first - len(points), 0),
        from_input=dual is None,
    )


def _dual_of_sites(task: MeshingTask, sites: Sites) -> tuple[ControlledCells, FeatureMesh | None]:
    """Return the cells of sites and their dual in space, steps 1 to 3."""
    controlled = control_topology(task.voronoi, sites, task.features, task.n_vertices)
    return controlled, _dual_in_space(task, controlled)


def _dual_in_space(task: MeshingTask, controlled: ControlledCells) -> FeatureMesh | None:
    """Return the dual in space, steps 2 and 3; None if it is not homeomorphic to the surface or cannot be anchored."""
    if not controlled.complete:
        return None
    cells, creased = controlled.cells, controlled.creased
    points, faces, simplicial = simplicial_mesh(dual_mesh(cells))
    if not simplicial:
        return None
    space = place_vertices(cells, task.features, controlled.boundary, creased, points, faces)
    faces = recover_edges(space, faces, creased.paths, task.reference)
    links = edges_left(faces, creased.links)
    locked = np.zeros(len(space), dtype=bool)
    locked[creased.cell[creased.corner][: int(MAX_LOCKED_SHARE * task.n_vertices)]] = True
    return _with_anchors(task, FeatureMesh(space, faces, links, locked))


def _with_anchors(task: MeshingTask, mesh: FeatureMesh) -> FeatureMesh | None:
    """Return the mesh with the anchors of the task, which are locked, and their outline; None if that fails."""
    found = anchored(mesh.points, mesh.faces, mesh.crease_edges, task.anchors, task.reference)
    if found is None:
        return None
    locked = at_places(found[0], mesh.points[mesh.locked]) | task.anchors.held_in(found[0])
    return FeatureMesh(*found, locked)


def _without_inverted(task: MeshingTask, mesh: FeatureMesh) -> FeatureMesh:
    """Return the mesh with inverted triangles repaired, and the crease edges and locked points that have not moved."""
    points, faces, _ = remove_inverted_triangles(
        mesh.points, mesh.faces, task.reference, held=Held(task.anchors.places), deadline=task.deadline
    )
    if points is mesh.points:
        return FeatureMesh(points, faces, mesh.crease_edges, mesh.locked)
    number = renumbered(mesh.points, points)
    locked = np.zeros(len(points), dtype=bool)
    locked[number[mesh.locked & (number >= 0)]] = True
    links = number[mesh.crease_edges]
    return FeatureMesh(points, faces, links[(links >= 0).all(axis=1)], locked)


def _coarsened(task: MeshingTask, mesh: FeatureMesh) -> FeatureMesh:
    """Return the mesh with no more vertices than asked for, if collapses can do that: step 4."""
    if len(mesh.points) <= (n := task.n_vertices):
        return mesh
    surface, creases = Surface(mesh.points, mesh.faces), mesh.crease_edges
    anchored = task.anchors.held_in(mesh.points)
    fixed = (mesh.locked | ends_of_creases(creases, surface.n_points)) & ~anchored
    if np.count_nonzero(fixed) <= MAX_FIXED_SHARE * (n - np.count_nonzero(anchored)):
        surface, creases = task.decimated(surface, n, mesh.locked, creases)
    if surface.n_points > n:  # fewer than the creases need
        anchored = task.anchors.held_in(surface.points)
        surface, creases = task.decimated(surface, n, anchored, creases[:0])
    none = np.zeros(surface.n_points, dtype=bool)
    return _without_inverted(task, FeatureMesh(surface.points, surface.faces, creases, none))


def _without_crossings(task: MeshingTask, mesh: FeatureMesh, tries: int) -> tuple[Points, Faces, EdgeEnds]:
    """Return the mesh and its crease edges, without new self-intersections and with no more points where possible."""
    reference, n_wanted, held = task.reference, max(task.n_vertices, len(mesh.points)), task.anchors.places
    points, faces, crossing = remove_self_intersections(
        mesh.points, mesh.faces, reference, held=Held(held), max_tries=tries, deadline=task.deadline
    )
    creases = edges_left(faces, renumbered(mesh.points, points)[mesh.crease_edges])
    for _ in range(_MAX_TRIMS):
        if len(points) <= n_wanted:
            break
        stays = (np.arange(len(points)) >= n_wanted) | at_places(points, held)
        found, left = task.decimated(Surface(points, faces), n_wanted, stays, creases)
        coarser = remove_self_intersections(
            found.points, found.faces, reference, held=Held(held), max_tries=_TRIM_TRIES, deadline=task.deadline
        )
        if coarser[2] > crossing:
            break
        points, faces, crossing = coarser
        creases = edges_left(faces, renumbered(found.points, points)[left])
    return points, faces, creases
