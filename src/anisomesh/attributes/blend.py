"""Values between the corners of a triangle: means, rounded means, unit vectors, or values of the nearest corner."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from anisomesh.attributes.model import Array
from anisomesh.mesh.geometry import unit

_COLOUR_NAME = re.compile(r"colou?r|rgb", re.IGNORECASE)
_DIRECTION_NAME = re.compile(r"normal|tangent", re.IGNORECASE)
_WEIGHT_NAME = re.compile(r"weight", re.IGNORECASE)
_JOINTS_NAME = re.compile(r"joints", re.IGNORECASE)
_UNIT_TOLERANCE = 1e-2  # deviation of lengths of unit vectors and of sums of shares from 1, in files of half precision

Floats = npt.NDArray[np.float64]


class Blend:
    """How an array is evaluated between the points or corners at which it is given.

    Parameters
    ----------
    name
        Name of the array.
    values
        Its rows (n, ...).

    Notes
    -----
    Real and complex numbers are interpolated linearly; bools, integers and strings are taken from the nearest corner.
    The name tells two kinds from these: integers named colour or rgb are interpolated and rounded. What is named normal
    or tangent and has unit length stays so (of four components the first three: the fourth is a sign), and rows of
    shares named weight keep their sum 1.

    Numbers that are not finite stand for missing values: the mean is the one of the corners that have a value, with the
    weights of these. It is missing only where all corners that have a part in it lack a value.
    """

    def __init__(self, name: str, values: Array) -> None:
        self._dtype, kind, width = values.dtype, values.dtype.kind, values.shape[-1] if values.ndim > 1 else 1
        self._rounds = kind in "iu" and bool(_COLOUR_NAME.search(name))
        self._nearest = kind not in "fc" and not self._rounds
        rows = values.reshape(-1, width) if kind == "f" else np.zeros((0, 1))
        rows = rows[np.isfinite(rows).all(axis=1)]
        self._directs = bool(_DIRECTION_NAME.search(name)) and _is_unit(rows)
        shares = bool(_WEIGHT_NAME.search(name)) and width > 1 and len(rows) > 0 and bool((rows >= 0.0).all())
        self._shares = shares and bool((np.abs(rows.sum(axis=1) - 1.0) < _UNIT_TOLERANCE).all())

    def at(self, corners: Array, weights: Floats, nearest: npt.NDArray[np.int64]) -> Array:
        """Return the values (n, ...) between the values at corners (n, 3, ...), with barycentric weights (n, 3).

        ``nearest`` is the nearest corner (n,).
        """
        from_nearest = corners[np.arange(len(corners)), nearest]
        if self._nearest:
            return np.asarray(from_nearest)
        mean = np.einsum("nc,nc...->n...", weights, corners)
        undefined = np.flatnonzero(~np.isfinite(mean).all(axis=tuple(range(1, mean.ndim))))
        if len(undefined):
            mean[undefined], from_nearest[undefined] = _of_finite(
                corners[undefined], weights[undefined], from_nearest[undefined], whole=self._directs or self._shares
            )
        if self._rounds:
            mean = np.rint(mean)
        if self._shares:
            mean /= mean.sum(axis=-1, keepdims=True)
        if self._directs:
            size = np.linalg.norm(mean[..., :3], axis=-1, keepdims=True)
            mean = np.where(size == 0.0, from_nearest, mean)
            mean[..., :3] = np.where(np.isfinite(size), unit(mean[..., :3]), np.nan)
            mean[..., 3:] = from_nearest[..., 3:]
        return np.asarray(mean.astype(self._dtype))


def _of_finite(corners: Array, weights: Floats, nearest: Array, *, whole: bool) -> tuple[Array, Array]:
    """Return means (n, ...) of the finite values at corners (n, 3, ...), and the values (n, ...) of one corner each.

    Parameters
    ----------
    corners, weights
        The values, and barycentric weights (n, 3).
    nearest
        The values (n, ...) of the nearest corner, which are returned unless they are missing.
    whole
        Whether rows are missing as a whole if one component is, as with vectors of length 1.

    Notes
    -----
    Where no corner with a weight has a value, both are the values of the corner with the largest weight.
    """
    n = len(corners)
    rows, chosen = corners.reshape(n, 3, -1), nearest.reshape(n, -1)
    finite = np.isfinite(rows)
    if whole:
        finite = np.broadcast_to(finite.all(axis=2, keepdims=True), rows.shape)
    shares = np.where(finite, weights[:, :, None], 0.0)
    total = shares.sum(axis=1)
    heaviest = np.argmax(np.where((total > 0.0)[:, None], shares, weights[:, :, None]), axis=1)
    values = np.take_along_axis(rows, heaviest[:, None], axis=1)[:, 0]
    sums = (shares * np.where(finite, rows, 0.0)).sum(axis=1)
    means = np.where(total > 0.0, np.divide(sums, total, out=np.zeros_like(sums), where=total > 0.0), values)
    missing = ~np.isfinite(chosen) | (total == 0.0)
    values = np.where(missing.any(axis=1, keepdims=True) if whole else missing, values, chosen)
    return means.reshape(nearest.shape), values.reshape(nearest.shape)


def _is_unit(rows: Array) -> bool:
    """Return whether rows (n, k) are vectors of length 1, with a sign or without, or missing: without a length."""
    if len(rows) == 0 or rows.shape[1] not in (3, 4):
        return False
    length = np.linalg.norm(rows[:, :3], axis=1)
    return bool((np.abs(length[length > 0.0] - 1.0) < _UNIT_TOLERANCE).all()) and bool(length.any())


def skin_sets(data: Mapping[str, Array]) -> list[tuple[str, str]]:
    """Return the pairs of names of joints and their weights, as JOINTS_0 and WEIGHTS_0 of glTF."""
    found = []
    for name in sorted(data):
        other = _JOINTS_NAME.sub(lambda word: "WEIGHTS" if word[0].isupper() else "weights", name)
        if other == name or other not in data:
            continue
        joints, shares = data[name], data[other]
        numbers = joints.dtype.kind in "iu" and shares.dtype.kind == "f"
        if numbers and joints.ndim == 2 and joints.shape == shares.shape:
            found.append((name, other))
    return found


def blend_skin(joints: Array, shares: Array, weights: Floats) -> tuple[Array, Array]:
    """Return the joints (n, k) with the largest weights between three corners, and these, which sum to 1 or are NaN.

    Parameters
    ----------
    joints, shares
        Joints of the three corners and their weights (n, 3, k).
    weights
        Barycentric coordinates (n, 3).
    """
    k = joints.shape[2]
    numbers = joints.reshape(len(joints), 3 * k)
    missing = np.asarray(~np.isfinite(shares).all(axis=2))
    nothing = (missing | (weights == 0.0)).all(axis=1)
    parts = np.where(missing[:, :, None], 0.0, shares) * weights[:, :, None]
    parts = parts.reshape(len(joints), 3 * k).astype(np.float64)
    order = np.argsort(numbers, axis=1, kind="stable")
    numbers, parts = np.take_along_axis(numbers, order, axis=1), np.take_along_axis(parts, order, axis=1)
    for column in range(1, 3 * k):
        same = numbers[:, column] == numbers[:, column - 1]
        parts[:, column] += np.where(same, parts[:, column - 1], 0.0)
        parts[:, column - 1] = np.where(same, 0.0, parts[:, column - 1])
    largest = np.argsort(-parts, axis=1, kind="stable")[:, :k]
    numbers, parts = np.take_along_axis(numbers, largest, axis=1), np.take_along_axis(parts, largest, axis=1)
    total = parts.sum(axis=1, keepdims=True)
    parts = np.divide(parts, total, out=np.zeros_like(parts), where=total > 0.0)
    numbers = np.where(parts > 0.0, numbers, 0)
    parts[nothing] = np.nan
    return numbers.astype(joints.dtype), parts.astype(shares.dtype)
