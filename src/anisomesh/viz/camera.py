"""The camera: a parallel projection, which way it looks, and how much it shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from anisomesh._arrays import Points, Vector3
from anisomesh.errors import OptionError

_MARGIN = 1.12


@dataclass(frozen=True, kw_only=True)
class View:
    """A parallel projection.

    Parameters
    ----------
    centre
        The point in the middle of the picture, model units.
    axes
        Rows: to the right, up, and towards the viewer; orthonormal (3, 3).
    half_height
        Half the height of what is in view, model units.
    """

    centre: Vector3
    axes: Points
    half_height: float

    def project(self, points: Points) -> Points:
        """Return points (n, 3) as distances from the middle of the picture: to the right, up, towards the viewer."""
        return np.asarray((points - self.centre) @ self.axes.T)


def camera_axes(points: Points, direction: Sequence[float] | None = None, up: int | None = None) -> Points:
    """Return the axes of a view (3, 3), as in :class:`View`.

    Parameters
    ----------
    points
        What is looked at (V, 3).
    direction
        From the model towards the viewer; if None, along the shortest side of the bounding box, turned a little.
    up
        The coordinate axis that points up, 0, 1 or 2; if None, z where z is not looked along, else y.

    Raises
    ------
    OptionError
        If the direction is zero or that of ``up``.
    """
    if direction is None:
        sides = np.ptp(points, axis=0)
        axis = int(np.argmin(sides if up is None else np.where(np.arange(3) == up, np.inf, sides)))
        front = np.eye(3)[axis] * (-1.0 if axis == 1 else 1.0)
        above = np.eye(3)[(1 if axis == 2 else 2) if up is None else up]
        towards = front + 0.45 * np.cross(above, front) + 0.4 * above
    else:
        towards = np.asarray(direction, dtype=np.float64)
        length = float(np.linalg.norm(towards))
        if not 0.0 < length < np.inf:
            raise OptionError(
                f"the direction to look from is {tuple(direction)}; expected finite numbers, not all zero"
            )
        towards = towards / length
        above = np.eye(3)[(1 if abs(towards[2]) > 0.9 else 2) if up is None else up]
        if np.linalg.norm(np.cross(above, towards)) < 1e-3:
            raise OptionError(f"the direction to look from, {tuple(direction)}, is that which points up; change either")
    right = np.cross(above, towards)
    axes = np.stack([right, np.cross(towards, right), towards])
    return np.asarray(axes / np.linalg.norm(axes, axis=1, keepdims=True))


def framed(points: Points, axes: Points, aspect: float) -> View:
    """Return the view along these axes that has every point in it, in a picture with this width over height."""
    low, high = _extent(points, axes)
    half = 0.5 * (high - low)
    half_height = _MARGIN * float(max(half[1], half[0] / aspect)) or 1.0
    return View(centre=0.5 * (low + high) @ axes, axes=axes, half_height=half_height)


def height_for(points: Points, axes: Points, width: int, limits: tuple[int, int]) -> int:
    """Return the height at which a picture of this width is filled by the points, within limits."""
    low, high = _extent(points, axes)
    right, up, _ = high - low
    if width * up >= limits[1] * right:
        return limits[1]
    return max(limits[0], round(float(width * up / right)))


def _extent(points: Points, axes: Points) -> tuple[Vector3, Vector3]:
    projected = points @ axes.T
    return projected.min(axis=0), projected.max(axis=0)
