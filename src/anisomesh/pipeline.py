"""From a mesh to an anisotropic mesh: prepare, metric, embedding, CVT, dual."""

from __future__ import annotations

import logging
import os
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy.typing as npt

from anisomesh.attributes.lost import losses_of_attributes
from anisomesh.attributes.model import Mesh
from anisomesh.attributes.transfer import oriented_as, transferred
from anisomesh.caveats import (
    caveats,
    lengths_beyond,
    losses_of_repair,
    losses_of_shape,
    unfollowed_sizes,
    unused_metric,
)
from anisomesh.counts.search import smallest_within
from anisomesh.counts.target import read_target
from anisomesh.delaunay.meshing import ValidMesh
from anisomesh.errors import OptionError
from anisomesh.execution.deadline import Deadline
from anisomesh.execution.progress import OnStep, StepInfo, ignore_steps
from anisomesh.execution.run import OPTIMISATION_SHARE, Run
from anisomesh.io.meshes import mesh_of
from anisomesh.junctions.join import JoinTask, are_resolved, sites_for
from anisomesh.mesh.surface import Surface
from anisomesh.metric.conformity import Conformity, MetricExtent, conformity
from anisomesh.metric.unit_edges import UnitMetric
from anisomesh.options import MIN_VERTICES, RemeshOptions, with_overrides
from anisomesh.resolve import embedding_name
from anisomesh.result import RemeshResult
from anisomesh.setup.inputs import prepared_input, with_split_sides
from anisomesh.setup.lock import Cut, cut_locked
from anisomesh.setup.measured import count_for_length, unit_of_lengths
from anisomesh.setup.tasks import Finer, Tasks, set_up
from anisomesh.starts import SOUND, MadeMesh, MeshTask, badness, valid_mesh

logger = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True, eq=False)
class Manner:
    """What a remesh with a number of vertices begins with, and what counts.

    Attributes
    ----------
    nearest
        Whether the distance counts more than the shape.
    asked
        The length of edges in the metric, if that was asked for.
    finer
        A mesh with more vertices to begin with, None for a random start.
    """

    nearest: bool = False
    asked: float | None = None
    finer: Finer | None = None


_PLAIN = Manner()


@dataclass(frozen=True, eq=False)
class RemeshedLevel:
    """A result, and what a coarser level of detail takes over from it, None if nothing."""

    result: RemeshResult
    finer: Finer | None


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
        Vertices of the result, at least 4. Without this, ``ratio`` and ``max_error`` the option ``edge_length``,
        ``size_field`` or ``metric``, if it is tensors, says how many.
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
    cut = cut_input(given, options, run)
    prepared, remeshed = cut.whole.surface, partial(joined_or_apart, given, cut)
    if max_error is not None:
        options = replace(options, denoise=False)  # the distance asked for refers to the input itself

        def with_vertices(n: int) -> RemeshResult:
            run.on_step(StepInfo(stage="search", message=f"{n:,} vertices"))
            return remeshed(n, options, run, Manner(nearest=True)).result

        result = smallest_within(with_vertices, prepared, max_error, deadline, least=cut.least)
        result = replace(result, warnings=(*unused_metric(options), *result.warnings))
    elif n_vertices is None and ratio is None:
        n = max(cut.least, cut.n_more + count_for_length(cut.rest, options, run))
        result = remeshed(n, options, run, Manner(asked=options.absolute_length)).result
    else:
        n = n_vertices or max(MIN_VERTICES, round((ratio or 0.0) * prepared.n_points))
        result = remeshed(n, options, run).result
    if cut.is_all:
        result = replace(result, warnings=cut.remarks)
    elif n_vertices is None and ratio is None:
        result = replace(result, warnings=(*lengths_beyond(prepared, options, max_error), *result.warnings))
    return with_attributes(result, given, cut, options, run)


def cut_input(given: Mesh, options: RemeshOptions, run: Run, *, joined: bool = True, connected: bool = False) -> Cut:
    """Return the prepared mesh without what is locked, cut at its junctions if sheets are to be joined there.

    If ``connected``, junctions that are connected to locked faces keep all edges.
    """
    with run.stage("prepare"):
        return cut_locked(prepared_input(given, options, joined=joined), given, options, connected=connected)


def with_attributes(result: RemeshResult, given: Mesh, cut: Cut, options: RemeshOptions, run: Run) -> RemeshResult:
    """Return a result with everything that a mesh carries, without attributes with its unit."""
    if given.is_bare or not options.attributes:
        return replace(result, mesh=result.mesh.in_unit_of(given))

    def oriented(mesh: Mesh) -> Mesh:
        return oriented_as(mesh, result.prepared) if result.prepare_report.faces_flipped else mesh

    with run.stage("attributes"):
        source = oriented(with_split_sides(given, result.prepare_report, options))
        mesh = transferred(source, result.surface)
        if cut.locked.any():
            mesh = cut.with_exact_attributes(mesh, oriented(given))
    warnings = (*result.warnings, *losses_of_attributes(given, mesh))
    return replace(result, mesh=mesh, seconds=run.total_seconds(), warnings=warnings)


def joined_or_apart(
    given: Mesh, cut: Cut, n: int, options: RemeshOptions, run: Run, manner: Manner = _PLAIN
) -> RemeshedLevel:
    """Remesh a prepared surface with n vertices, its sheets joined at junctions; apart if that has fewer faults.

    Where sheets cannot be joined beside locked faces, they are if the junctions that these touch stay as they are.
    """
    junctions, first = cut.rest.junctions, None
    if junctions is None or cut.locked.any() or are_resolved(junctions, cut.count_of_rest(n)):
        first = _remesh(cut, n, options, run, manner)
        if first is not None and junctions is None:
            return first
    best, fresh = first, replace(manner, finer=None)
    for way in ({"connected": True}, {"joined": False}):
        late = run.deadline.share(OPTIMISATION_SHARE).passed()
        if best is not None and (late or badness(best.result.validity) == SOUND):
            break
        if "connected" in way and (late or not cut.locked.any()):
            continue
        logger.info("the sheets cannot be joined well with %d vertices; remeshing with %s", n, way)
        other = cut_input(given, options, run, **way)
        made = _remesh(other, n, options, run, fresh) if "joined" in way or other.least <= n else None
        if made is not None and (best is None or badness(made.result.validity) < badness(best.result.validity)):
            best = made
    if best is None:
        raise AssertionError("a mesh without junctions was not joined")
    return best if best is first else replace(best, finer=None if first is None else first.finer)


def _remesh(cut: Cut, n: int, options: RemeshOptions, run: Run, manner: Manner) -> RemeshedLevel | None:
    """Remesh what is not locked, such that the whole has n vertices; None if sheets cannot be joined."""
    source, prepared = cut.rest, cut.whole.prepared
    n_rest, junctions = cut.count_of_rest(n), source.junctions
    n_sites = n_rest if junctions is None else sites_for(junctions, n_rest)
    tasks = set_up(source, n_sites, options, run, nearest=manner.nearest, finer=manner.finer)
    measured, task, asked = tasks.measured, tasks.dual, manner.asked
    source, frame, field = measured.source, measured.frame, measured.field
    if tasks.start is None:
        run.check_time()
    order = task.voronoi.embedded.face_order
    join = None if junctions is None else JoinTask(task, junctions, frame, n_rest)
    made = valid_mesh(MeshTask(task, tasks.fit, join, tasks.start), measured.options, run)
    if made is None:
        return None
    mesh, optimised = made.mesh, made.optimised
    is_joined = cut.whole.junctions is not None and (junctions is None or made.joined)
    agreement = _agreement(mesh, tasks, asked) if asked or task.error_weights is not None else None
    rest, reference = (Surface(source.to_model(each.points, frame), each.faces) for each in (mesh, measured.surface))
    surface, validity = cut.checked(rest, reference, made.validity, run.deadline)
    said = replace(measured.options, lock=cut.locked) if cut.locked.any() else measured.options
    result = RemeshResult(
        surface=surface,
        mesh=Mesh(surface=surface),
        prepared=cut.whole.surface,
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
            *losses_of_repair(prepared.report, joined=is_joined),
            *cut.remarks,
            *_said_of_mesh(made, tasks),
            *caveats(n, field.noise, replace(mesh, points=surface.points), validity, optimised, said),
            *(() if agreement is None else unfollowed_sizes(agreement)),
        ),
        conformity=agreement,
        metric=UnitMetric(
            placed=tasks.sizing,
            frame=frame,
            n_vertices=surface.n_points,
            asked=None if asked is None else asked / unit_of_lengths(measured.options, frame),
        ),
        feature_distance=made.feature_distance * frame.scale,
    )
    return RemeshedLevel(result, Finer(tasks, optimised))


def _said_of_mesh(made: MadeMesh, tasks: Tasks) -> tuple[str, ...]:
    """Return what a user should know of the measured surface, its metric and the shape of a mesh of it."""
    measured, mesh = tasks.measured, Surface(made.mesh.points, made.mesh.faces)
    places, distance = tasks.dual.corner_places, made.feature_distance
    shape = losses_of_shape(measured.surface, mesh, places, distance, measured.followed)
    return (*measured.remarks, *measured.field.remarks, *shape)


def _agreement(mesh: ValidMesh, tasks: Tasks, asked: float | None) -> Conformity:
    """Return how well the edges of a mesh have the lengths that the metric asks for."""
    return conformity(
        Surface(mesh.points, mesh.faces),
        tasks.metric,
        MetricExtent.of(tasks.metric.surface.surface, tasks.metric.field),
        asked=asked,
        unit=unit_of_lengths(tasks.measured.options, tasks.measured.frame),
    )
