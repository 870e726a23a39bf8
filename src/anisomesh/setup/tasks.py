"""From a prepared input to the tasks of the later stages: metric, embedding, features, what is fitted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from anisomesh._arrays import CornerTensors, EdgeMask, PointMask, PointScalars, PointTensors, Sites
from anisomesh.cvt.coarsening import spread_subset
from anisomesh.cvt.lbfgs import Optimised
from anisomesh.delaunay.meshing import MeshingTask
from anisomesh.delaunay.search_trees import SearchTrees
from anisomesh.embedding.base import Embedding
from anisomesh.embedding.density import area_factors, density_of_sizes
from anisomesh.embedding.embedder import checked_embedding
from anisomesh.execution.run import Run
from anisomesh.features.detect import sharp_edges
from anisomesh.features.network import FeatureNetwork, trace_features
from anisomesh.fitting.target import FitTarget
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.mesh.surface import Surface
from anisomesh.metric.field import MetricField
from anisomesh.metric.thin_walls import separate_thin_walls
from anisomesh.metric.transfer import PlacedMetric
from anisomesh.options import RemeshOptions
from anisomesh.resolve import cvt_options, embedder, fit_plan, follows_creases, is_designed, prescribes_sizes
from anisomesh.setup.inputs import PreparedInput
from anisomesh.setup.measured import Measured, coarser, measure
from anisomesh.voronoi.restricted import RestrictedVoronoi


@dataclass(frozen=True, kw_only=True, eq=False)
class Tasks:
    """The tasks of the stages that follow the embedding, and all that is known before.

    Attributes
    ----------
    measured
        The surface with its metric, and the options with the embedding chosen.
    metric
        The metric on the embedded surface, with what a density adds if sizes are prescribed.
    sizing
        The same with what a density adds in any case.
    apart
        The metric that is embedded, in which the faces of thin walls are apart.
    embedding
        The embedding of that surface.
    dual
        The task to make a mesh from sites.
    fit
        What that mesh is fitted to, None if it is not.
    start
        Positions (S, d) with which the optimisation of the sites begins, None for random ones.
    """

    measured: Measured
    metric: PlacedMetric
    sizing: PlacedMetric
    apart: MetricField
    embedding: Embedding
    dual: MeshingTask
    fit: FitTarget | None
    start: Sites | None = None


@dataclass(frozen=True, eq=False)
class Finer:
    """What a level of detail takes over from a finer one: what is known of the surface, and its optimised sites."""

    tasks: Tasks
    optimised: Optimised


def set_up(
    source: PreparedInput,
    n: int,
    options: RemeshOptions,
    run: Run,
    *,
    nearest: bool = False,
    finer: Finer | None = None,
) -> Tasks:
    """Return the tasks to remesh a prepared surface with n vertices.

    Parameters
    ----------
    source, n, options, run
        The surface, how many vertices, and how.
    nearest
        Whether the distance counts more than the shape.
    finer
        A mesh of the same surface with more vertices, whose working surface and metric are taken, and its embedding
        where it does not depend on the number of vertices. None to compute all.
    """
    measured = None if finer is None else coarser(finer.tasks.measured, n)
    finer = None if measured is None else finer
    measured = measure(source, n, options, run, nearest=nearest) if measured is None else measured
    source, options, surface, split = measured.source, measured.options, measured.surface, measured.split
    working, field = measured.working, measured.field
    with run.stage("embed"):
        apart = separate_thin_walls(field, working, n, options.feature_angle) if follows_creases(options) else field
        if finer is not None and apart is finer.tasks.apart:
            embedding = finer.tasks.embedding
        else:
            embedding = checked_embedding(embedder(options)(working, apart), working)
        trees = SearchTrees() if finer is None else finer.tasks.dual.trees
        density = None if source.density is None else split.interpolate(source.density)
        asked, weights = _with_density(field, density, working), None
        if prescribes_sizes(options) and not nearest:
            density = density_of_sizes(working, _given(_with_density(apart, density, working)), embedding.points)
            weights = area_factors(working, _given(asked)) ** 2
        if finer is not None and embedding is finer.tasks.embedding:
            embedded = finer.tasks.dual.voronoi.embedded
        else:
            embedded = EmbeddedSurface(working, embedding.points, embedding.scale, density)
        task = MeshingTask(
            voronoi=RestrictedVoronoi(embedded, threads=options.threads),
            features=_features(embedded, n, split.tagged, measured.tips, options),
            surface=surface,
            tensors=field.tensors,
            n_vertices=n,
            deadline=run.deadline,
            error_weights=weights,
            anchors=source.anchors(n, measured.frame),
            trees=trees,
        )
        start = None if finer is None else _start(finer, task, options)
        sizing = PlacedMetric(trees.of(working), asked)
        metric = replace(sizing, field=field) if weights is None else sizing
        target = _fit_target(task, measured, metric, nearest=nearest, warm=start is not None)
    return Tasks(
        measured=measured,
        metric=metric,
        sizing=sizing,
        apart=apart,
        embedding=embedding,
        dual=task,
        fit=target,
        start=start,
    )


def _start(finer: Finer, task: MeshingTask, options: RemeshOptions) -> Sites | None:
    """Return as many sites (n, d) of a finer mesh as a task takes, in its embedding; None if there are too few.

    On measured surfaces they are denser where that many sites have more energy. On designed ones that says too little:
    cells across a crease have nearly all of the energy until their sites are on it.
    """
    sites, own, embedded = finer.optimised.sites, finer.tasks.dual.voronoi.embedded, task.voronoi.embedded
    mass = finer.optimised.mass if options.energy is None else None  # about the same in another embedding
    if len(sites) <= task.n_vertices:
        return None
    if embedded is not own:
        sites = embedded.points[cKDTree(own.points).query(sites)[1]]
    energy = cvt_options(options, sized=prescribes_sizes(options)).resampling_energy
    energy = None if is_designed(task.surface) else energy
    return spread_subset(task.voronoi, sites, task.n_vertices, energy, mass)


def _with_density(field: MetricField, density: PointScalars | None, surface: Surface) -> MetricField:
    """Return a metric field times the root of a density (V,), as the area of triangles is to be divided by it."""
    if density is None:
        return field
    root, corners = np.sqrt(density), field.corner_tensors
    if corners is not None:
        corners = root[surface.faces][:, :, None, None] * corners
    return replace(field, tensors=root[:, None, None] * field.tensors, corner_tensors=corners)


def _given(field: MetricField) -> PointTensors | CornerTensors:
    """Return the tensors of a field at corners, if it has these, or else at points."""
    return field.tensors if field.corner_tensors is None else field.corner_tensors


def _fit_target(
    task: MeshingTask, measured: Measured, metric: PlacedMetric, *, nearest: bool, warm: bool
) -> FitTarget | None:
    """Return what meshes are fitted to, None if they are not.

    If edges are prescribed by a user all creases are held, else only borders and seams.
    """
    source, options = measured.source, measured.options
    plan = fit_plan(options, measured.surface, nearest=nearest, warm=warm)
    if plan is None:
        return None
    if source.junctions is not None:  # a decimation of sheets would not fit together
        plan = replace(plan, decimation=None)
    target = FitTarget.of(
        task.reference,
        metric,
        task.n_vertices,
        corners=task.corner_places,
        holds_creases=bool(source.tagged.any() and task.features.required.any()),
        crease_angle=options.feature_angle,
        plan=plan,
    )
    return replace(target, lines=task.surface.edges[measured.tagged].astype(np.int64), anchors=task.anchors)


def _features(
    embedded: EmbeddedSurface, n: int, tagged: EdgeMask, tips: PointMask, options: RemeshOptions
) -> FeatureNetwork:
    """Return boundary, creases and apexes; with the plain CVT only the tagged edges and the tips.

    ``tagged`` are edges (E,) of the embedded surface, and ``tips`` apexes and fixed points among its first points.
    """
    angle = options.feature_angle if follows_creases(options) else 180.0
    sharp = sharp_edges(embedded.surface, angle) | tagged
    return trace_features(embedded, n, sharp=sharp, required=tagged, apexes=np.flatnonzero(tips))
