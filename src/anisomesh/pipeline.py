"""From a mesh to an anisotropic mesh: prepare, metric, embedding, CVT, dual."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy.typing as npt

from anisomesh.attributes.model import Mesh
from anisomesh.attributes.transfer import oriented_as, transfer_attributes
from anisomesh.caveats import caveats, losses_of_attributes, losses_of_repair, losses_of_shape
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
from anisomesh.inputs import PreparedInput, prepared_input
from anisomesh.io.convert import as_surface
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import Validity, check_validity
from anisomesh.options import MIN_VERTICES, RemeshOptions, read_target, with_overrides
from anisomesh.resolve import (
    cvt_options,
    embedding_name,
)
from anisomesh.result import RemeshResult
from anisomesh.search import smallest_within
from anisomesh.tasks import set_up
from anisomesh.voronoi.restricted import RestrictedVoronoi

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
        Points (V, 3) together with ``faces``, or what :func:`~anisomesh.io.convert.as_surface` takes, or a
        :class:`Mesh`, of which the result has everything in its ``mesh``.
    faces
        Triangles (F, 3), if the first argument is an array of points.
    n_vertices
        Vertices of the result, at least 4.
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
    given = mesh if isinstance(mesh, Mesh) and faces is None else Mesh(surface=as_surface(mesh, faces))
    n_vertices, ratio, max_error = read_target(n_vertices, ratio, max_error)
    with run.stage("prepare"):
        source = prepared_input(given, options)
    prepared = source.prepared.surface
    if max_error is not None:
        options = replace(options, denoise=False)  # the distance asked for refers to the input itself

        def with_vertices(n: int) -> RemeshResult:
            run.on_step(StepInfo(stage="search", message=f"{n:,} vertices"))
            return _remesh(source, n, options, run, nearest=True)

        result = smallest_within(with_vertices, prepared, max_error, deadline)
    else:
        n = n_vertices or max(MIN_VERTICES, round((ratio or 0.0) * prepared.n_points))
        result = _remesh(source, n, options, run)
    return _with_attributes(result, given, run) if options.attributes else result


def _with_attributes(result: RemeshResult, given: Mesh, run: Run) -> RemeshResult:
    """Return a result with everything that a mesh carries."""
    if given.is_bare:
        return result
    with run.stage("attributes"):
        source = oriented_as(given, result.prepared) if result.prepare_report.faces_flipped else given
        mesh = transfer_attributes(source, result.surface)
    warnings = (*result.warnings, *losses_of_attributes(given, mesh))
    return replace(result, mesh=mesh, seconds=run.total_seconds(), warnings=warnings)


def _remesh(source: PreparedInput, n: int, options: RemeshOptions, run: Run, *, nearest: bool = False) -> RemeshResult:
    """Remesh a prepared surface with n vertices; ``nearest`` if the distance counts more than the shape."""
    prepared, tasks = source.prepared, set_up(source, n, options, run, nearest=nearest)
    frame, task, field = tasks.frame, tasks.dual, tasks.field
    run.check_time()
    made = _valid_mesh(task, tasks.fit, tasks.options, run)
    mesh, optimised, validity = made.mesh, made.optimised, made.validity
    surface = Surface(frame.to_model(mesh.points), mesh.faces)
    return RemeshResult(
        surface=surface,
        mesh=Mesh(surface=surface),
        prepared=prepared.surface,
        prepare_report=prepared.report,
        working=task.voronoi.embedded.surface,
        tensors=field.tensors,
        corner_tensors=field.corner_tensors,
        embedding_name=embedding_name(tasks.options),
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
            *tasks.remarks,
            *field.remarks,
            *losses_of_shape(
                tasks.surface, Surface(mesh.points, mesh.faces), task.corner_places, made.feature_distance
            ),
            *caveats(n, field.noise, mesh, validity, optimised, tasks.options),
        ),
        feature_distance=made.feature_distance * frame.scale,
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
            cvt_options(options),
            feedback=DualFeedback(dual_squared_errors, missing_on_creases),
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
    return _Made(
        mesh=mesh, optimised=optimised, validity=validity, feature_distance=feature_distance, seed=options.seed
    )
