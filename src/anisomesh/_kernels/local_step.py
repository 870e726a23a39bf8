"""The local step of the direct embedding: polar factors of linear maps from a plane, in closed form."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from anisomesh._kernels.compiled import allocating, inlined

Maps = npt.NDArray[np.float64]
Vector = npt.NDArray[np.float64]

_MIN_POLAR_LENGTH = 1e-10  # image of a direction over norm of the map, below which the rank is deficient; heuristic


@inlined
def _turn(aa: float, bb: float, ab: float) -> tuple[float, float]:
    """Return cosine and sine of half the angle of (aa - bb, 2 ab), without cancellation."""
    difference, twice = aa - bb, 2.0 * ab
    length = math.sqrt(difference * difference + twice * twice)
    if length == 0.0:
        return 1.0, 0.0
    if difference >= 0.0:
        cosine = math.sqrt(0.5 * (1.0 + difference / length))
        return cosine, twice / length / (2.0 * cosine)
    sine = math.copysign(math.sqrt(0.5 * (1.0 - difference / length)), twice)
    return twice / length / (2.0 * sine), sine


@inlined
def _normalise(vector: Vector, minimum: float) -> bool:
    """Divide a vector by its length; return False and leave it unchanged if the length is at most ``minimum``."""
    square = 0.0
    for x in vector:
        square += x * x
    length = math.sqrt(square)
    if length <= minimum:
        return False
    for c in range(len(vector)):
        vector[c] /= length
    return True


@inlined
def _write_perpendicular(vector: Vector, planes: Maps, f: int, out: Vector) -> None:
    """Write a unit vector across ``vector`` and closest to plane f of (F, 2, k); zero without a plane."""
    best = 0.0
    out[:] = 0.0
    for row in range(2):
        along, square = 0.0, 0.0
        for c in range(len(vector)):
            along += planes[f, row, c] * vector[c]
        for c in range(len(vector)):
            square += (planes[f, row, c] - along * vector[c]) ** 2
        if square > best:
            best = square
            for c in range(len(vector)):
                out[c] = (planes[f, row, c] - along * vector[c]) / math.sqrt(square)


@inlined
def _write_polar(maps: Maps, fallback: Maps, f: int, first: Vector, second: Vector, out: Maps) -> None:
    """Write the polar factor of map f of (F, 2, k) to out (2, k); ``first`` and ``second`` (k,) are workspace."""
    k = len(first)
    aa, bb, ab = 0.0, 0.0, 0.0
    for c in range(k):
        aa += maps[f, 0, c] * maps[f, 0, c]
        bb += maps[f, 1, c] * maps[f, 1, c]
        ab += maps[f, 0, c] * maps[f, 1, c]
    cosine, sine = _turn(aa, bb, ab)
    minimum = _MIN_POLAR_LENGTH * math.sqrt(aa + bb)
    for c in range(k):
        first[c] = cosine * maps[f, 0, c] + sine * maps[f, 1, c]
        second[c] = cosine * maps[f, 1, c] - sine * maps[f, 0, c]
    if not _normalise(first, minimum):
        for c in range(k):
            first[c] = cosine * fallback[f, 0, c] + sine * fallback[f, 1, c]
    along = 0.0
    for c in range(k):
        along += first[c] * second[c]
    for c in range(k):
        second[c] -= along * first[c]
    if not _normalise(second, minimum):
        _write_perpendicular(first, fallback, f, second)
    for c in range(k):
        out[0, c] = cosine * first[c] - sine * second[c]
        out[1, c] = sine * first[c] + cosine * second[c]


@allocating
def local_step(jacobian: Maps, root: Maps, frames: Maps, areas: Vector, target: Maps) -> float:
    """Write the target gradients, rotated to the current ones, and return the squared distance to them.

    Parameters
    ----------
    jacobian
        Gradients of the extra coordinates in the frames of the faces (F, 2, k), k >= 3.
    root
        Symmetric tensors S (F, 2, 2); a gradient induces the target metric if it is S times orthonormal rows.
    frames
        Orthonormal vectors in the plane of each face (F, 2, 3): their directions in the first three dimensions
        complete gradients of deficient rank.
    areas
        Areas of the faces (F,).
    target
        Output (F, 2, k): S times the polar factor of S times the gradient.

    Returns
    -------
    float
        Sum over the faces of area times squared Frobenius norm of gradient minus target.

    Notes
    -----
    The polar factor of a map from a plane is the closest map with orthonormal rows. The frame is rotated until its
    images a, b are perpendicular (by half the angle of (aa - bb, 2 ab)), the images are normalised, and the frame is
    rotated back. Before, the shorter image is made perpendicular to the longer one again, against rounding.

    References
    ----------
    NASM, supplement A; Sorkine, Alexa, "As-rigid-as-possible surface modeling", 2007.
    """
    k = jacobian.shape[2]
    product, plane, factor = np.empty((1, 2, k)), np.zeros((1, 2, k)), np.empty((2, k))
    first, second = np.empty(k), np.empty(k)
    total = 0.0
    for f in range(len(jacobian)):
        for row in range(2):
            for c in range(3):  # an assignment of arrays would take seconds to compile, for the text of its errors
                plane[0, row, c] = frames[f, row, c]
            for c in range(k):
                product[0, row, c] = root[f, row, 0] * jacobian[f, 0, c] + root[f, row, 1] * jacobian[f, 1, c]
        _write_polar(product, plane, 0, first, second, factor)
        square = 0.0
        for row in range(2):
            for c in range(k):
                target[f, row, c] = root[f, row, 0] * factor[0, c] + root[f, row, 1] * factor[1, c]
                square += (jacobian[f, row, c] - target[f, row, c]) ** 2
        total += areas[f] * square
    return total
