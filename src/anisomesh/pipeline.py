"""From a mesh to an anisotropic mesh: prepare, metric, embedding, CVT, dual."""

from __future__ import annotations

import logging
import os
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy.typing as npt

from anisomesh.attributes.model import Mesh
from anisomesh.attributes.transfer import oriented_as, transfer_attributes
from anisomesh.caveats import caveats, losses_of_attributes, losses_of_repair, losses_of_shape, unfollowed_sizes
from anisomesh.counts.search import smallest_within
from anisomesh.cvt.lbfgs import Optimised
from anisomesh.cvt.schedule import DualFeedback, optimise_sites
from anisomesh.delaunay.creases import missing_on_creases
from anisomesh.delaunay.dual import dual_squared_errors
from anisomesh.delaunay.meshing import MeshingTask, ValidMesh, mesh_from_sites
from anisomesh.errors import OptionError
from anisomesh.execution.deadline import Deadline
from anisomesh.execution.progress import OnStep, StepInfo, ignore_steps
from anisomesh.execution.run import OPTIMISATION_SHARE, Run
from anisomesh.features.tagged import distance_to_crease_edges
from anisomesh.fitting.target import FitTarget
from anisomesh.fitting.valid import fit_without_faults
from anisomesh.io.describe import soundness
from anisomesh.io.meshes import mesh_of
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import Validity, check_validity
from anisomesh.metric.conformity import Conformity, MetricExtent, conformity
from anisomesh.options import MIN_VERTICES, RemeshOptions, read_target, with_overrides
from anisomesh.resolve import cvt_options, embedding_name
from anisomesh.result import RemeshResult
from anisomesh.setup.inputs import prepared_input
from anisomesh.setup.lock import Cut, cut_locked
from anisomesh.setup.measured import count_for_length, unit_of_lengths
from anisomesh.setup.tasks import Tasks, set_up
from anisomesh.voronoi.restricted import RestrictedVoronoi

logger = logging.getLogger(__name__)

MAX_STARTS = 3  # of the optimisation, with one seed after the other, for a mesh without faults


def remesh(
    mesh: Any,
    faces: npt.NDArray[Any] | None = None,
    *,
    n_vertices: int | None = None,
    ratio: float | None = None,
    max_error: float | None = None,
    options: RemeshOptions | None = None,
    on_step: OnStep | None = None,
    **overrides: Any,
) -> RemeshResult:
    """Remesh a triangle mesh anisotropically.

    Parameters
    ----------
    mesh
        The name of a mesh file; points (V, 3) together with ``faces``; what
        :func:`~anisomesh.io.convert.as_surface` takes; or a :class:`Mesh`, of which the result has everything in its
        ``mesh``.
    faces
        Triangles (F, 3), if the first argument is an array of points.
    n_vertices
        Vertices of the result, at least 4. Without this, ``ratio`` and ``max_error`` the option ``edge_length`` or
        ``size_field`` says how many.
    ratio
        Instead of ``n_vertices``: vertices as a share of those of the prepared input.
    max_error
        Instead of ``n_vertices``: the largest distance between the surfaces, both ways, in model units. The smallest
        sufficient number of vertices is found, to 3 %, by remeshing several times; noise is not removed.
    options
        See :class:`RemeshOptions`; keyword arguments of the same names take precedence.
    on_step
        Called with a :class:`StepInfo` as the work proceeds; an exception it raises ends the work.

    Returns
    -------
    RemeshResult
        The mesh and everything it was made from; ``warnings`` says where it differs from what was asked for.

    Raises
    ------
    MeshFileError
        If the file cannot be read.
    MeshError
        If the input is not a mesh, or nothing is left of it after the repair.
    MetricError
        If tensors are not symmetric positive definite, or a metric source returns something else.
    OptionError
        If an option is out of range, or even four times the vertices of the input exceed ``max_error``.
    TimeLimitError
        If the time limit was over before the optimisation began.

    References
    ----------
    "NASM: Neural Anisotropic Surface Meshing", SIGGRAPH Asia 2024.
    """
    options = with_overrides(RemeshOptions() if options is None else options, overrides)
    deadline = Deadline(options.time_limit)
    if on_step is not None and not callable(on_step):
        raise OptionError(f"on_step = {on_step!r}; expected a function of a StepInfo")
    run = Run(on_step or ignore_steps, deadline)
    n_vertices, ratio, max_error = read_target(n_vertices, ratio, max_error, options)
    with run.stage("load") if isinstance(mesh, str | os.PathLike) else nullcontext():
        given = mesh_of(mesh, faces)
    with run.stage("prepare"):
        cut = cut_locked(prepared_input(given, options), given, options)
    prepared = cut.whole.prepared.surface
    if max_error is not None:
        options = replace(options, denoise=False)  # the distance asked for refers to the input itself

        def with_vertices(n: int) -> RemeshResult:
            run.on_step(StepInfo(stage="search", message=f"{n:,} vertices"))
            return _remesh(cut, n, options, run, nearest=True)

        result = smallest_within(with_vertices, prepared, max_error, deadline, least=cut.least)
    elif n_vertices is None and ratio is None:
        n = max(cut.least, cut.n_more + count_for_length(cut.rest, options, run))
        result = _remesh(cut, n, options, run, asked=options.absolute_length)
    else:
        n = n_vertices or max(MIN_VERTICES, round((ratio or 0.0) * prepared.n_points))
        result = _remesh(cut, n, options, run)
    if cut.is_all:
        result = replace(result, warnings=cut.remarks)
    return _with_attributes(result, given, cut, run) if options.attributes else result


def _with_attributes(result: RemeshResult, given: Mesh, cut: Cut, run: Run) -> RemeshResult:
    """Return a result with everything that a mesh carries."""
    if given.is_bare:
        return result
    with run.stage("attributes"):
        source = oriented_as(given, result.prepared) if result.prepare_report.faces_flipped else given
        mesh = cut.with_exact_attributes(transfer_attributes(source, result.surface), source)
    warnings = (*result.warnings, *losses_of_attributes(given, mesh))
    return replace(result, mesh=mesh, seconds=run.total_seconds(), warnings=warnings)


def _remesh(
    cut: Cut,
    n: int,
    options: RemeshOptions,
    run: Run,
    *,
    nearest: bool = False,
    asked: float | None = None,
) -> RemeshResult:
    """Remesh what is not locked of a prepared surface, such that the whole has n vertices.

    ``nearest`` if the distance counts more than the shape, and ``asked`` is the length of edges in the metric if that
    was asked for.
    """
    source, prepared = cut.rest, cut.whole.prepared
    tasks = set_up(source, cut.count_of_rest(n), options, run, nearest=nearest)
    measured, task = tasks.measured, tasks.dual
    frame, field = measured.frame, measured.field
    run.check_time()
    order = task.voronoi.embedded.face_order
    made = _valid_mesh(task, tasks.fit, measured.options, run)
    mesh, optimised = made.mesh, made.optimised
    agreement = _agreement(mesh, tasks, asked) if asked or task.error_weights is not None else None
    rest, reference = (Surface(source.to_model(each.points, frame), each.faces) for each in (mesh, measured.surface))
    surface, validity = cut.checked(rest, reference, made.validity, run.deadline)
    return RemeshResult(
        surface=surface,
        mesh=Mesh(surface=surface),
        prepared=prepared.surface,
        prepare_report=prepared.report,
        working=task.voronoi.embedded.surface,
        tensors=field.tensors,
        corner_tensors=None if field.corner_tensors is None else field.corner_tensors[order],
        embedding_name=embedding_name(measured.options),
        noise=field.noise,
        frame=frame,
        embedding=tasks.embedding,
        cells=mesh.cells,
        vertices_asked=n,
        energy=optimised.energy,
        iterations=optimised.iterations,
        status=optimised.status,
        inserted=mesh.inserted,
        removed=mesh.removed,
        seed=made.seed,
        validity=validity,
        seconds=run.total_seconds(),
        warnings=(
            *losses_of_repair(prepared.report),
            *cut.remarks,
            *measured.remarks,
            *field.remarks,
            *losses_of_shape(
                measured.surface, Surface(mesh.points, mesh.faces), task.corner_places, made.feature_distance
            ),
            *caveats(n, field.noise, replace(mesh, points=surface.points), validity, optimised, measured.options),
            *(() if agreement is None else unfollowed_sizes(agreement)),
        ),
        conformity=agreement,
        feature_distance=made.feature_distance * frame.scale,
    )


def _agreement(mesh: ValidMesh, tasks: Tasks, asked: float | None) -> Conformity:
    """Return how well the edges of a mesh have the lengths that the metric asks for."""
    return conformity(
        Surface(mesh.points, mesh.faces),
        tasks.metric,
        MetricExtent.of(tasks.metric.surface.surface, tasks.metric.field),
        asked=asked,
        unit=unit_of_lengths(tasks.measured.options, tasks.measured.frame),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Made:
    """A mesh, its distance from prescribed edges, the sites it was made from, and the seed of their start."""

    mesh: ValidMesh
    optimised: Optimised
    validity: Validity
    feature_distance: float
    seed: int

    @property
    def faults(self) -> int:
        """Faults that another start may avoid."""
        return self.validity.inverted + self.validity.new_intersections + self.validity.flat


def _valid_mesh(task: MeshingTask, target: FitTarget | None, options: RemeshOptions, run: Run) -> _Made:
    """Return the mesh of a task; from the next seeds while it has faults that the input does not explain."""
    best = made = _mesh_of_start(task, target, options, run)
    for seed in range(options.seed + 1, options.seed + MAX_STARTS):
        explained = made.validity.self_intersections_input > 0 or made.mesh.from_input
        if not best.faults or explained or run.deadline.passed():
            break
        fresh = RestrictedVoronoi(task.voronoi.embedded, threads=options.threads)
        made = _mesh_of_start(replace(task, voronoi=fresh), target, replace(options, seed=seed), run)
        if made.faults < best.faults:
            best = made
    return best


def _mesh_of_start(task: MeshingTask, target: FitTarget | None, options: RemeshOptions, run: Run) -> _Made:
    """Return the mesh of a task from the sites that start from the seed of the options, fitted to the target."""
    with run.stage("cvt"):
        optimised = optimise_sites(
            task.voronoi,
            task.n_vertices,
            task.features,
            cvt_options(options, sized=task.error_weights is not None),
            feedback=DualFeedback(partial(dual_squared_errors, weights=task.error_weights), missing_on_creases),
            on_step=run.on_step,
            deadline=run.deadline.share(OPTIMISATION_SHARE),
        )
    with run.stage("dual"):
        mesh = mesh_from_sites(task, optimised.sites)
    with run.stage("fit"):
        surface = Surface(mesh.points, mesh.faces)
        feature_distance = distance_to_crease_edges(
            task.voronoi.embedded.surface, task.features.required, surface, mesh.crease_edges
        )
        if target is not None:
            surface = fit_without_faults(surface, target, crease_edges=mesh.crease_edges, deadline=run.deadline)
            mesh = replace(mesh, points=surface.points, faces=surface.faces, crease_edges=mesh.crease_edges[:0])
        validity = check_validity(surface, task.surface)
    facts = options.seed, optimised.iterations, optimised.status, soundness(validity)
    logger.info("seed %d: %d iterations, %s; mesh: %s", *facts)
    return _Made(
        mesh=mesh, optimised=optimised, validity=validity, feature_distance=feature_distance, seed=options.seed
    )
