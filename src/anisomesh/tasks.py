"""From a prepared input to the tasks of the later stages: metric, embedding, features, what is fitted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from anisomesh._arrays import EdgeMask, PointMask
from anisomesh.delaunay.meshing import MeshingTask
from anisomesh.embedding.base import Embedding
from anisomesh.embedding.embedder import checked_embedding
from anisomesh.execution.memory import check_memory
from anisomesh.execution.run import Run
from anisomesh.features.detect import WEAK_ANGLE, apexes, sharp_edges
from anisomesh.features.network import FeatureNetwork, trace_features
from anisomesh.features.smooth_lines import with_smooth_lines
from anisomesh.fitting.fit import FitPlan
from anisomesh.fitting.target import FitTarget
from anisomesh.inputs import PreparedInput
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.mesh.geometry import Frame, unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.working_surface import working_surface
from anisomesh.metric.field import MetricField, checked_field
from anisomesh.metric.narrow_patches import limit_to_patches
from anisomesh.metric.thin_walls import separate_thin_walls
from anisomesh.metric.transfer import PlacedMetric
from anisomesh.options import RemeshOptions
from anisomesh.resolve import embedder, fit_plan, follows_creases, is_designed, metric_source, with_embedding_chosen
from anisomesh.voronoi.restricted import RestrictedVoronoi


@dataclass(frozen=True, kw_only=True, eq=False)
class Tasks:
    """The tasks of the stages that follow the embedding, and all that is known before.

    Attributes
    ----------
    options
        The options, with the embedding chosen.
    frame
        From model units to bounding-box diagonal 1.
    surface
        The surface that the mesh is to approximate, at bounding-box diagonal 1.
    field
        The metric on the embedded surface.
    embedding
        The embedding of that.
    dual
        The task to make a mesh from sites.
    fit
        What that mesh is fitted to, None if it is not.
    remarks
        What a user should know, one sentence each.
    """

    options: RemeshOptions
    frame: Frame
    surface: Surface
    field: MetricField
    embedding: Embedding
    dual: MeshingTask
    fit: FitTarget | None
    remarks: tuple[str, ...]


def set_up(source: PreparedInput, n: int, options: RemeshOptions, run: Run, *, nearest: bool) -> Tasks:
    """Return the tasks to remesh a prepared surface with n vertices.

    ``nearest`` if the distance counts more than the shape.
    """
    prepared = source.prepared
    with run.stage("prepare"):
        frame = unit_frame(prepared.surface.points)
        surface = prepared.surface.with_points(frame.to_unit(prepared.surface.points))
        options = with_embedding_chosen(options, surface)
        tagged, remarks = source.features_at(n)
        surface, tagged = _with_smooth_borders(surface, source, tagged, options.feature_angle)
        creases = sharp_edges(surface, min(options.feature_angle, WEAK_ANGLE))
        creases |= source.fixed[surface.edges].any(axis=1)  # so that the points stay
        split = working_surface(surface, n, creases=creases, tagged=tagged)
        tips = split.on_coarse(source.fixed)
        if follows_creases(options):
            tips |= apexes(split.coarse, sharp_edges(split.coarse, options.feature_angle))
        check_memory(n, split.surface.n_faces)
    with run.stage("metric"):
        tensors = None if source.tensors is None else split.interpolate(source.tensors * frame.scale**2)
        field = checked_field(metric_source(options, surface, tensors)(split.surface), split.surface)
        working = split.surface
        if field.points is not None:
            working = working.with_points(field.points)
            tagged = split.coarse_tagged
            surface = split.coarse.with_points(field.points[: split.coarse.n_points])
        field = limit_to_patches(field, working, n)
    with run.stage("embed"):
        apart = separate_thin_walls(field, working, n, options.feature_angle) if follows_creases(options) else field
        embedding = checked_embedding(embedder(options)(working, apart), working)
        density = None if source.density is None else split.interpolate(source.density)
        embedded = EmbeddedSurface(working, embedding.points, embedding.scale, density)
        task = MeshingTask(
            voronoi=RestrictedVoronoi(embedded, threads=options.threads),
            features=_features(embedded, n, split.tagged, tips, options),
            surface=surface,
            tensors=field.tensors,
            n_vertices=n,
            deadline=run.deadline,
        )
        plan = fit_plan(options, surface, nearest=nearest)
        metric, prescribed = PlacedMetric(ClosestPoints(working), field), bool(source.tagged.any())
        target = None if plan is None else _fit_target(task, tagged, metric, plan, options, prescribed=prescribed)
    return Tasks(
        options=options,
        frame=frame,
        surface=surface,
        field=field,
        embedding=embedding,
        dual=task,
        fit=target,
        remarks=remarks,
    )


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


def _fit_target(
    task: MeshingTask,
    tagged: EdgeMask,
    metric: PlacedMetric,
    plan: FitPlan,
    options: RemeshOptions,
    *,
    prescribed: bool,
) -> FitTarget:
    """Return what meshes are fitted to, with ``tagged`` edges (E,) of the surface to mesh.

    If edges are ``prescribed`` by a user all creases are held, else only borders and seams.
    """
    target = FitTarget.of(
        task.reference,
        metric,
        task.n_vertices,
        corners=task.corner_places,
        holds_creases=prescribed and bool(task.features.required.any()),
        crease_angle=options.feature_angle,
        plan=plan,
    )
    return replace(target, lines=task.surface.edges[tagged].astype(np.int64))


def _features(
    embedded: EmbeddedSurface, n: int, tagged: EdgeMask, tips: PointMask, options: RemeshOptions
) -> FeatureNetwork:
    """Return boundary, creases and apexes; with the plain CVT only the tagged edges and the tips.

    ``tagged`` are edges (E,) of the embedded surface, and ``tips`` apexes and fixed points among its first points.
    """
    angle = options.feature_angle if follows_creases(options) else 180.0
    sharp = sharp_edges(embedded.surface, angle) | tagged
    return trace_features(embedded, n, sharp=sharp, required=tagged, apexes=np.flatnonzero(tips))
