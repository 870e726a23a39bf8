"""A machine part made by code: sharp, weak and curved creases in known places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Edges, Indices, Points
from anisomesh.errors import OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.shapes import patches

HEIGHT = 0.8
SLOPE_DEGREES = 20.0
BOSS_RADIUS, BOSS_HEIGHT = 0.3, 0.35
BORE_RADIUS = 0.28
VOLUME = (
    HEIGHT * 3.0
    - 0.5 * float(np.tan(np.radians(SLOPE_DEGREES)))
    + np.pi * BOSS_RADIUS**2 * BOSS_HEIGHT
    - np.pi * BORE_RADIUS**2 * HEIGHT
)
"""Volume of the part with true circles, cubic model units."""


@dataclass(frozen=True, kw_only=True)
class CadFeatures:
    """Where the creases of :func:`cad_part` are.

    Parameters
    ----------
    creases
        Mesh edges (K, 2) on creases, lower index first, in lexicographic order.
    weak
        Which of them (K,) belong to the weak crease, of 20 degrees; the others turn by 70 degrees or more.
    corners
        Points where three or more creases meet: the eight of the block and the two ends of the weak crease.
    """

    creases: Edges
    weak: npt.NDArray[np.bool_]
    corners: Indices


def cad_part(resolution: int = 12) -> Surface:
    """Return a block of 3 x 1 x 0.8 with a boss, a bore and a top that falls off by 20 degrees.

    Parameters
    ----------
    resolution
        Number of edges along a unit of length, at least 3.

    Returns
    -------
    Surface
        Closed, of genus 1, with about even triangles. From left to right: a round boss of radius 0.3 on top; a
        through bore of radius 0.28; a slope. All creases are sharp but the top of the slope, which is weak.

    Raises
    ------
    OptionError
        If the resolution is below 3.
    """
    return _build(resolution)[0]


def cad_features(resolution: int = 12) -> CadFeatures:
    """Return where the creases of :func:`cad_part` of the same resolution are."""
    return _build(resolution)[1]


def _build(n: int) -> tuple[Surface, CadFeatures]:
    if n < 3:
        raise OptionError(f"resolution is {n}; expected at least 3 edges along a unit of length")
    boss, bore = _loop(BOSS_RADIUS, n), _loop(BORE_RADIUS, n)
    rectangle = _rectangle(n)
    slope = patches.grid_faces(n + 1, n + 1)
    axis = np.arange(n + 1) / n
    sloped = np.stack([*np.meshgrid(2 + axis, axis, indexing="ij"), np.zeros((n + 1, n + 1))], axis=-1).reshape(-1, 3)
    top = [_around(boss, 0, n), _around(bore, 1, n), (sloped, slope)]
    bottom = [_moved(patches.disk(BOSS_RADIUS, len(boss), _START), 0.5), *top]
    boss_height, bore_height = max(1, round(BOSS_HEIGHT * n)), max(2, round(HEIGHT * n))
    parts = [
        *((_lifted(points), faces) for points, faces in top),
        *((points, faces[:, ::-1]) for points, faces in bottom),
        _wall(_lifted(rectangle), rectangle, bore_height),
        _wall(_at(boss, 0.5, HEIGHT + BOSS_HEIGHT), _at(boss, 0.5, HEIGHT), boss_height),
        _wall(_at(bore[::-1], 1.5, HEIGHT), _at(bore[::-1], 1.5, 0.0), bore_height),
        _moved(patches.disk(BOSS_RADIUS, len(boss), _START), 0.5, HEIGHT + BOSS_HEIGHT),
    ]
    points, faces, number = patches.joined(parts)
    first = np.cumsum([0, *(len(part[0]) for part in parts)])
    layers, around = (boss_height, bore_height), (len(boss), len(bore))
    wall = number[first[7] : first[8]].reshape(bore_height + 1, -1)
    boss_wall = number[first[8] : first[9]].reshape(layers[0] + 1, around[0])
    bore_wall = number[first[9] : first[10]].reshape(layers[1] + 1, around[1])
    loops = [table[k] for table in (wall, boss_wall, bore_wall) for k in (0, -1)]
    block_corners = [0, 3 * n, 4 * n, 7 * n]
    sharp = [np.stack([loop, np.roll(loop, -1)], axis=1) for loop in loops]
    sharp += [np.stack([wall[:-1, k], wall[1:, k]], axis=1) for k in block_corners]
    ridge = number[first[2] : first[2] + n + 1]
    weak = np.sort(np.stack([ridge[:-1], ridge[1:]], axis=1), axis=1)
    creases = np.unique(np.concatenate([np.sort(edges, axis=1) for edges in [*sharp, weak]]), axis=0)
    is_weak = (creases[:, None] == weak[None]).all(axis=2).any(axis=1)
    corners = np.unique(np.concatenate([wall[0, block_corners], wall[-1, block_corners], ridge[[0, -1]]]))
    return Surface(points, faces), CadFeatures(creases=creases.astype(np.int32), weak=is_weak, corners=corners)


_START = -0.75 * np.pi


def _loop(radius: float, n: int) -> npt.NDArray[np.float64]:
    return patches.circle(radius, 4 * max(3, round(0.5 * np.pi * radius * n)), _START)


def _rectangle(n: int) -> Points:
    """Return the outline of the ground plan, counter-clockwise from the origin."""
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


def _around(loop: npt.NDArray[np.float64], block: int, n: int) -> patches.Patch:
    """Return the unit square number ``block`` of the ground plan without the inside of the loop."""
    axis = np.arange(n) / n
    rim = np.concatenate(
        [
            np.stack([axis, 0 * axis], axis=1),
            np.stack([0 * axis + 1, axis], axis=1),
            np.stack([np.append(1.0, axis[:0:-1]), 0 * axis + 1], axis=1),
            np.stack([0 * axis, np.append(1.0, axis[:0:-1])], axis=1),
        ]
    )
    radius = float(np.linalg.norm(loop[0]))
    n_strips = max(1, round((0.6 - radius) * n))
    between = []
    for k in range(1, n_strips):
        share = k / n_strips
        count = round((1 - share) * 4 * n + share * len(loop))
        direction = patches.circle(1.0, count, _START)
        square = 0.5 / np.abs(direction).max(axis=1, keepdims=True)
        between.append(direction * ((1 - share) * square + share * radius))
    points, faces = patches.rings([rim - 0.5, *between, loop])
    # The rim must agree with its neighbours to the last digit.
    points[:, :2] += [block + 0.5, 0.5]
    points[: 4 * n, :2] = rim + np.array([block, 0.0])
    return points, faces


def _lifted(points: Points) -> Points:
    """Return points of the ground plan moved up to the top of the block."""
    fall = np.tan(np.radians(SLOPE_DEGREES)) * np.maximum(points[:, 0] - 2.0, 0.0)
    return np.column_stack([points[:, :2], HEIGHT - fall])


def _at(loop: npt.NDArray[np.float64], x: float, z: float) -> Points:
    return np.column_stack([loop[:, 0] + x, loop[:, 1] + 0.5, np.full(len(loop), z)])


def _moved(patch: patches.Patch, x: float, z: float = 0.0) -> patches.Patch:
    return _at(patch[0][:, :2], x, z), patch[1]


def _wall(top: Points, bottom: Points, n_layers: int) -> patches.Patch:
    """Return the wall between two loops that are counter-clockwise seen from above, facing out of them."""
    share = (np.arange(n_layers + 1) / n_layers)[:, None, None]
    points = bottom * (1 - share) + top * share
    rows, columns = points.shape[:2]
    return points.reshape(-1, 3), patches.grid_faces(rows, columns, wrap_columns=True)[:, ::-1]
