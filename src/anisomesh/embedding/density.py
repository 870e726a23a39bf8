"""Densities that make cells as large as a metric asks where an embedding does not reproduce its lengths."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import CornerTensors, EmbeddedPoints, PointScalars, PointTensors
from anisomesh.embedding.gradient import FaceGradient, FaceTensors, face_gradient, face_tensors
from anisomesh.mesh.geometry import sums_at_points
from anisomesh.mesh.surface import Surface


def area_factors(surface: Surface, tensors: PointTensors | CornerTensors) -> PointScalars:
    """Return the area in the metric over the area (V,) around each point, over the same of the whole surface.

    Parameters
    ----------
    surface
        The surface.
    tensors
        The metric at its points (V, 3, 3), or at the corners of its faces (F, 3, 3, 3).
    """
    gradient = face_gradient(surface)
    identity = np.broadcast_to(np.eye(2), (surface.n_faces, 2, 2))
    return _ratios(surface, gradient, face_tensors(surface, tensors, gradient.frames), identity)


def density_of_sizes(surface: Surface, tensors: PointTensors | CornerTensors, embedded: EmbeddedPoints) -> PointScalars:
    """Return the density (V,) with which cells of a tessellation of the embedding have equal areas in the metric.

    Parameters
    ----------
    surface
        The surface.
    tensors
        The metric at its points (V, 3, 3), or at the corners of its faces (F, 3, 3, 3).
    embedded
        The embedded points (V, d).

    Notes
    -----
    Five extra coordinates reproduce a size that varies only in part, and more so the steeper it varies. In two
    dimensions an optimal tessellation has sites in proportion to the square root of the density, so the density is the
    square of the area in the metric over the area in the embedding. It is constant where the embedding is exact.

    References
    ----------
    Gersho, "Asymptotically optimal block quantization", 1979.
    """
    gradient = face_gradient(surface)
    jacobian = (gradient.operator @ embedded).reshape(surface.n_faces, 2, -1)
    achieved = jacobian @ jacobian.transpose(0, 2, 1)
    return _ratios(surface, gradient, face_tensors(surface, tensors, gradient.frames), achieved) ** 2


def _ratios(surface: Surface, gradient: FaceGradient, first: FaceTensors, second: FaceTensors) -> PointScalars:
    """Return the ratios (V,) of the areas of the faces at each point in two metrics (F, 2, 2), over the one of all."""
    shares = []
    for metric in (first, second):
        area = gradient.areas * np.sqrt(np.maximum(np.linalg.det(metric), 0.0))
        total = float(area.sum()) or 1.0
        shares.append(sums_at_points(area / total, surface.faces, surface.n_points))
    some = (shares[0] > 0.0) & (shares[1] > 0.0)
    return np.divide(shares[0], shares[1], out=np.ones(surface.n_points), where=some)
