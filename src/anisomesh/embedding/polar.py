"""The orthonormal part of linear maps from a plane, in closed form."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceScalars
from anisomesh.surface.geometry import unit

_DEFICIENT = 1e-10

Maps = npt.NDArray[np.float64]
Vectors = npt.NDArray[np.float64]


def polar_factors(maps: Maps, fallback: Maps) -> Maps:
    """Return the closest maps (F, 2, k) with orthonormal rows to linear maps (F, 2, k).

    Parameters
    ----------
    maps
        Linear maps from a face plane to k dimensions, as the images of the two frame vectors.
    fallback
        Maps (F, 2, k) with orthonormal rows (or zero rows, for faces without a plane) that supply the directions
        which a map of lower rank leaves open.

    Notes
    -----
    The frame is turned so that the two images are perpendicular (by half the angle of (aa - bb, 2 ab), a and b the
    images), they are divided by their lengths, and the frame is turned back: closed form, for all faces at once.
    The shorter image is made perpendicular to the longer once more before, since rounding could tilt it.
    """
    a, b = maps[:, 0], maps[:, 1]
    aa, bb, ab = _dot(a, a), _dot(b, b), _dot(a, b)
    angle = 0.5 * np.arctan2(2.0 * ab, aa - bb)
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    first, second = cosine * a + sine * b, cosine * b - sine * a
    least = _DEFICIENT * np.sqrt(aa + bb)
    length = np.sqrt(_dot(first, first))
    lost = np.flatnonzero(length <= least)
    first /= np.where(length > least, length, 1.0)[:, None]
    first[lost] = cosine[lost] * fallback[lost, 0] + sine[lost] * fallback[lost, 1]
    second -= _dot(first, second)[:, None] * first
    length = np.sqrt(_dot(second, second))
    lost = np.flatnonzero(length <= least)
    second /= np.where(length > least, length, 1.0)[:, None]
    second[lost] = _perpendicular(first[lost], fallback[lost])
    return np.stack([cosine * first - sine * second, sine * first + cosine * second], axis=1)


def _perpendicular(vectors: Vectors, planes: Maps) -> Vectors:
    """Return unit vectors (n, k) perpendicular to unit vectors (n, k), near planes (n, 2, k); zero without a plane."""
    candidates = planes - np.einsum("njk,nk->nj", planes, vectors)[:, :, None] * vectors[:, None, :]
    better = np.einsum("njk,njk->nj", candidates, candidates).argmax(axis=1)
    return unit(candidates[np.arange(len(vectors)), better])


def _dot(a: Vectors, b: Vectors) -> FaceScalars:
    return np.asarray(np.einsum("fk,fk->f", a, b))
