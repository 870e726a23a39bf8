"""The metric of a remesh in real units, in which the edges of its result have the length 1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import PointTensors
from anisomesh.mesh.geometry import Frame
from anisomesh.mesh.surface import Surface
from anisomesh.metric.conformity import MetricExtent
from anisomesh.metric.field import mean_at_points
from anisomesh.metric.tangent import tangent_frames, unit_normals
from anisomesh.metric.transfer import PlacedMetric, transfer_to_corners


@dataclass(frozen=True, kw_only=True, eq=False)
class UnitMetric:
    """A metric with a number that makes it real: the number of vertices, or the length of the edges.

    Attributes
    ----------
    placed
        The metric at bounding-box diagonal 1.
    frame
        The similarity between this and model units.
    n_vertices
        Number of vertices of the mesh that follows the metric.
    asked
        The length of its edges in ``placed``, None if it follows from the number of vertices.
    """

    placed: PlacedMetric
    frame: Frame
    n_vertices: int
    asked: float | None

    def at_points_of(self, surface: Surface) -> PointTensors:
        """Return the metric in model units at the points of a surface near its own (V, 3, 3).

        Where it jumps across creases, it is the mean over the faces at a point, weighted by their areas.
        """
        reference, field = self.placed.surface, self.placed.field
        at_unit = surface.with_points(self.frame.to_unit(surface.points))
        roots = transfer_to_corners(reference, field, at_unit)
        tensors = roots @ roots if roots.ndim == 3 else mean_at_points(at_unit, roots @ roots)
        length = self.asked
        if length is None:
            length = MetricExtent.of(reference.surface, field).length(self.n_vertices)
        tensors = tensors / (length * self.frame.scale) ** 2
        return np.asarray(0.5 * (tensors + tensors.transpose(0, 2, 1)))


def tangent_sizes(surface: Surface, tensors: PointTensors) -> npt.NDArray[np.float64]:
    """Return the smallest and the largest length of an edge in the tangent plane that has the length 1 in a metric.

    Parameters
    ----------
    surface
        The surface.
    tensors
        Symmetric positive definite matrices at its points (V, 3, 3).

    Returns
    -------
    sizes
        Lengths (V, 2) along the principal directions of the metric in the tangent plane.
    """
    frames = tangent_frames(unit_normals(surface))
    eigenvalues = np.linalg.eigvalsh(frames @ tensors @ frames.transpose(0, 2, 1))
    return np.asarray(1.0 / np.sqrt(eigenvalues[:, ::-1]))
