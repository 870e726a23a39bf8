"""Parallel projections: direction, frame, and the options of a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from anisomesh._arrays import Points, Vector3
from anisomesh.errors import OptionError

_FRAME_MARGIN = 1.12  # size of the picture over the extent of the points; heuristic
_OBLIQUE_OFFSETS = (0.45, 0.4)  # default view: offset to the right and upwards per unit towards the viewer; heuristic
_MAX_Z_ALIGNMENT = 0.9  # cosine between viewing direction and z axis above which y points up; heuristic
_MIN_UP_SINE = 1e-3  # sine between viewing direction and upward axis below which the view is refused; heuristic


@dataclass(frozen=True, kw_only=True)
class View:
    """A parallel projection.

    Parameters
    ----------
    centre
        The point in the middle of the picture (3,), model units.
    axes
        Unit vectors to the right, up, and towards the viewer, one per row (3, 3).
    half_height
        Half the height of the visible part, model units.
    """

    centre: Vector3
    axes: Points
    half_height: float

    def project(self, points: Points) -> Points:
        """Return the coordinates of points (n, 3) in the picture: right, up, towards the viewer, in model units."""
        return np.asarray((points - self.centre) @ self.axes.T)


@dataclass(frozen=True, kw_only=True)
class PictureOptions:
    """Camera and resolution of a picture.

    Parameters
    ----------
    direction
        Vector from the model towards the viewer, of any length; if None, see :func:`camera_axes`.
    up
        Coordinate axis that points up, 0, 1 or 2; if None, see :func:`camera_axes`.
    scale
        Pixels per pixel of a picture of normal size along both sides: more for print.

    Raises
    ------
    OptionError
        If the direction is zero, not finite, or parallel to the axis ``up``.
    """

    direction: tuple[float, float, float] | None = None
    up: int | None = None
    scale: int = 1

    def __post_init__(self) -> None:
        self.axes(np.zeros((1, 3)))

    def axes(self, points: Points) -> Points:
        """Return the axes (3, 3) of a view of points (V, 3), as in :class:`View`."""
        return camera_axes(points, self.direction, self.up)


def camera_axes(points: Points, direction: Sequence[float] | None = None, up: int | None = None) -> Points:
    """Return the axes (3, 3) of a view, as in :class:`View`.

    Parameters
    ----------
    points
        The points to show (V, 3).
    direction
        Vector from the model towards the viewer; if None, oblique to the shortest side of the bounding box.
    up
        The coordinate axis that points up, 0, 1 or 2; if None, z, or y in a view along z.

    Raises
    ------
    OptionError
        If the direction is zero, not finite, or parallel to the axis ``up``.
    """
    if direction is None:
        sides = np.ptp(points, axis=0)
        axis = int(np.argmin(sides if up is None else np.where(np.arange(3) == up, np.inf, sides)))
        front = np.eye(3)[axis] * (-1.0 if axis == 1 else 1.0)
        above = np.eye(3)[(1 if axis == 2 else 2) if up is None else up]
        towards = front + _OBLIQUE_OFFSETS[0] * np.cross(above, front) + _OBLIQUE_OFFSETS[1] * above
    else:
        towards = np.asarray(direction, dtype=np.float64)
        length = float(np.linalg.norm(towards))
        if not 0.0 < length < np.inf:
            raise OptionError(
                f"the direction to look from is {tuple(direction)}; expected finite numbers, not all zero"
            )
        towards = towards / length
        above = np.eye(3)[(1 if abs(towards[2]) > _MAX_Z_ALIGNMENT else 2) if up is None else up]
        if np.linalg.norm(np.cross(above, towards)) < _MIN_UP_SINE:
            raise OptionError(
                f"the direction to look from, {tuple(direction)}, is parallel to the axis that points up; change either"
            )
    right = np.cross(above, towards)
    axes = np.stack([right, np.cross(towards, right), towards])
    return np.asarray(axes / np.linalg.norm(axes, axis=1, keepdims=True))


def framed(points: Points, axes: Points, aspect: float) -> View:
    """Return the view with these axes that shows all points (V, 3), for a picture with this width over height."""
    low, high = _extent(points, axes)
    half = 0.5 * (high - low)
    half_height = _FRAME_MARGIN * float(max(half[1], half[0] / aspect)) or 1.0
    return View(centre=0.5 * (low + high) @ axes, axes=axes, half_height=half_height)


def height_for(points: Points, axes: Points, width: int, limits: tuple[int, int]) -> int:
    """Return the height in pixels at which points (V, 3) fill a picture of this width, within limits."""
    low, high = _extent(points, axes)
    right, up, _ = high - low
    if width * up >= limits[1] * right:
        return limits[1]
    return max(limits[0], round(float(width * up / right)))


def _extent(points: Points, axes: Points) -> tuple[Vector3, Vector3]:
    projected = points @ axes.T
    return projected.min(axis=0), projected.max(axis=0)
