"""The protocol of embedders, and the direct embedding as one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from anisomesh._arrays import real_array
from anisomesh._values import real_number, whole_number
from anisomesh.embedding.base import Embedding, EmbeddingStatus, StretchStatistics
from anisomesh.embedding.direct import Start, embed
from anisomesh.embedding.precomputed import precomputed_embedding
from anisomesh.errors import OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.metric.field import MAX_COORDINATE, MetricField


class Embedder(Protocol):
    """Anything that embeds a surface so that straight lengths in R^d are lengths in a metric."""

    def __call__(self, surface: Surface, field: MetricField, /) -> Embedding:
        """Return the embedding of a surface at bounding-box diagonal 1 with a metric at its points."""
        ...


@dataclass(frozen=True, kw_only=True)
class Direct:
    """The direct embedding by local and global steps; extra coordinates of the field are used as they are.

    Parameters
    ----------
    iterations
        Largest number of steps, at least 1.
    extra_dimensions
        Number of coordinates besides the first three, at least 3.
    tolerance
        Stop when a step lowers the residual by less than this part of it.
    unfolded
        Whether the surface stays unfolded, for metrics whose sizes vary a lot; see
        :class:`~anisomesh.embedding.direct.Start`.

    Raises
    ------
    OptionError
        If a parameter is out of range.

    References
    ----------
    NASM, supplement A; see :func:`~anisomesh.embedding.direct.embed`.
    """

    iterations: int = 10
    extra_dimensions: int = 5
    tolerance: float = 1e-3
    unfolded: bool = False

    def __post_init__(self) -> None:
        whole_number("iterations", self.iterations, 1)
        whole_number("extra_dimensions", self.extra_dimensions, 3)
        if not real_number("tolerance", self.tolerance) >= 0.0:
            raise OptionError(f"tolerance = {self.tolerance}; expected at least 0")

    def __call__(self, surface: Surface, field: MetricField) -> Embedding:
        """Return the embedding of a surface with a metric at its points."""
        if field.extra is not None:
            return precomputed_embedding(surface, field.extra, field.tensors)
        return embed(
            surface,
            field.tensors,
            corner_tensors=field.corner_tensors,
            start=Start(self.extra_dimensions, self.unfolded),
            max_iterations=self.iterations,
            tolerance=self.tolerance,
        )


def checked_embedding(embedding: Any, surface: Surface) -> Embedding:
    """Return the result of an embedder for a surface after validation, its points in float64.

    Raises
    ------
    OptionError
        If it is not an :class:`~anisomesh.embedding.base.Embedding`, its points are not real, finite and (V, d) with
        d >= 3, the first three columns are not ``scale`` > 0 times the points of the surface, or a field is missing.
    """
    if not isinstance(embedding, Embedding):
        raise OptionError(f"the embedder returned {type(embedding).__name__}; expected an Embedding")
    for name, kind in (("status", EmbeddingStatus), ("stretch", StretchStatistics)):
        if not isinstance(value := getattr(embedding, name), kind):
            raise OptionError(f"the embedding has {name} = {value!r}; expected {kind.__name__}")
    whole_number("iterations of the embedding", embedding.iterations, 0)
    figures = {"scale": embedding.scale, "residual": embedding.residual, **vars(embedding.stretch)}
    for name, value in figures.items():
        if not np.isfinite(real_number(f"{name} of the embedding", value)):
            raise OptionError(f"the embedding has {name} = {value}; expected a finite number")
    points = real_array("points of the embedding", embedding.points, (surface.n_points, None), OptionError)
    if points.shape[1] < 3:
        raise OptionError(f"points of the embedding has shape {points.shape}; expected at least 3 coordinates")
    if not 1.0 / MAX_COORDINATE < embedding.scale < MAX_COORDINATE:
        low, high = 1.0 / MAX_COORDINATE, MAX_COORDINATE
        raise OptionError(f"the embedding has scale = {embedding.scale}; expected {low:g} to {high:g}")
    if not (np.abs(points) <= MAX_COORDINATE * embedding.scale).all():
        raise OptionError(f"points of the embedding has a number not finite or above {MAX_COORDINATE:g} times scale")
    off = np.abs(points[:, :3] - embedding.scale * surface.points).max()
    if off > 1e-9 * embedding.scale * max(surface.diagonal, 1.0):
        raise OptionError(f"the first three coordinates of the embedding are off scale times the surface by {off:.3g}")
    return replace(embedding, points=points)
