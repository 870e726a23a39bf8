"""Colours of triangles by stretch, by quality in the metric, or by distance from the reference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceScalars
from anisomesh.evaluation.shape import quality_in_reference_metric
from anisomesh.mesh.distance import squared_distances
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.surface import Surface

_UPPER_COLOUR_QUANTILE = 0.99  # of the values, for the last colour: a few outliers must not hide the rest; heuristic


@dataclass(frozen=True, kw_only=True, eq=False)
class Colouring:
    """A value per face and the colour map for the values.

    Parameters
    ----------
    values
        One number per face (F,).
    name
        Name of the values, with their unit; the label of the colour bar.
    colours
        Name of a Matplotlib colour map.
    part
        Part of the colour map to use, within 0 to 1; edges are hard to see on the darkest colours.
    low, high
        Values of the first and the last colour; if None, the smallest value and the 99 % quantile.
    """

    values: FaceScalars
    name: str
    colours: str = "YlOrRd"
    part: tuple[float, float] = (0.0, 0.85)
    low: float | None = None
    high: float | None = None

    @property
    def limits(self) -> tuple[float, float]:
        """Values of the first and the last colour, in increasing order."""
        finite = self.values[np.isfinite(self.values)]
        low, high = (
            (float(finite.min()), float(np.quantile(finite, _UPPER_COLOUR_QUANTILE))) if len(finite) else (0.0, 1.0)
        )
        low = low if self.low is None else self.low
        high = high if self.high is None else self.high
        return low, max(high, low + 1e-3 * (abs(low) or 1.0))

    @property
    def beyond(self) -> tuple[bool, bool]:
        """Whether values lie below the first colour, and whether values lie above the last."""
        low, high = self.limits
        return bool((self.values < low).any()), bool((self.values > high).any())

    def rgb(self) -> npt.NDArray[np.uint8]:
        """Return the colour of each face (F, 3)."""
        low, high = self.limits
        share = (np.clip(self.values, low, high) - low) / (high - low)
        return np.asarray(self.colour_map()(share, bytes=True))[:, :3]

    def colour_map(self) -> Any:
        """Return the colours as a Matplotlib colour map."""
        from matplotlib import colormaps
        from matplotlib.colors import ListedColormap

        return ListedColormap(colormaps[self.colours](np.linspace(*self.part, 256)))


def stretch_colouring(surface: Surface, *, high: float | None = None) -> Colouring:
    """Colour triangles by their stretch, see :attr:`~anisomesh.mesh.surface.Surface.face_stretch`.

    Parameters
    ----------
    surface
        The triangles.
    high
        Stretch of the last colour, to compare surfaces; if None, the 99 % quantile.
    """
    values = surface.face_stretch
    return Colouring(values=values, name=f"stretch of the triangles, mean {_mean(values):.2f}", low=1.0, high=high)


def quality_colouring(surface: Surface, reference: Surface) -> Colouring:
    """Colour triangles by their quality G in the curvature metric of the reference, 1 if equilateral in the metric.

    Parameters
    ----------
    surface
        The triangles.
    reference
        The repaired input of the remesh; the metric of a vertex is the metric at its closest point.
    """
    frame = unit_frame(reference.points)
    base = reference.with_points(frame.to_unit(reference.points))
    values = quality_in_reference_metric(base, surface.with_points(frame.to_unit(surface.points)))
    name = f"quality G of the triangles in the metric, mean {_mean(values):.2f}"
    return Colouring(values=values, name=name, colours="RdYlBu", part=(0.05, 0.8), low=0.0, high=1.0)


def distance_colouring(surface: Surface, reference: Surface) -> Colouring:
    """Colour triangles by the mean distance of corners and barycentre from the reference, in % of its diagonal."""
    at_points = np.sqrt(squared_distances(surface.points, reference))
    at_centres = np.sqrt(squared_distances(surface.points[surface.faces].mean(axis=1), reference))
    mean = (at_points[surface.faces].sum(axis=1) + at_centres) / 4.0
    values = np.asarray(100.0 * mean / (reference.diagonal or 1.0))
    name = f"distance from the input, % of the diagonal, mean {_mean(values):.2g}"
    return Colouring(values=values, name=name, colours="YlGnBu", part=(0.0, 0.75), low=0.0)


def _mean(values: npt.NDArray[Any]) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else float("nan")
