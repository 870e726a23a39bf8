"""A procedural CAD part with sharp, weak and curved creases in known positions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Edges, Indices, Points
from anisomesh.errors import OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.shapes import patches

HEIGHT = 0.8  # of the block, model units, like the lengths below
SLOPE_DEGREES = 20.0  # dihedral angle of the weak crease
BOSS_RADIUS, BOSS_HEIGHT = 0.3, 0.35
BORE_RADIUS = 0.28
VOLUME = (
    HEIGHT * 3.0
    - 0.5 * float(np.tan(np.radians(SLOPE_DEGREES)))
    + np.pi * BOSS_RADIUS**2 * BOSS_HEIGHT
    - np.pi * BORE_RADIUS**2 * HEIGHT
)
"""Exact volume of the part with true circles, in model units cubed."""

_FIRST_CORNER_ANGLE = -0.75 * np.pi  # radians, of the first corner of a square from its centre
_MEAN_SQUARE_RADIUS = 0.6  # mean distance of the sides of the unit square from its centre, rounded


@dataclass(frozen=True, kw_only=True)
class CadFeatures:
    """Creases and corners of :func:`cad_part`.

    Attributes
    ----------
    creases
        Mesh edges (K, 2) on creases, lower index first, in lexicographic order.
    weak
        Which of the edges (K,) belong to the weak crease of 20 degrees; the others have 70 degrees or more.
    corners
        Points at which three or more creases meet: the eight corners of the block and the two ends of the weak crease.
    """

    creases: Edges
    weak: npt.NDArray[np.bool_]
    corners: Indices


def cad_part(resolution: int = 12) -> Surface:
    """Return a CAD part: a block of 3 x 1 x 0.8 with a boss, a bore and a slope of 20 degrees.

    Parameters
    ----------
    resolution
        Number of edges per unit length, at least 3.

    Returns
    -------
    Surface
        Closed, of genus 1, with evenly sized triangles. From left to right: a boss of radius 0.3 on the top; a
        through bore of radius 0.28; the slope. All creases are sharp except the weak one at the top of the slope.
        Planes and creases are exact, circles are inscribed polygons; the volume tends to ``VOLUME``.

    Raises
    ------
    OptionError
        If the resolution is below 3.
    """
    return _build(resolution)[0]


def cad_features(resolution: int = 12) -> CadFeatures:
    """Return the creases and corners of :func:`cad_part` of the same resolution."""
    return _build(resolution)[1]


def _build(n: int) -> tuple[Surface, CadFeatures]:
    """Return the part and its features."""
    if n < 3:
        raise OptionError(f"resolution is {n}; expected at least 3 edges per unit length")
    boss_layers, bore_layers = max(1, round(BOSS_HEIGHT * n)), max(2, round(HEIGHT * n))
    parts = _patches(n, boss_layers, bore_layers)
    points, faces, number = patches.join_patches(parts)
    first = np.cumsum([0, *(len(part[0]) for part in parts)])
    walls = [
        number[first[k] : first[k + 1]].reshape(layers + 1, -1)
        for k, layers in ((7, bore_layers), (8, boss_layers), (9, bore_layers))
    ]
    return Surface(points, faces), _features(walls, number[first[2] : first[2] + n + 1], n)


def _patches(n: int, boss_layers: int, bore_layers: int) -> list[patches.Patch]:
    """Return the patches of the part: 0 to 2 the top, 3 to 6 the bottom, 7 to 9 block, boss and bore walls, 10 boss."""
    boss, bore = _circle(BOSS_RADIUS, n), _circle(BORE_RADIUS, n)
    rectangle = _rectangle(n)
    axis = np.arange(n + 1) / n
    slope = np.stack([*np.meshgrid(2 + axis, axis, indexing="ij"), np.zeros((n + 1, n + 1))], axis=-1).reshape(-1, 3)
    top = [_square_around(boss, 0, n), _square_around(bore, 1, n), (slope, patches.grid_faces(n + 1, n + 1))]
    disk = patches.disk(BOSS_RADIUS, len(boss), _FIRST_CORNER_ANGLE)
    return [
        *((_lifted(points), faces) for points, faces in top),
        *((points, faces[:, ::-1]) for points, faces in [_moved(disk, 0.5), *top]),
        _wall(_lifted(rectangle), rectangle, bore_layers),
        _wall(_at(boss, 0.5, HEIGHT + BOSS_HEIGHT), _at(boss, 0.5, HEIGHT), boss_layers),
        _wall(_at(bore[::-1], 1.5, HEIGHT), _at(bore[::-1], 1.5, 0.0), bore_layers),
        _moved(disk, 0.5, HEIGHT + BOSS_HEIGHT),
    ]


def _features(walls: list[npt.NDArray[np.int32]], ridge: Indices, n: int) -> CadFeatures:
    """Return the features from the points of the walls (rows from the bottom) and of the weak crease."""
    wall = walls[0]
    loops = [table[k] for table in walls for k in (0, -1)]
    block_corners = [0, 3 * n, 4 * n, 7 * n]
    sharp = [np.stack([loop, np.roll(loop, -1)], axis=1) for loop in loops]
    sharp += [np.stack([wall[:-1, k], wall[1:, k]], axis=1) for k in block_corners]
    weak = np.sort(np.stack([ridge[:-1], ridge[1:]], axis=1), axis=1)
    creases = np.unique(np.concatenate([np.sort(edges, axis=1) for edges in [*sharp, weak]]), axis=0)
    is_weak = (creases[:, None] == weak[None]).all(axis=2).any(axis=1)
    corners = np.unique(np.concatenate([wall[0, block_corners], wall[-1, block_corners], ridge[[0, -1]]]))
    return CadFeatures(creases=creases.astype(np.int32), weak=is_weak, corners=corners)


def _circle(radius: float, n: int) -> npt.NDArray[np.float64]:
    """Return a circle (m, 2) around the origin with about n points per unit length, a multiple of 4."""
    return patches.circle(radius, 4 * max(3, round(0.5 * np.pi * radius * n)), _FIRST_CORNER_ANGLE)


def _rectangle(n: int) -> Points:
    """Return the outline (8n, 3) of the bottom, counter-clockwise from the origin."""
    x = np.concatenate([block + np.arange(n) / n for block in range(3)])
    y = np.arange(n) / n
    back = np.concatenate([3.0 - np.zeros(1), x[:0:-1]])
    plan = [
        np.stack([x, 0 * x], axis=1),
        np.stack([0 * y + 3.0, y], axis=1),
        np.stack([back, 0 * back + 1.0], axis=1),
        np.stack([0 * y, np.append(1.0, y[:0:-1])], axis=1),
    ]
    return np.pad(np.concatenate(plan), ((0, 0), (0, 1)))


def _square_around(loop: npt.NDArray[np.float64], block: int, n: int) -> patches.Patch:
    """Return unit square number ``block`` of the bottom without the interior of a circle at its centre."""
    axis = np.arange(n) / n
    outline = np.concatenate(
        [
            np.stack([axis, 0 * axis], axis=1),
            np.stack([0 * axis + 1, axis], axis=1),
            np.stack([np.append(1.0, axis[:0:-1]), 0 * axis + 1], axis=1),
            np.stack([0 * axis, np.append(1.0, axis[:0:-1])], axis=1),
        ]
    )
    radius = float(np.linalg.norm(loop[0]))
    n_strips = max(1, round((_MEAN_SQUARE_RADIUS - radius) * n))
    between = []
    for k in range(1, n_strips):
        t = k / n_strips
        count = round((1 - t) * 4 * n + t * len(loop))
        direction = patches.circle(1.0, count, _FIRST_CORNER_ANGLE)
        square = 0.5 / np.abs(direction).max(axis=1, keepdims=True)
        between.append(direction * ((1 - t) * square + t * radius))
    points, faces = patches.patch_between_loops([outline - 0.5, *between, loop])
    # The coordinates of the outline must be bitwise equal to the adjacent patches.
    points[:, :2] += [block + 0.5, 0.5]
    points[: 4 * n, :2] = outline + np.array([block, 0.0])
    return points, faces


def _lifted(points: Points) -> Points:
    """Return points of the bottom moved up to the top of the block."""
    fall = np.tan(np.radians(SLOPE_DEGREES)) * np.maximum(points[:, 0] - 2.0, 0.0)
    return np.column_stack([points[:, :2], HEIGHT - fall])


def _at(loop: npt.NDArray[np.float64], x: float, z: float) -> Points:
    """Return plane points (m, 2) around (x, 0.5) at height z, (m, 3)."""
    return np.column_stack([loop[:, 0] + x, loop[:, 1] + 0.5, np.full(len(loop), z)])


def _moved(patch: patches.Patch, x: float, z: float = 0.0) -> patches.Patch:
    """Return a patch around the origin moved to (x, 0.5, z)."""
    return _at(patch[0][:, :2], x, z), patch[1]


def _wall(top: Points, bottom: Points, n_layers: int) -> patches.Patch:
    """Return the wall between two loops; its normals point outwards if they are counter-clockwise from above."""
    t = (np.arange(n_layers + 1) / n_layers)[:, None, None]
    points = bottom * (1 - t) + top * t
    rows, columns = points.shape[:2]
    return points.reshape(-1, 3), patches.grid_faces(rows, columns, wrap_columns=True)[:, ::-1]
