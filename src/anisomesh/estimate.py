"""What is embedded: a surface and its metric, measured on it or as a trained network sees them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EmbeddedPoints, PointTensors
from anisomesh.embedding.base import Embedding
from anisomesh.embedding.direct import embed
from anisomesh.embedding.precomputed import precomputed_embedding
from anisomesh.features.detect import share_of_flat_edges
from anisomesh.learn import require_torch, torch_is_there
from anisomesh.mesh.subdivision import Subdivision
from anisomesh.mesh.surface import Surface
from anisomesh.metric.curvature import principal_curvatures
from anisomesh.metric.line_field import line_field_components, principal_stretch, tensors_of_line_field
from anisomesh.metric.names import MetricName
from anisomesh.metric.tangent import tangent_frames, unit_normals
from anisomesh.metric.tensors import compute_metric, curvature_metric
from anisomesh.options import RemeshOptions

MEASURED_SHARE = 0.7
"""Of the measured curvature in the hybrid metric. On validation families 0.3 is worse, and 0.85 as good."""

DESIGNED = 0.1
"""Share of the edges between faces in one plane from which on a surface was designed, and has no noise to take away.

Noise turns all edges, so measured surfaces have next to none; machine parts have many.
"""


@dataclass(frozen=True, kw_only=True, eq=False)
class Estimate:
    """A surface and its metric.

    Attributes
    ----------
    plain, working
        The surface, and with long edges split, whose first points are those of ``plain``; without noise where a network
        has found some.
    tensors
        The metric at the points of ``working`` (V, 3, 3).
    kind
        ``"direct"``, ``"neural"`` or ``"hybrid"``.
    noise
        What a network has taken away: root mean square height over the surface, in mean edge lengths.
    extra
        Extra coordinates of the embedding (V, 5), if a network has found these too.
    """

    plain: Surface
    working: Surface
    tensors: PointTensors
    kind: str
    noise: float = 0.0
    extra: EmbeddedPoints | None = None


def chosen_embedding(options: RemeshOptions) -> str:
    """Return how to embed, ``"direct"``, ``"neural"`` or ``"hybrid"``, for options that may leave it open."""
    if options.embedding != "auto":
        return options.embedding
    asked = options.weights is not None or torch_is_there()
    return "hybrid" if asked and isinstance(options.metric, str) and options.metric == "curvature" else "direct"


def estimated(
    plain: Surface, split: Subdivision, wanted: MetricName | npt.NDArray[Any], options: RemeshOptions
) -> Estimate:
    """Return the surface and metric to be embedded.

    Parameters
    ----------
    plain, split
        The surface at bounding-box diagonal 1, and with long edges split.
    wanted
        Name of the metric, or tensors at the points of ``plain`` (V, 3, 3).
    options
        Say whether a network is asked.

    Raises
    ------
    MetricError
        If the tensors are not symmetric positive definite.
    WeightsError, LearningError
        If the network cannot be loaded, or torch is not installed.
    OptionError
        If there are no such weights, or the device cannot be used.
    """
    working = split.surface
    if not isinstance(wanted, str):
        wanted = split.interpolate(wanted)
    kind = chosen_embedding(options)
    if kind == "direct":
        return Estimate(plain=plain, working=working, tensors=compute_metric(working, wanted), kind=kind)
    require_torch()
    from anisomesh.learn.inference.predict import predict

    denoise = options.denoise and share_of_flat_edges(plain) < DESIGNED
    found = predict(working, options.weights, device=options.device, denoise=denoise)
    if found.noise > 0.0:
        plain, working = plain.with_points(found.points[: plain.n_points]), working.with_points(found.points)
    tensors, extra = found.tensors, found.extra
    if kind == "hybrid":
        tensors, extra = _blended(working, tensors), None
    return Estimate(plain=plain, working=working, tensors=tensors, kind=kind, noise=found.noise, extra=extra)


def embedded(estimate: Estimate, max_iterations: int) -> Embedding:
    """Return the embedding of an estimate: the one that a network has found, or by at most so many direct steps."""
    if estimate.extra is not None:
        return precomputed_embedding(estimate.working, estimate.extra, estimate.tensors)
    return embed(estimate.working, estimate.tensors, max_iterations=max_iterations)


def _blended(surface: Surface, predicted: PointTensors) -> PointTensors:
    """Return a mean of a predicted metric (V, 3, 3) and the measured one; the former where curvature is not known well.

    The weighted mean of the lines: the logarithm of the squared stretch, at twice the angle of its direction.
    """
    curvature = principal_curvatures(surface)
    measured = curvature_metric(surface, curvature)
    frames = tangent_frames(unit_normals(surface))
    lines, other = (line_field_components(*principal_stretch(tensors), frames) for tensors in (predicted, measured))
    share = np.where(curvature.trusted, MEASURED_SHARE, 0.0)[:, None]
    return tensors_of_line_field((1.0 - share) * lines + share * other, frames)
