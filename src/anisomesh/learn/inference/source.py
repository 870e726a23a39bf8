"""Metric sources that ask a trained network."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace

import numpy as np

from anisomesh._arrays import PointTensors
from anisomesh.errors import OptionError
from anisomesh.learn.inference.predict import predict
from anisomesh.mesh.surface import Surface
from anisomesh.metric.curvature import DEFAULT_RADIUS, MAX_FLAT_CURVATURE, principal_curvatures
from anisomesh.metric.field import MetricField
from anisomesh.metric.line_field import line_field_components, principal_stretch, tensors_of_line_field
from anisomesh.metric.patches import smooth_patches
from anisomesh.metric.tangent import tangent_frames, unit_normals
from anisomesh.metric.tensors import curvature_metric

MEASURED_SHARE = 0.7  # of the measured curvature in the hybrid metric; on validation meshes .3 is worse, .85 as good


@dataclass(frozen=True)
class Neural:
    """The curvature metric, and the surface beneath noise, as a trained network predicts them.

    Parameters
    ----------
    weights
        A file of ``anisomesh train``, or the name of a pretrained network; None for the default one.
    device
        ``"cpu"``, or ``"cuda"``, which needs torch.
    denoise
        Whether noise that the network finds is removed from the points. ``remesh`` removes none from designed
        surfaces, on which a tenth of the edges or more are flat.

    References
    ----------
    NASM, section 3.2; docs/stages/network.md for the default network.
    """

    weights: str | os.PathLike[str] | None = None
    device: str = "cpu"
    denoise: bool = True

    def __post_init__(self) -> None:
        if not isinstance(self.weights, str | os.PathLike | None):
            raise OptionError(f"weights = {self.weights!r}; expected the name of a network or of a file")
        if not isinstance(self.denoise, bool):
            raise OptionError(f"denoise = {self.denoise!r}; expected True or False")

    def __call__(self, surface: Surface) -> MetricField:
        """Return the metric at the points of a surface.

        Raises
        ------
        WeightsError, LearningError
            If the network cannot be loaded, or the device needs torch and it is not installed.
        OptionError
            If there are no such weights, or the device cannot be used.
        """
        found = predict(surface, self.weights, device=self.device, denoise=self.denoise)
        points = found.points if found.noise > 0.0 else None
        return MetricField(
            tensors=found.tensors, points=points, extra=found.extra, noise=found.noise, remarks=found.remarks
        )


@dataclass(frozen=True)
class Hybrid(Neural):
    """A mean of the network's metric and the measured one, on the surface without the noise that the network finds.

    Where curvature cannot be measured reliably it is the network's metric alone, and on flat parts the measured one.

    Parameters
    ----------
    crease_angle, radius
        As for :class:`~anisomesh.metric.sources.Curvature`; the other parameters are the same as for :class:`Neural`.
    """

    crease_angle: float = 40.0
    radius: int = DEFAULT_RADIUS

    def __call__(self, surface: Surface) -> MetricField:
        """Return the metric at the points of a surface; errors as :class:`Neural`."""
        field = super().__call__(surface)
        denoised = surface if field.points is None else surface.with_points(field.points)
        blended = _blended(denoised, field.tensors, self.crease_angle, self.radius)
        return replace(blended, points=field.points, noise=field.noise, remarks=field.remarks)


def _blended(surface: Surface, predicted: PointTensors, crease_angle: float, radius: int) -> MetricField:
    """Return the weighted mean, as line fields, of a predicted metric (V, 3, 3) and the measured one."""
    patches = smooth_patches(surface, crease_angle, radius)
    curvature = principal_curvatures(patches.surface, radius=radius)
    measured = curvature_metric(patches.surface, curvature)
    frames = tangent_frames(unit_normals(patches.surface))
    own, other = (
        line_field_components(*principal_stretch(tensors), frames) for tensors in (predicted[patches.source], measured)
    )
    flat = np.abs(curvature.values[:, 1]) * surface.diagonal < MAX_FLAT_CURVATURE
    share = np.where(flat, 1.0, np.where(curvature.trusted, MEASURED_SHARE, 0.0))[:, None]
    return patches.field(tensors_of_line_field((1.0 - share) * own + share * other, frames))
