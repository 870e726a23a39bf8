"""The mesh of a task: optimised sites, their dual, and the fit, from one seed after the other until it has no fault."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from functools import partial

from anisomesh._arrays import Sites
from anisomesh.cvt.lbfgs import Optimised
from anisomesh.cvt.schedule import DualFeedback, optimise_sites
from anisomesh.delaunay.creases import missing_on_creases
from anisomesh.delaunay.dual import dual_squared_errors
from anisomesh.delaunay.meshing import MeshingTask, ValidMesh, mesh_from_sites, mesh_of_dual
from anisomesh.execution.run import OPTIMISATION_SHARE, Run
from anisomesh.features.tagged import distance_to_crease_edges
from anisomesh.fitting.target import FitTarget
from anisomesh.fitting.valid import fit_without_faults
from anisomesh.io.describe import soundness
from anisomesh.junctions.join import MAX_FAULTS, Conforming, JoinTask
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import Validity, check_validity
from anisomesh.options import RemeshOptions
from anisomesh.resolve import cvt_options
from anisomesh.voronoi.restricted import RestrictedVoronoi

logger = logging.getLogger(__name__)

MAX_STARTS = 3  # of the optimisation, with one seed after the other, for a mesh without faults


@dataclass(frozen=True, eq=False)
class MeshTask:
    """How a mesh is made from sites, what it is fitted to, and how its sheets are joined; None if that is not done.

    ``start`` are positions (S, d) with which the first try begins in place of random ones.
    """

    dual: MeshingTask
    fit: FitTarget | None
    join: JoinTask | None
    start: Sites | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class MadeMesh:
    """A mesh, whether its sheets are joined, its distance from prescribed edges, its sites and their seed."""

    mesh: ValidMesh
    optimised: Optimised
    validity: Validity
    feature_distance: float
    seed: int
    joined: bool


def valid_mesh(task: MeshTask, options: RemeshOptions, run: Run) -> MadeMesh | None:
    """Return the mesh of a task; from other random starts while it has faults that the input does not explain.

    None if its sheets cannot be joined.
    """
    best = made = _mesh_of_start(task, options, run)
    first = options.seed + (task.start is None)
    for seed in range(first, first + MAX_STARTS - 1):
        if best is None or made is None or not best.validity.faults or run.deadline.passed():
            break
        if task.join is not None and best.validity.faults > MAX_FAULTS:
            break
        if made.validity.self_intersections_input > 0 or made.mesh.from_input:
            break
        fresh = replace(task.dual, voronoi=RestrictedVoronoi(task.dual.voronoi.embedded, threads=options.threads))
        made = _mesh_of_start(replace(task, dual=fresh, start=None), replace(options, seed=seed), run)
        if made is not None and made.validity.faults < best.validity.faults:
            best = made
    return best


def _mesh_of_start(start: MeshTask, options: RemeshOptions, run: Run) -> MadeMesh | None:
    """Return the mesh of a task from the sites that start from the seed of the options; None if it cannot be joined."""
    task, target, join = start.dual, start.fit, start.join
    with run.stage("cvt"):
        optimised = optimise_sites(
            task.voronoi,
            task.n_vertices,
            task.features,
            cvt_options(options, sized=task.error_weights is not None, warm=start.start is not None),
            feedback=DualFeedback(partial(dual_squared_errors, weights=task.error_weights), missing_on_creases),
            start=start.start,
            on_step=run.on_step,
            deadline=run.deadline.share(OPTIMISATION_SHARE),
        )
    with run.stage("dual"):
        meshed = _meshed(task, join, optimised.sites, run)
        if meshed is None:
            return None
        mesh, conforming = meshed
    with run.stage("fit"):
        surface = Surface(mesh.points, mesh.faces)
        feature_distance = distance_to_crease_edges(
            task.voronoi.embedded.surface, task.features.required, surface, mesh.crease_edges
        )
        if target is not None:
            surface = fit_without_faults(surface, target, crease_edges=mesh.crease_edges, deadline=run.deadline)
            mesh = replace(mesh, points=surface.points, faces=surface.faces, crease_edges=mesh.crease_edges[:0])
        if conforming is not None and join is not None:
            surface = join.joined(conforming, surface)
            mesh = replace(mesh, points=surface.points, faces=surface.faces)
        validity = check_validity(surface, task.reference, None if join is None else join.junctions.whole)
    facts = options.seed, optimised.iterations, optimised.status, soundness(validity)
    logger.info("seed %d: %d iterations, %s; mesh: %s", *facts)
    return MadeMesh(
        mesh=mesh,
        optimised=optimised,
        validity=validity,
        feature_distance=feature_distance,
        seed=options.seed,
        joined=conforming is not None,
    )


def _meshed(
    task: MeshingTask, join: JoinTask | None, sites: Sites, run: Run
) -> tuple[ValidMesh, Conforming | None] | None:
    """Return the mesh of sites, and with its seam if its sheets are to be joined and conform.

    None if they are not joined well, and there is time to remesh what is better apart. That is found out before costly
    repairs: a surface coarsened for want of sites crowds vertices at junctions, and has inverted triangles there.
    """
    if join is None:
        return mesh_from_sites(task, sites), None
    mesh = mesh_of_dual(task, sites)
    conforming = None if mesh is None else join.conforming(mesh)
    if conforming is not None:
        return conforming.mesh, conforming
    if not run.deadline.share(OPTIMISATION_SHARE).passed():
        return None
    return join.apart(mesh_from_sites(task, sites) if mesh is None else mesh), None
