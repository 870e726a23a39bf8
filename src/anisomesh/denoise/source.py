"""A metric source that removes noise by filters."""

from __future__ import annotations

from dataclasses import dataclass, replace

from anisomesh.denoise.classical import classically_denoised
from anisomesh.denoise.noise import noise_height
from anisomesh.errors import OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.metric.field import MetricField
from anisomesh.metric.sources import Curvature


@dataclass(frozen=True)
class Filtered:
    """The measured curvature metric, on the surface without the noise that filters find.

    Parameters
    ----------
    denoise
        Whether noise is removed; without it this is :class:`~anisomesh.metric.sources.Curvature`.
    crease_angle
        As for :class:`~anisomesh.metric.sources.Curvature`.

    References
    ----------
    See :func:`~anisomesh.denoise.classical.classically_denoised`.
    """

    denoise: bool = True
    crease_angle: float = 40.0

    def __post_init__(self) -> None:
        if not isinstance(self.denoise, bool):
            raise OptionError(f"denoise = {self.denoise!r}; expected True or False")

    def __call__(self, surface: Surface) -> MetricField:
        """Return the metric at the points of a surface."""
        denoised = classically_denoised(surface) if self.denoise else surface
        field = Curvature(crease_angle=self.crease_angle)(denoised)
        if denoised is surface:
            return field
        return replace(field, points=denoised.points, noise=noise_height(surface, denoised.points - surface.points))
