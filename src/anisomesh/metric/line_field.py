"""Lines of stretch: what the network predicts, from and to metric tensors."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import PointTensors, PointVectors
from anisomesh.metric.tangent import line_field, line_tensors

MOST = float(np.log(400.0))  # the logarithm of the largest squared stretch

Frames = npt.NDArray[np.float64]


def directions_of(tensors: PointTensors) -> tuple[PointVectors, npt.NDArray[np.float64]]:
    """Return the direction of largest metric (N, 3), and the logarithm of largest over middle eigenvalue (N,).

    Of the paper's metric, with eigenvalues 1, 1 and r^2, these are v_max and 2 log r. Of that of an embedding, which is
    1 along the normal and no less in the surface, they are the direction and square of its stretch.
    """
    values, vectors = np.linalg.eigh(tensors)
    return np.asarray(vectors[:, :, 2]), np.asarray(np.log(values[:, 2] / np.maximum(values[:, 1], 1e-30)))


def lines_in(frames: Frames, directions: PointVectors, logarithms: npt.NDArray[np.float64]) -> npt.NDArray[np.float32]:
    """Return lines (N, 2) in tangent frames (N, 2, 3): the logarithm at twice the angle of the direction."""
    field = line_field(directions, logarithms, frames)
    return np.stack([field.real, field.imag], axis=1).astype(np.float32)


def tensors_of(lines: npt.NDArray[Any], frames: Frames) -> PointTensors:
    """Return the paper's metric (N, 3, 3) for lines (N, 2): 1 but for r^2 along the line, r^2 = exp(length)."""
    field = lines[:, 0].astype(np.float64) + 1j * lines[:, 1].astype(np.float64)
    square = np.exp(np.minimum(np.abs(field), MOST))
    return np.asarray(np.eye(3) + (square - 1.0)[:, None, None] * line_tensors(field, frames))
