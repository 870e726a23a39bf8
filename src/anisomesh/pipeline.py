"""From a mesh to an anisotropic mesh: prepare, metric, embedding, CVT, dual."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.cvt.arcs import Boundary
from anisomesh.cvt.optimise import Optimised, lloyd, minimise
from anisomesh.cvt.sampling import resample_by_energy, sample_surface
from anisomesh.cvt.voronoi import RestrictedVoronoi
from anisomesh.dual.exchange import exchange_sites
from anisomesh.dual.refine import Refined, refine
from anisomesh.embedding.direct import embed
from anisomesh.errors import MetricError, OptionError
from anisomesh.evaluation.validity import Validity, check_validity
from anisomesh.metric.tensor import compute_metric
from anisomesh.options import OnStep, RemeshOptions, StepInfo
from anisomesh.result import RemeshResult
from anisomesh.surface.convert import as_surface
from anisomesh.surface.geometry import unit_frame
from anisomesh.surface.mesh import Surface
from anisomesh.surface.prepare import Prepared, prepare
from anisomesh.surface.subdivide import split_long_edges

MIN_VERTICES = 4
COUNT_TOLERANCE = 0.02  # share of the asked vertices by which the result may differ without a warning
FINE_POINTS = 5_000  # the working surface has edges no longer than an even mesh of so many points
EDGE_FACTOR = 1.6  # and no longer than this many distances between sites
EXCHANGE_AT = 0.6  # share of the iterations after which sites are exchanged
DENSITY_SHARPNESS = 1.5  # sharpness of the energy that sites are distributed by, over that of the optimisation
MAX_GROWTH = 8  # splitting makes at most so many times the faces, or MAX_SPLIT_FACES
MAX_SPLIT_FACES = 60_000
BYTES_PER_VERTEX, BYTES_PER_FACE = 6_000, 1_500  # of memory; measured with benchmarks/speed.py


def remesh(
    mesh: Any,
    faces: npt.NDArray[Any] | None = None,
    *,
    n_vertices: int | None = None,
    ratio: float | None = None,
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
        If an option is out of range.

    References
    ----------
    "NASM: Neural Anisotropic Surface Meshing", SIGGRAPH Asia 2024.
    """
    options = _with_overrides(options or RemeshOptions(), overrides)
    run = _Run(on_step or (lambda step: None))
    given = as_surface(mesh, faces)
    _check_count(n_vertices, ratio)
    with run.stage("prepare"):
        prepared = prepare(given, weld_tolerance=options.weld_tolerance)
        n = n_vertices or max(MIN_VERTICES, round((ratio or 0.0) * prepared.surface.n_points))
        frame = unit_frame(prepared.surface.points)
        unit = prepared.surface.with_points(frame.to_unit(prepared.surface.points))
        split = split_long_edges(unit, max_edge(unit, n), max_faces=max(MAX_GROWTH * unit.n_faces, MAX_SPLIT_FACES))
        working = split.surface
        _check_memory(n, working.n_faces)
    with run.stage("metric"):
        wanted = options.metric
        if not isinstance(wanted, str):
            wanted = split.interpolate(_at_prepared(np.asarray(wanted), given, prepared)) * frame.scale**2
        metric = compute_metric(working, wanted)
    with run.stage("embed"):
        embedding = embed(working, metric.tensors, max_iterations=options.embedding_iterations)
    with run.stage("cvt"):
        voronoi = RestrictedVoronoi(embedding.points, working.faces, threads=options.threads)
        ordered = Surface(working.points, voronoi.faces)
        boundary = Boundary(voronoi, ordered, n, options.crease_angle)
        optimised = optimise(voronoi, n, ordered, boundary, embedding.scale, options, run.on_step)
    with run.stage("dual"):
        angle = options.crease_angle if options.sharpness > 1.0 else 180.0
        refined = refine(
            voronoi,
            optimised.sites,
            ordered,
            unit,
            boundary,
            embedding.scale,
            n_vertices=n,
            crease_angle=angle,
            tensors=metric.tensors,
        )
        surface = Surface(frame.to_model(refined.points), refined.faces)
        validity = check_validity(Surface(refined.points, refined.faces), unit)
    return RemeshResult(
        surface=surface,
        prepared=prepared.surface,
        prepare_report=prepared.report,
        working=working,
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
        warnings=tuple(_warnings(n, surface, refined, validity)),
    )


def max_edge(surface: Surface, n_vertices: int) -> float:
    """Return the edge length that the working surface may have, for this number of sites.

    The embedding is linear on every facet, so facets must resolve both the distance between sites and, on
    sparse input such as CAD, the change of the metric next to a crease.
    """
    return min(EDGE_FACTOR * _even_edge(surface.area, n_vertices), 2.0 * _even_edge(surface.area, FINE_POINTS))


def optimise(
    voronoi: RestrictedVoronoi,
    n: int,
    surface: Surface,
    boundary: Boundary,
    scale: float,
    options: RemeshOptions,
    on_step: OnStep,
) -> Optimised:
    """Return n optimised sites: a random start, Lloyd's algorithm, then L-BFGS on the normal-metric energy.

    With a normal metric the sites are drawn anew within Lloyd's algorithm, denser where the surface bends within a
    cell, and a few of them are exchanged within L-BFGS, for points that the dual would miss. Sites of cells at the
    boundary go onto it before L-BFGS and stay there.
    """
    late = options.max_iterations // 2 if options.final_sharpness is not None else 0
    total = options.lloyd_iterations + options.max_iterations + late
    done = 0

    def report(iteration: int, energy: float) -> None:
        on_step(StepInfo(stage="cvt", iteration=done + iteration, total=total, energy=energy))

    rng = np.random.default_rng(options.seed)
    sites = sample_surface(voronoi.points, voronoi.faces, voronoi.facets.area, n, rng)
    first = options.lloyd_iterations - options.lloyd_iterations // 3
    sites = lloyd(voronoi, sites, first, report)
    done += first
    if options.sharpness > 1.0:
        sites = resample_by_energy(voronoi, sites, DENSITY_SHARPNESS * options.sharpness, rng)
    sites = lloyd(voronoi, sites, options.lloyd_iterations - first, report)
    done += options.lloyd_iterations - first
    schedule = [(options.sharpness, options.max_iterations)]
    if options.sharpness > 1.0:
        before = round(EXCHANGE_AT * options.max_iterations)
        schedule = [(options.sharpness, before), (options.sharpness, options.max_iterations - before)]
    if options.final_sharpness is not None:
        schedule.append((options.final_sharpness, late))
    iterations = evaluations = 0
    fixed = np.zeros(n, dtype=bool)
    for stage, (sharpness, limit) in enumerate(schedule):
        if stage > 0 and options.sharpness > 1.0:
            sites = exchange_sites(voronoi, sites, surface, scale, sharpness, kept=fixed)
        if boundary.curves.n_curves:
            sites, fixed = boundary.spread(voronoi, sites, fixed)
        result = minimise(voronoi, sites, sharpness=sharpness, max_iterations=limit, on_step=report, fixed=fixed)
        sites = result.sites
        done += limit
        iterations += result.iterations
        evaluations += result.evaluations
    return replace(result, iterations=iterations, evaluations=evaluations)


class _Run:
    """Stage times and progress of one run."""

    def __init__(self, on_step: OnStep) -> None:
        self.on_step = on_step
        self._seconds = {"load": 0.0}
        self._start = time.perf_counter()

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        self.on_step(StepInfo(stage=name))
        start = time.perf_counter()
        yield
        self._seconds[name] = time.perf_counter() - start

    def total_seconds(self) -> dict[str, float]:
        return {**self._seconds, "total": time.perf_counter() - self._start}


def _with_overrides(options: RemeshOptions, overrides: dict[str, Any]) -> RemeshOptions:
    known = [field.name for field in fields(RemeshOptions)]
    for name in overrides:
        if name not in known:
            raise OptionError(f"remesh has no option {name!r}; expected one of {', '.join(known)}")
    return replace(options, **overrides)


def _check_count(n_vertices: int | None, ratio: float | None) -> None:
    if (n_vertices is None) == (ratio is None):
        raise OptionError("give either n_vertices or ratio")
    if n_vertices is not None and (n_vertices != int(n_vertices) or n_vertices < MIN_VERTICES):
        raise OptionError(f"n_vertices = {n_vertices}; expected a whole number of at least {MIN_VERTICES}")
    if ratio is not None and not (np.isfinite(ratio) and ratio > 0.0):
        raise OptionError(f"ratio = {ratio}; expected a positive number, such as 0.2 for a fifth of the vertices")


def _check_memory(n: int, n_faces: int) -> None:
    """Refuse what cannot fit into the memory of this machine, before hours are spent on it."""
    try:
        there = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # not a system that tells
        return
    needed = BYTES_PER_VERTEX * n + BYTES_PER_FACE * n_faces
    if needed > there:
        sizes = f"about {needed / 2**30:,.0f} GiB of memory, and this machine has {there / 2**30:,.0f}"
        raise OptionError(f"{n:,} vertices need {sizes}; ask for fewer")


def _even_edge(area: float, n: int) -> float:
    """Return the edge length of n vertices spread evenly in equilateral triangles over an area."""
    return float(np.sqrt(2.0 * area / (np.sqrt(3.0) * n)))


def _at_prepared(tensors: npt.NDArray[Any], given: Surface, prepared: Prepared) -> npt.NDArray[np.float64]:
    if tensors.shape != (given.n_points, 3, 3):
        raise MetricError(f"metric has shape {tensors.shape}; expected ({given.n_points}, 3, 3), one tensor per point")
    return np.asarray(tensors[prepared.point_source], dtype=np.float64)


def _warnings(n: int, surface: Surface, refined: Refined, validity: Validity) -> Iterator[str]:
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
    if validity.flipped:
        yield f"{validity.flipped:,} triangles are turned against the input surface"
    if validity.new_intersections:
        yield f"{validity.new_intersections:,} pairs of triangles intersect where the input does not"
