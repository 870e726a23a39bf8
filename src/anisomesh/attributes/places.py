"""Places on a surface for points near it: on the sheet that faces their way, in a part, or along a walk in a chart."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Points
from anisomesh.attributes.charts import BEYOND_BOUNDARY, BEYOND_SEAM
from anisomesh.attributes.model import Ints
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface

_AXES = np.concatenate([np.eye(3), -np.eye(3)])
_OPPOSED_COSINE = -0.1  # between normals of point and face, below which another sheet is looked for; heuristic
_AGREEING_COSINE = 0.1  # from which on the other sheet faces the way of the point; heuristic
_MAX_STEPS = 300  # faces that a walk crosses
_OUTSIDE = 1e-12  # barycentric coordinate below which a walk goes on: rounding
_FLAT_SINE_SQUARED = 1e-30  # squared sine of a corner of a face that has no plane

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


class Sheets:
    """Closest points on some faces of a surface, by preference on a sheet that faces the way of the point.

    Parameters
    ----------
    surface
        The surface.
    chosen
        The faces (n,); all by default.
    """

    def __init__(self, surface: Surface, chosen: Ints | None = None) -> None:
        self._surface = surface
        self._chosen = np.arange(surface.n_faces, dtype=np.int64) if chosen is None else chosen
        self._one_way: dict[int, Sheets | None] = {}

    @cached_property
    def _closest(self) -> ClosestPoints:
        used, position = np.unique(self._surface.faces[self._chosen], return_inverse=True)
        return ClosestPoints(Surface(self._surface.points[used], position.reshape(-1, 3)))

    def locate(self, points: Points, normals: Floats, reach: Floats) -> tuple[Ints, Floats]:
        """Return facet (n,) and barycentric coordinates (n, 3) of the place on the surface for each point.

        Parameters
        ----------
        points, normals
            Points (n, 3), and unit normals there; zero for any direction.
        reach
            Distance (n,) up to which a sheet that faces the way of the point comes before the closest one.

        Notes
        -----
        Where the closest face is opposed, the closest one of all faces whose normals have a positive component along
        the axis nearest to the normal of the point is taken: these include every face within 35 degrees of the
        normal, and none within 35 degrees of its opposite.
        """
        facet, weights = self._locate(points)
        opposed = np.flatnonzero(self._cosines(facet, normals) < _OPPOSED_COSINE)
        axis = np.argmax(normals[opposed] @ _AXES.T, axis=1)
        for k in np.unique(axis).tolist():
            sheet, rows = self._facing(k), opposed[axis == k]
            if sheet is None:
                continue
            other, places = sheet._locate(points[rows])
            corners = self._surface.points[self._surface.faces[other]]
            distance = np.linalg.norm(np.einsum("nc,ncx->nx", places, corners) - points[rows], axis=1)
            better = (self._cosines(other, normals[rows]) > _AGREEING_COSINE) & (distance <= reach[rows])
            facet[rows[better]], weights[rows[better]] = other[better], places[better]
        return facet, weights

    def nearest(self, points: Points) -> Ints:
        """Return the closest face (n,) to each point (n, 3), whichever way it faces."""
        return self._locate(points)[0]

    def _locate(self, points: Points) -> tuple[Ints, Floats]:
        facet, weights = self._closest.locate(points)
        return self._chosen[facet], weights

    def _cosines(self, facet: Ints, normals: Floats) -> Floats:
        return np.asarray(np.einsum("nx,nx->n", self._surface.face_normals[facet], normals))

    def _facing(self, axis: int) -> Sheets | None:
        """Return the faces that face the way of an axis, None if there are none."""
        if axis not in self._one_way:
            chosen = self._chosen[self._surface.face_normals[self._chosen] @ _AXES[axis] > 0.0]
            self._one_way[axis] = Sheets(self._surface, chosen) if len(chosen) else None
        return self._one_way[axis]


class Divided:
    """Closest points on a surface that is divided into parts.

    Parameters
    ----------
    surface
        The surface.
    parts
        The part of each face (F,).
    """

    def __init__(self, surface: Surface, parts: Ints) -> None:
        self.whole = Sheets(surface)
        self._surface = surface
        self._order = np.argsort(parts, kind="stable")
        self._numbers, self._first = np.unique(parts[self._order], return_index=True)
        self._sheets: dict[int, Sheets] = {int(self._numbers[0]): self.whole} if len(self._numbers) == 1 else {}

    def locate(self, parts: Ints, points: Points, normals: Floats, reach: Floats) -> tuple[Ints, Floats]:
        """Return facet (n,) and barycentric coordinates (n, 3) of the places of points in parts (n,) of the surface.

        The other parameters are the ones of :meth:`Sheets.locate`.
        """
        facet, weights = np.zeros(len(points), dtype=np.int64), np.zeros((len(points), 3))
        order = np.argsort(parts, kind="stable")
        numbers, first = np.unique(parts[order], return_index=True)
        ends = np.append(first, len(order))[1:]
        for number, start, end in zip(numbers.tolist(), first, ends, strict=True):
            rows = order[start:end]
            facet[rows], weights[rows] = self._part(number).locate(points[rows], normals[rows], reach[rows])
        return facet, weights

    def _part(self, number: int) -> Sheets:
        if number not in self._sheets:
            k = int(np.searchsorted(self._numbers, number))
            end = self._first[k + 1] if k + 1 < len(self._first) else len(self._order)
            self._sheets[number] = Sheets(self._surface, np.sort(self._order[self._first[k] : end]))
        return self._sheets[number]


def walk(surface: Surface, neighbours: Ints, start: Ints, points: Points) -> tuple[Ints, Floats, Mask]:
    """Walk straight from faces towards points, never across a seam or a boundary.

    Parameters
    ----------
    surface
        The surface.
    neighbours
        The face across each side (F, 3), or what there is in its place, see
        :meth:`~anisomesh.attributes.charts.Joints.neighbours`.
    start, points
        Faces (n,) to start from, and points (n, 3) near the surface.

    Returns
    -------
    facet, weights
        The face (n,) at the end of each walk, and the barycentric coordinates (n, 3) of its point closest to the point.
    at_seam
        Which walks (n,) a seam has ended.

    Notes
    -----
    A face is left across the side beyond which the projection of the point onto its plane is farthest; if there is no
    face across that side, across the next such one.

    References
    ----------
    Devillers, Pion, Teillaud, "Walking in a triangulation", 2002 (visibility walk).
    """
    facet = start.copy()
    at_seam = np.zeros(len(points), dtype=bool)
    before = np.full(len(points), BEYOND_BOUNDARY - 2, dtype=np.int64)
    left = np.arange(len(points))
    for _ in range(_MAX_STEPS):
        if len(left) == 0:
            break
        here = facet[left]
        weights = _projected(surface.points[surface.faces[here]], points[left])
        order = np.argsort(weights, axis=1)[:, :2]
        outside = np.take_along_axis(weights, order, axis=1) < -_OUTSIDE
        across = np.take_along_axis(neighbours[here], order, axis=1)
        second = (across[:, 0] < 0) & outside[:, 1]
        following = np.where(second, across[:, 1], across[:, 0])
        at_seam[left] = (outside & (across == BEYOND_SEAM)).any(axis=1) & (following < 0)
        goes = outside[:, 0] & (following >= 0) & (following != before[left])
        before[left], facet[left[goes]] = here, following[goes]
        left = left[goes]
    return facet, closest_weights(surface.points[surface.faces[facet]], points), at_seam


def closest_weights(corners: Floats, points: Points) -> Floats:
    """Return barycentric coordinates (n, 3) of the point of each triangle (n, 3, 3) closest to a point (n, 3)."""
    weights = _projected(corners, points)
    outside = np.flatnonzero(weights.min(axis=1) < 0.0)
    if len(outside) == 0:
        return weights
    corners, points = corners[outside], points[outside]
    sides = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    squares = np.einsum("ncx,ncx->nc", sides, sides)
    along = np.einsum("ncx,ncx->nc", points[:, None] - corners[:, [1, 2, 0]], sides)
    fraction = np.clip(np.divide(along, squares, out=np.zeros_like(along), where=squares > 0.0), 0.0, 1.0)
    places = corners[:, [1, 2, 0]] + fraction[:, :, None] * sides
    side = np.argmin(((places - points[:, None]) ** 2).sum(axis=2), axis=1)
    row = np.arange(len(outside))
    clamped = np.zeros((len(outside), 3))
    clamped[row, (side + 1) % 3], clamped[row, (side + 2) % 3] = 1.0 - fraction[row, side], fraction[row, side]
    weights[outside] = clamped
    return weights


def _projected(corners: Floats, points: Points) -> Floats:
    """Return barycentric coordinates (n, 3) of points (n, 3) projected onto the planes of triangles (n, 3, 3).

    They sum to 1 and are negative outside; a triangle without a plane has one of them -1, so that it counts as outside.
    """
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(first, second)
    square = np.einsum("nx,nx->n", normal, normal)
    offset = points - corners[:, 0]
    lengths = np.einsum("nx,nx->n", first, first) * np.einsum("nx,nx->n", second, second)
    flat = ~(square > _FLAT_SINE_SQUARED * lengths)
    square = np.where(flat, 1.0, square)
    b = np.einsum("nx,nx->n", np.cross(offset, second), normal) / square
    c = np.einsum("nx,nx->n", np.cross(first, offset), normal) / square
    weights = np.stack([1.0 - b - c, b, c], axis=1)
    weights[flat] = (1.0, 1.0, -1.0)
    return weights
