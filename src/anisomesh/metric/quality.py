"""Anisotropic quality: the shape of triangles measured in a metric."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import CornerTensors, Faces, FaceScalars, Points, PointTensors

_QUALITY_BLOCK = 16_384  # triangles at once, to bound the memory of intermediate arrays

Corners = npt.NDArray[np.float64]


def anisotropic_quality(points: Points, faces: Faces, roots: PointTensors | CornerTensors) -> FaceScalars:
    """Return the quality G (F,) of each triangle: 1 if equilateral in the metric, 0 if degenerate.

    Parameters
    ----------
    points, faces
        The triangles.
    roots
        Symmetric square roots Q of the metric at the points (V, 3, 3), or at the corners of the triangles
        (F, 3, 3, 3); a common factor has no effect.

    Notes
    -----
    G = 2 sqrt(3) S / (p h) with area S, half perimeter p and longest side h of the triangle mapped by the mean of Q
    over its corners. A triangle of zero size has G = 0. The paper's formula of Heron for S requires the half
    perimeter s = (a + b + c) / 2; here S comes from a cross product, which does not suffer from cancellation.

    References
    ----------
    NASM, section 4.1 (G_avg is the mean over the triangles).
    """
    result = np.empty(len(faces))
    for first in range(0, len(faces), _QUALITY_BLOCK):
        block = faces[first : first + _QUALITY_BLOCK]
        corners = roots[block] if roots.ndim == 3 else roots[first : first + _QUALITY_BLOCK]
        result[first : first + _QUALITY_BLOCK] = _quality(points[block], corners.mean(axis=1))
    return result


def _quality(corners: Corners, roots: PointTensors) -> FaceScalars:
    """Return the quality (n,) of triangles (n, 3, 3) with one root each (n, 3, 3)."""
    mapped = np.einsum("fij,fcj->fci", roots, corners - corners[:, :1])
    sides = mapped[:, [2, 0, 1]] - mapped[:, [1, 2, 0]]
    lengths = np.sqrt(np.einsum("fci,fci->fc", sides, sides))
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 1], sides[:, 2]), axis=1)
    denominator = 0.5 * lengths.sum(axis=1) * lengths.max(axis=1)
    regular = 2.0 * np.sqrt(3.0)
    return np.asarray(np.divide(regular * area, denominator, out=np.zeros_like(area), where=denominator > 0.0))
