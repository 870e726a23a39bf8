"""The metric on the surface that is embedded, and the number of vertices that a length of edges takes in it."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, cast

import numpy as np

from anisomesh._arrays import EdgeMask, Floats, PointMask, real_array
from anisomesh.errors import OptionError
from anisomesh.execution.memory import check_memory, most_vertices
from anisomesh.execution.run import Run
from anisomesh.features.detect import WEAK_ANGLE, apexes, sharp_edges
from anisomesh.features.smooth_lines import with_smooth_lines
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.geometry import Frame, unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.metric.conformity import MetricExtent
from anisomesh.metric.field import MetricField, MetricSource, checked_field
from anisomesh.metric.narrow_patches import limit_to_patches
from anisomesh.metric.sizes import checked_sizes, limited_sizes, metric_of_sizes
from anisomesh.metric.transfer import PlacedMetric, field_near
from anisomesh.options import MIN_VERTICES, RemeshOptions
from anisomesh.resolve import follows_creases, is_designed, metric_source, prescribes_sizes, with_embedding_chosen
from anisomesh.setup.inputs import PreparedInput
from anisomesh.setup.reduction import reduced
from anisomesh.working.surface import WorkingSurface, working_surface

logger = logging.getLogger(__name__)

_FIRST_COUNT = 5_000  # vertices for which the metric is first measured, where their number is not known; heuristic
_MAX_SMALLEST_SIZE = 1e5  # diagonals; above, lengths in the embedding are too small to compute with; heuristic
_COUNT_ROUNDS, _COUNT_TOLERANCE = 4, 0.01  # of the measurement of the metric for the count found, and its change


@dataclass(frozen=True, kw_only=True, eq=False)
class Measured:
    """A prepared surface with its metric.

    Attributes
    ----------
    source
        The prepared input, reduced if it is dense.
    options
        The options, with the embedding chosen.
    frame
        From model units to bounding-box diagonal 1.
    surface
        The surface that the mesh is to approximate, at bounding-box diagonal 1.
    tagged
        Which of its edges (E,) are prescribed, or borders and seams that are followed.
    split, working
        The surface that is embedded: how it comes about, and itself, its noise removed.
    tips
        Which points of the surface are apexes, or fixed.
    field
        The metric on the working surface.
    unlimited
        The same before its stretch is limited on narrow patches, which depends on the number of vertices.
    followed, followed_edges
        What the tagged edges are, in words, and which edges of the prepared surface they are (E',).
    remarks
        What a user should know, one sentence each.
    """

    source: PreparedInput
    options: RemeshOptions
    frame: Frame
    surface: Surface
    tagged: EdgeMask
    split: WorkingSurface
    tips: PointMask
    working: Surface
    field: MetricField
    unlimited: MetricField
    followed: str
    followed_edges: EdgeMask
    remarks: tuple[str, ...]


def count_for_length(source: PreparedInput, options: RemeshOptions, run: Run) -> int:
    """Return the number of vertices that edges of the length in the options take on a prepared surface.

    The metric is measured on a surface that depends on the number, so it is measured again until that hardly changes.
    The outline of the surface has the vertices that it has, and not as many as the length takes.

    Raises
    ------
    OptionError
        If this machine has too little memory for them.
    """
    n, length = _FIRST_COUNT, float(options.absolute_length or 1.0)
    for _ in range(_COUNT_ROUNDS):
        measured = measure(source, n, options, run)
        extent = MetricExtent.of(measured.working, measured.field)
        asked = length / unit_of_lengths(options, measured.frame)
        before, n = n, max(MIN_VERTICES, extent.count(asked) + _more_on_outline(measured, asked))
        if n > most_vertices():
            raise OptionError(
                f"{_wanted(options)} takes about {n:.2g} vertices on this mesh, whose bounding-box diagonal is "
                f"{measured.frame.scale:.4g}; this machine has memory for {most_vertices():.2g}: ask for longer edges"
            )
        if abs(n - before) <= _COUNT_TOLERANCE * n:
            break
    return n


def _wanted(options: RemeshOptions) -> str:
    """Return the option that says how long edges are."""
    if options.edge_length is not None:
        return f"edge_length = {options.edge_length:g}"
    if options.size_field is None:
        return "metric"
    if options.max_size is not None and (callable(options.size_field) or options.max_size < np.min(options.size_field)):
        return f"max_size = {options.max_size:g}"
    smallest = "" if callable(options.size_field) else f", which is {np.min(options.size_field):g} at least,"
    return f"size_field{smallest}"


def _more_on_outline(measured: Measured, length: float) -> int:
    """Return how many vertices more the outline of a surface has than edges of a length in the metric take there."""
    surface = measured.source.prepared.surface
    outline = surface.edges[measured.source.outline]
    if len(outline) == 0:
        return 0
    ends = measured.frame.to_unit(surface.points)[outline]
    roots = PlacedMetric(ClosestPoints(measured.working), measured.field).roots(ends.mean(axis=1))
    lengths = np.linalg.norm(np.einsum("eij,ej->ei", roots, ends[:, 1] - ends[:, 0]), axis=1)
    return len(outline) - round(float(lengths.sum()) / length)


def unit_of_lengths(options: RemeshOptions, frame: Frame) -> float:
    """Return the factor from lengths in the metric field of a run to lengths as the options mean them.

    A metric that is computed is computed at bounding-box diagonal 1; lengths in prescribed tensors and relative to
    prescribed sizes have no unit.
    """
    return 1.0 if options.has_tensors or options.size_field is not None else frame.scale


def measure(source: PreparedInput, n: int, options: RemeshOptions, run: Run, *, nearest: bool = False) -> Measured:
    """Return the surface and the metric for n vertices; ``nearest`` if the distance counts more than the shape."""
    with run.stage("prepare"):
        source = reduced(source, n, options, nearest=nearest)
        prepared = source.prepared
        frame = unit_frame(prepared.surface.points)
        surface = prepared.surface.with_points(frame.to_unit(prepared.surface.points))
        options = with_embedding_chosen(options, surface)
        followed = source.features_at(n, surface)
        surface, tagged = _with_smooth_borders(surface, source, followed.edges, options.feature_angle)
        creases = sharp_edges(surface, min(options.feature_angle, WEAK_ANGLE))
        creases |= source.fixed[surface.edges].any(axis=1)  # so that the points stay
        metric = metric_source(options, surface, _prescribed(source, surface, frame, options), source.rings)
        spacings = partial(_spacings, metric, n) if prescribes_sizes(options) else None
        split = working_surface(surface, n, creases=creases, tagged=tagged, spacings=spacings)
        tips = split.on_coarse(source.fixed)
        if follows_creases(options):
            tips |= apexes(split.coarse, sharp_edges(split.coarse, options.feature_angle))
        check_memory(n, split.surface.n_faces)
        logger.info("working surface: %r; embedding: %s", split.surface, options.embedding)
    with run.stage("metric"):
        field = checked_field(metric(split.surface), split.surface)
        working = split.surface
        if field.points is not None:
            kept = np.flatnonzero(split.on_coarse(source.fixed))
            points = np.array(field.points)
            points[kept] = working.points[kept]
            working = working.with_points(points)
            tagged = split.coarse_tagged
            surface = split.coarse.with_points(points[: split.coarse.n_points])
        limited = limit_to_patches(field, working, n)
    return Measured(
        source=source,
        options=options,
        frame=frame,
        surface=surface,
        tagged=tagged,
        split=split,
        tips=tips,
        working=working,
        field=limited,
        unlimited=field,
        followed=followed.words,
        followed_edges=followed.edges,
        remarks=followed.remarks,
    )


def coarser(measured: Measured, n: int) -> Measured | None:
    """Return a measured surface for a smaller number of vertices; None if other lines are followed with so few.

    The working surface stays: it resolves the sites of fewer vertices all the more.
    """
    surface = measured.source.prepared.surface
    followed = measured.source.features_at(n, surface.with_points(measured.frame.to_unit(surface.points)))
    if not np.array_equal(followed.edges, measured.followed_edges):
        return None
    limited = limit_to_patches(measured.unlimited, measured.working, n)
    return replace(measured, field=limited, remarks=followed.remarks)


def _with_smooth_borders(
    surface: Surface, source: PreparedInput, followed: EdgeMask, crease_angle: float
) -> tuple[Surface, EdgeMask]:
    """Return a surface with smoother borders and seams among the edges (E,) that are followed, and these edges.

    On a scan they go around triangles, which are smaller than the ones of the result; designed surfaces stay.
    """
    lines = followed & ~source.tagged
    if not lines.any() or is_designed(surface):
        return surface, followed
    creases = sharp_edges(surface, crease_angle)
    fixed = surface.on_boundary | source.fixed
    fixed[surface.edges[source.tagged | creases]] = True
    surface, (lines, tagged, _) = with_smooth_lines(surface, lines, (source.tagged, creases), fixed)
    return surface, lines | tagged


def _spacings(metric: MetricSource, n: int, surface: Surface) -> Floats:
    """Return the lengths of the edges (E,) of a surface in a metric over the distance of n vertices in it."""
    field = checked_field(metric(surface), surface)
    along = surface.points[surface.edges[:, 1]] - surface.points[surface.edges[:, 0]]
    squared = np.einsum("ex,ekxy,ey->ek", along, field.tensors[surface.edges], along)
    return np.asarray(np.sqrt(squared.max(axis=1)) / MetricExtent.of(surface, field).length(n))


def _prescribed(source: PreparedInput, surface: Surface, frame: Frame, options: RemeshOptions) -> MetricSource | None:
    """Return the metric that a user prescribes at the points of the input, on surfaces near it; None for others.

    ``surface`` is the prepared surface at bounding-box diagonal 1.
    """
    angle = options.feature_angle
    if source.solution is not None:
        given = cast(Surface, source.solution.surface)
        given = given.with_points(frame.to_unit(given.points))
        field = checked_field(replace(source.solution, surface=None)(given), given)
        return partial(field_near, ClosestPoints(given), field, crease_angle=angle)
    if source.tensors is not None:
        field = MetricField(tensors=source.tensors * frame.scale**2)
        return partial(field_near, ClosestPoints(surface), field, crease_angle=angle)
    if options.size_field is None:
        return None
    nearest = ClosestPoints(surface)

    def sizes_on(working: Surface) -> MetricField:
        if source.sizes is not None:
            faces, weights = nearest.locate(working.points)
            sizes = np.einsum("nc,nc->n", weights, source.sizes[surface.faces[faces]])
        else:
            places, function = frame.to_model(working.points), cast(Callable[..., Any], options.size_field)
            sizes = real_array("size_field", function(places), (len(places),), OptionError)
            sizes = checked_sizes(sizes, places)
        low, high = (None if bound is None else bound / frame.scale for bound in (options.min_size, options.max_size))
        sizes = limited_sizes(working, sizes / frame.scale, low=low, high=high, gradation=options.gradation)
        if sizes.min() > _MAX_SMALLEST_SIZE:
            raised = low is not None and sizes.min() <= low
            told = f"size_field is at least {sizes.min() * frame.scale:g} everywhere"
            raise OptionError(
                f"{f'min_size = {options.min_size:g}' if raised else told}; expected lengths that fit the mesh, whose "
                f"bounding-box diagonal is {frame.scale:.4g}"
            )
        return MetricField(tensors=metric_of_sizes(sizes))

    return sizes_on
