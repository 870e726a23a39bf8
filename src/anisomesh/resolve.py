"""From options, with their short forms, to the objects that the stages take."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from anisomesh.cvt.energy import Energy, NormalMetric
from anisomesh.cvt.schedule import CVTOptions
from anisomesh.denoise.source import Filtered
from anisomesh.embedding.embedder import Direct, Embedder
from anisomesh.features.detect import share_of_flat_edges
from anisomesh.fitting.fit import SAMPLES_PER_VERTEX, FitOptions, FitPlan
from anisomesh.learn.inference.source import Hybrid, Neural
from anisomesh.mesh.surface import Surface
from anisomesh.metric.curvature import DEFAULT_RADIUS
from anisomesh.metric.field import MetricSource
from anisomesh.metric.sources import Approximation, Curvature, Uniform
from anisomesh.options import RemeshOptions

DESIGNED_SHARE = 0.1
"""Share of edges between coplanar faces from which on a surface counts as designed, and no noise is removed from it.

Noise turns all edges, so measured surfaces have next to none; machine parts have many.
"""

_RESAMPLING_FACTOR = 1.5  # sharpness of the energy by which sites are sampled anew, over the sharpness; heuristic
_NEAREST = FitOptions(price=4.0, exchange_price=0.25, rounds=5, share=0.1)  # chosen on training meshes
_NEAREST_DECIMATION = FitOptions(price=10.0, exchange_price=2.0, rounds=3, min_quality=0.8)  # chosen on them too
_ITERATIONS, _ITERATIONS_BEFORE_FIT = 150, 50  # of L-BFGS at most; the second from training meshes
_WARM_LLOYD, _WARM_ITERATIONS = 2, 24  # the same from sites of a finer level of detail; chosen on training meshes
_WARM_SAMPLES = 25  # per vertex in the fit then, on measured surfaces; parts have fillets that fewer miss
_BUILT_IN: dict[str, Callable[[float, int], MetricSource]] = {
    "curvature": lambda crease_angle, radius: Curvature(crease_angle=crease_angle, radius=radius),
    "approximation": lambda crease_angle, radius: Approximation(crease_angle=crease_angle, radius=radius),
    "uniform": lambda crease_angle, radius: Uniform(),
}
_NAMES_OF_SOURCES: dict[type, str] = {
    Hybrid: "hybrid",
    Neural: "neural",
    Filtered: "filtered",
    **dict.fromkeys((Curvature, Approximation, Uniform), "direct"),
}


def embedding_name(options: RemeshOptions) -> str:
    """Return ``"direct"``, ``"filtered"``, ``"neural"`` or ``"hybrid"``, or the name of a metric source of the user.

    ``"auto"`` is what it is for a measured surface.
    """
    metric, embedding = options.metric, options.embedding
    if callable(metric):
        name = str(getattr(metric, "__name__", type(metric).__name__))
        return _NAMES_OF_SOURCES.get(type(metric), name)
    if not isinstance(embedding, str):
        return "direct"
    if embedding != "auto":
        return embedding
    return "hybrid" if isinstance(metric, str) and metric == "curvature" else "direct"


def with_embedding_chosen(options: RemeshOptions, surface: Surface) -> RemeshOptions:
    """Return options with ``"auto"`` replaced by what it stands for, for a prepared input.

    A designed surface has the metric measured: its curvature is exact, and a network does not see how thin its parts
    are.
    """
    if options.embedding != "auto" or callable(options.metric):
        return options
    name = embedding_name(options)
    if name == "hybrid" and options.weights is None and is_designed(surface):
        name = "direct"
    return replace(options, embedding=name)


def is_designed(surface: Surface) -> bool:
    """Return whether a surface is designed, as most machine parts, and not measured."""
    return share_of_flat_edges(surface) >= DESIGNED_SHARE


def metric_source(
    options: RemeshOptions, surface: Surface, prescribed: MetricSource | None, radius: int = DEFAULT_RADIUS
) -> MetricSource:
    """Return the metric source that the options name.

    Parameters
    ----------
    options
        The options.
    surface
        The prepared input: noise is never removed from a designed surface.
    prescribed
        The source of a metric that the options prescribe at the points of the input.
    radius
        Rings of edges over which curvature is fitted.
    """
    if prescribed is not None:
        return prescribed
    metric, name = options.metric, embedding_name(options)
    if not callable(metric):
        if name in ("neural", "hybrid"):
            given = (options.weights, options.device, options.denoise)
            metric = Hybrid(*given, options.feature_angle, radius) if name == "hybrid" else Neural(*given)
        elif name == "filtered":
            metric = Filtered(options.denoise, options.feature_angle)
        else:
            return _BUILT_IN[str(metric)](options.feature_angle, radius)
    if isinstance(metric, Neural | Filtered):
        denoise = metric.denoise and options.denoise and not is_designed(surface)
        return replace(metric, denoise=denoise)
    return metric


def embedder(options: RemeshOptions) -> Embedder:
    """Return the embedder that the options name."""
    if isinstance(options.embedding, str):
        return Direct(iterations=options.embedding_iterations, unfolded=prescribes_sizes(options))
    return options.embedding


def energy(options: RemeshOptions) -> Energy:
    """Return the energy that the options name."""
    return NormalMetric(options.sharpness) if options.energy is None else options.energy


def follows_creases(options: RemeshOptions) -> bool:
    """Return whether detected creases are followed: always, except with the plain CVT."""
    return energy(options) != NormalMetric(1.0)


def prescribes_sizes(options: RemeshOptions) -> bool:
    """Return whether the metric of the user says how large triangles are, which then counts more than the distance.

    So it is with sizes, tensors and metric sources that are not built in, unless an own energy has the last word.
    """
    metric = options.metric
    if isinstance(metric, str | Uniform):
        sized = options.absolute_length is not None and metric in ("uniform", Uniform())
    else:
        sized = type(metric) not in _NAMES_OF_SOURCES
    return sized and isinstance(energy(options), NormalMetric)


def fit_plan(options: RemeshOptions, surface: Surface, *, nearest: bool = False, warm: bool = False) -> FitPlan | None:
    """Return how the mesh is fitted to the prepared input at the end, None if it is not.

    With the metric for the least distance the error counts more than by default, and on a designed surface a decimation
    is fitted; so it is on any surface if a distance is what is asked for (``nearest``). Prescribed sizes and a density
    say where points go, so none are exchanged and nothing is decimated, and an own energy has the last word. From sites
    of a finer level of detail (``warm``) fewer sweeps and samples are enough on a measured surface.
    """
    if not is_fitted(options):
        return None
    named = isinstance(options.metric, str) and options.metric == "approximation"
    least_distance = nearest or named or isinstance(options.metric, Approximation)
    chosen, decimation = _NEAREST if least_distance else FitOptions(), None
    sized = prescribes_sizes(options) and not nearest
    shorter = warm and not is_designed(surface)
    if shorter:
        chosen = replace(chosen, first_sweeps=2, round_sweeps=1)
    if options.density is not None or sized:
        chosen = replace(chosen, rounds=0)
    elif nearest:
        decimation = _NEAREST
    elif least_distance and is_designed(surface):
        decimation = _NEAREST_DECIMATION
    weight = options.shape_weight
    return FitPlan(
        mesh=chosen.weighted(weight),
        decimation=None if decimation is None else decimation.weighted(weight),
        relative=sized,
        samples_per_vertex=_WARM_SAMPLES if shorter else SAMPLES_PER_VERTEX,
        threads=options.threads,
    )


def is_fitted(options: RemeshOptions) -> bool:
    """Return whether the mesh is fitted to the input at the end."""
    return options.fit and isinstance(energy(options), NormalMetric)


def cvt_options(options: RemeshOptions, *, sized: bool = False, warm: bool = False) -> CVTOptions:
    """Return how sites are optimised.

    ``sized`` if their numbers per area are prescribed, so that none are sampled anew; ``warm`` if they begin with sites
    of a finer level of detail, so that fewer steps are enough.
    """
    wanted, final = energy(options), options.final_sharpness
    resampling: Energy | None = wanted
    if isinstance(wanted, NormalMetric):
        resampling = None if sized or wanted.sharpness == 1.0 else NormalMetric(_RESAMPLING_FACTOR * wanted.sharpness)
    return CVTOptions(
        energy=wanted,
        final_energy=None if final is None else NormalMetric(final),
        resampling_energy=resampling,
        relocate=follows_creases(options),
        lloyd_iterations=min(options.lloyd_iterations, _WARM_LLOYD) if warm else options.lloyd_iterations,
        max_iterations=min(_max_iterations(options), _WARM_ITERATIONS) if warm else _max_iterations(options),
        seed=options.seed,
    )


def _max_iterations(options: RemeshOptions) -> int:
    """Return the bound on iterations of L-BFGS."""
    if options.max_iterations is not None:
        return options.max_iterations
    return _ITERATIONS_BEFORE_FIT if is_fitted(options) else _ITERATIONS
