"""From a mesh to an anisotropic mesh: prepare, metric, embedding, CVT, dual."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask
from anisomesh.cvt.features import Features
from anisomesh.cvt.optimise import Optimised, Status
from anisomesh.cvt.schedule import optimise
from anisomesh.deadline import Clock
from anisomesh.delaunay.refine import Refined, refine
from anisomesh.errors import MetricError, OptionError, TimeLimitError
from anisomesh.estimate import embedded, estimated
from anisomesh.features.detect import sharp_edges
from anisomesh.features.tagged import edges_within, tagged_edges
from anisomesh.io.convert import as_surface
from anisomesh.memory import check_memory
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import Validity, check_validity
from anisomesh.mesh.working_surface import working_surface
from anisomesh.metric.names import MetricName
from anisomesh.options import OnStep, RemeshOptions, StepInfo
from anisomesh.repair.prepare import Prepared, prepare
from anisomesh.result import RemeshResult
from anisomesh.search import MIN_VERTICES, smallest_within
from anisomesh.voronoi.restricted import RestrictedVoronoi

COUNT_TOLERANCE = 0.02  # share of the asked vertices by which the result may differ without a warning
OPTIMISATION_SHARE = 0.6  # of the time limit is for all up to the end of the optimisation


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
        Points (V, 3) together with ``faces``, or a :class:`Surface`, a ``trimesh.Trimesh`` or a
        ``pyvista.PolyData`` of triangles.
    faces
        Triangles (F, 3), if the first argument is an array of points.
    n_vertices
        Vertices of the result, at least 4.
    ratio
        Instead of ``n_vertices``: vertices as a share of those of the prepared input.
    max_error
        Instead of ``n_vertices``: the largest distance between the surfaces, both ways, in model units. The smallest
        number of vertices that does is searched for, to 3 %, by remeshing several times; noise is not taken away.
    options
        See :class:`RemeshOptions`; keyword arguments of the same names take precedence.
    on_step
        Called with a :class:`StepInfo` as the work proceeds; an exception it raises ends the work.

    Returns
    -------
    RemeshResult
        The mesh and everything it was made from. Where a valid mesh takes more vertices than asked for,
        ``warnings`` says so.

    Raises
    ------
    MeshError
        If the input is no mesh, or nothing of it is left after the repair.
    MetricError
        If given tensors are not symmetric positive definite.
    OptionError
        If an option is out of range, or no number of vertices within reason keeps to the error.
    TimeLimitError
        If the time limit was over before the optimisation began.

    References
    ----------
    "NASM: Neural Anisotropic Surface Meshing", SIGGRAPH Asia 2024.
    """
    options = _with_overrides(options or RemeshOptions(), overrides)
    clock = Clock(options.time_limit)
    run = _Run(on_step or (lambda step: None), clock)
    given = as_surface(mesh, faces)
    _check_count(n_vertices, ratio, max_error)
    with run.stage("prepare"):
        prepared = prepare(given, weld_tolerance=options.weld_tolerance)
        tagged = np.zeros(len(prepared.surface.edges), dtype=bool)
        if options.features is not None:
            tagged = tagged_edges(given, options.features, prepared.surface, options.weld_tolerance)
        wanted = options.metric
        if not isinstance(wanted, str):
            wanted = _at_prepared(np.asarray(wanted), given, prepared)
    if max_error is not None:
        options = replace(options, denoise=False)  # the distance asked for is from the input as it is

        def with_vertices(n: int) -> RemeshResult:
            run.on_step(StepInfo(stage="search", message=f"{n:,} vertices"))
            return _remesh(prepared, wanted, tagged, n, options, run)

        return smallest_within(with_vertices, prepared.surface, max_error, clock)
    n = n_vertices or max(MIN_VERTICES, round((ratio or 0.0) * prepared.surface.n_points))
    return _remesh(prepared, wanted, tagged, n, options, run)


def _remesh(
    prepared: Prepared,
    wanted: MetricName | npt.NDArray[np.float64],
    tagged: EdgeMask,
    n: int,
    options: RemeshOptions,
    run: _Run,
) -> RemeshResult:
    """Remesh a prepared surface with n vertices, given the metric's name or tensors at its points, and tagged edges."""
    with run.stage("prepare"):
        frame = unit_frame(prepared.surface.points)
        given = prepared.surface.with_points(frame.to_unit(prepared.surface.points))
        split = working_surface(given, n)
        check_memory(n, split.surface.n_faces)
        if not isinstance(wanted, str):
            wanted = wanted * frame.scale**2
    with run.stage("metric"):
        estimate = estimated(given, split, wanted, options)
        working = estimate.working
    with run.stage("embed"):
        embedding = embedded(estimate, options.embedding_iterations)
    run.check_time()
    with run.stage("cvt"):
        voronoi = RestrictedVoronoi(embedding.points, working.faces, threads=options.threads)
        ordered = Surface(working.points, voronoi.faces)
        features = _features(voronoi, ordered, n, edges_within(split, given, tagged), options)
        stop = partial(run.clock.over, OPTIMISATION_SHARE)
        optimised = optimise(voronoi, n, ordered, features, embedding.scale, options, run.on_step, stop)
    with run.stage("dual"):
        refined = refine(
            voronoi,
            optimised.sites,
            ordered,
            estimate.plain,
            features,
            embedding.scale,
            n_vertices=n,
            tensors=estimate.tensors,
            stop=run.clock.over,
        )
        surface = Surface(frame.to_model(refined.points), refined.faces)
        validity = check_validity(Surface(refined.points, refined.faces), estimate.plain)
    return RemeshResult(
        surface=surface,
        prepared=prepared.surface,
        prepare_report=prepared.report,
        working=working,
        embedded=estimate.kind,
        noise=estimate.noise,
        frame=frame,
        embedding=embedding,
        diagram=refined.diagram,
        cells=refined.cells,
        vertices_asked=n,
        energy=optimised.energy,
        iterations=optimised.iterations,
        status=optimised.status,
        inserted=refined.inserted,
        removed=refined.removed,
        validity=validity,
        seconds=run.total_seconds(),
        warnings=tuple(_warnings(n, surface, estimate.noise, refined, validity, optimised, options)),
    )


def _features(
    voronoi: RestrictedVoronoi, surface: Surface, n: int, tagged: EdgeMask, options: RemeshOptions
) -> Features:
    """Return boundary and creases; the plain CVT has none of the latter but those that are tagged."""
    angle = options.feature_angle if options.sharpness > 1.0 else 180.0
    return Features(voronoi, surface, n, sharp_edges(surface, angle) | tagged, tagged)


class _Run:
    """Stage times, time limit and progress of one run."""

    def __init__(self, on_step: OnStep, clock: Clock) -> None:
        self.on_step = on_step
        self.clock = clock
        self._seconds = {"load": 0.0}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        self.on_step(StepInfo(stage=name))
        start = time.perf_counter()
        yield
        self._seconds[name] = self._seconds.get(name, 0.0) + time.perf_counter() - start

    def check_time(self) -> None:
        if self.clock.over(OPTIMISATION_SHARE):
            raise TimeLimitError(
                f"the time limit of {self.clock.limit:g} s was as good as over before the optimisation began (after "
                f"{self.clock.seconds:.1f} s); give more time, or ask for fewer vertices"
            )

    def total_seconds(self) -> dict[str, float]:
        return {**self._seconds, "total": self.clock.seconds}


def _with_overrides(options: RemeshOptions, overrides: dict[str, Any]) -> RemeshOptions:
    known = [field.name for field in fields(RemeshOptions)]
    for name in overrides:
        if name not in known:
            raise OptionError(f"remesh has no option {name!r}; expected one of {', '.join(known)}")
    return replace(options, **overrides)


def _check_count(n_vertices: int | None, ratio: float | None, max_error: float | None) -> None:
    if (n_vertices, ratio, max_error).count(None) != 2:
        raise OptionError("give one of n_vertices, ratio and max_error")
    if max_error is not None and not (np.isfinite(max_error) and max_error > 0.0):
        raise OptionError(f"max_error = {max_error}; expected a positive length in model units")
    if n_vertices is not None and (n_vertices != int(n_vertices) or n_vertices < MIN_VERTICES):
        raise OptionError(f"n_vertices = {n_vertices}; expected a whole number of at least {MIN_VERTICES}")
    if ratio is not None and not (np.isfinite(ratio) and ratio > 0.0):
        raise OptionError(f"ratio = {ratio}; expected a positive number, such as 0.2 for a fifth of the vertices")


def _at_prepared(tensors: npt.NDArray[Any], given: Surface, prepared: Prepared) -> npt.NDArray[np.float64]:
    if tensors.shape != (given.n_points, 3, 3):
        raise MetricError(f"metric has shape {tensors.shape}; expected ({given.n_points}, 3, 3), one tensor per point")
    return np.asarray(tensors[prepared.point_source], dtype=np.float64)


def _warnings(
    n: int,
    surface: Surface,
    noise: float,
    refined: Refined,
    validity: Validity,
    optimised: Optimised,
    options: RemeshOptions,
) -> Iterator[str]:
    if noise > 0.0:
        yield f"noise of {noise:.2f} mean edge lengths was taken away first; the result follows the surface beneath it"
    if optimised.status is Status.TIME_LIMIT:
        count = optimised.iterations
        yield f"the time limit of {options.time_limit:g} s ended the optimisation after {count} iterations"
    if refined.from_input:
        yield (
            f"{n:,} vertices are too few for cells that are disks; the input itself was coarsened instead, and its "
            "triangles do not follow the metric: ask for more vertices"
        )
    if abs(surface.n_points - n) > COUNT_TOLERANCE * n:
        why = "fewer would fold the surface or change its topology" if surface.n_points > n else "it has no more"
        yield f"{surface.n_points:,} vertices instead of {n:,}: {why}"
    if validity.euler != validity.euler_input:
        yield f"the Euler characteristic is {validity.euler} instead of {validity.euler_input}; ask for more vertices"
    if validity.flat:
        yield f"{validity.flat:,} triangles have no area"
    if validity.inverted:
        yield f"{validity.inverted:,} triangles are turned against the input surface"
    if validity.new_intersections:
        yield f"{validity.new_intersections:,} pairs of triangles intersect where the input does not"
