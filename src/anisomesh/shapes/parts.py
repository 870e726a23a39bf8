"""Procedural CAD parts of few large triangles: prisms, solids of revolution, lofts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from anisomesh.errors import OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.shapes import patches

Outline = npt.NDArray[np.float64]


def prism(outline: Sequence[Sequence[float]] | Outline, height: float) -> Surface:
    """Return the exact prism over a simple polygon (n, 2), counter-clockwise, from z = 0, with 4 n - 4 triangles.

    Raises
    ------
    OptionError
        If the outline is not such a polygon, or the height is not positive.
    """
    corners = np.asarray(outline, dtype=np.float64)
    if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3 or not height > 0.0:
        raise OptionError(
            f"outline has shape {corners.shape}, height is {height}; expected (n, 2) and a positive height"
        )
    n = len(corners)
    cap = _triangulate(corners)
    lower, upper = (np.pad(corners, ((0, 0), (0, 1)), constant_values=z) for z in (0.0, height))
    k, after = np.arange(n), np.roll(np.arange(n), -1)
    walls = [np.stack([k, after, after + n], axis=1), np.stack([k, after + n, k + n], axis=1)]
    return Surface(np.concatenate([lower, upper]), np.concatenate([cap[:, ::-1], cap + n, *walls]))


def revolution(profile: Sequence[Sequence[float]] | Outline, n_around: int = 32) -> Surface:
    """Return the solid of revolution of a profile (n, 2) of radii and heights around the z axis.

    Vertices are on the exact surface; it is a :func:`loft` over a regular polygon of ``n_around`` corners.

    Raises
    ------
    OptionError
        If the profile does not start and end on the axis or touches it in between, or ``n_around`` is below 3.
    """
    if n_around < 3:
        raise OptionError(f"n_around is {n_around}; expected 3 or more")
    return loft(patches.circle(1.0, n_around), profile)


def loft(outline: Sequence[Sequence[float]] | Outline, profile: Sequence[Sequence[float]] | Outline) -> Surface:
    """Return the solid whose sections are an outline scaled by a profile; its vertices, creases and sides are exact.

    Parameters
    ----------
    outline
        Polygon (m, 2), counter-clockwise and star-shaped around the origin.
    profile
        Scale factors and heights (n, 2); the first and the last factor are 0.

    Raises
    ------
    OptionError
        If the outline is not such a polygon, or the profile does not start and end on the axis or touches it in
        between.
    """
    polygon, rows = _validated(outline, profile)
    if rows[0, 0] != 0.0 or rows[-1, 0] != 0.0 or not (rows[1:-1, 0] > 0.0).all():
        raise OptionError("profile must start and end on the axis (radius 0) and have positive radii in between")
    n_around = len(polygon)
    rings = _rings(polygon, rows[1:-1])
    ends = np.array([[0.0, 0.0, rows[0, 1]], [0.0, 0.0, rows[-1, 1]]])
    wall = patches.grid_faces(len(rings), n_around, wrap_columns=True)[:, ::-1] if len(rings) > 1 else np.zeros((0, 3))
    first, last = len(rings) * n_around, len(rings) * n_around + 1
    k, after = np.arange(n_around), np.roll(np.arange(n_around), -1)
    top = (len(rings) - 1) * n_around
    fans = [
        np.stack([np.full(n_around, first), after, k], axis=1),
        np.stack([np.full(n_around, last), top + k, top + after], axis=1),
    ]
    return Surface(np.concatenate([*rings, ends]), np.concatenate([wall, *fans]).astype(np.int64))


def hollow_loft(outline: Sequence[Sequence[float]] | Outline, section: Sequence[Sequence[float]] | Outline) -> Surface:
    """Return a loft with a hole along the axis: outlines scaled and raised as a closed polygon prescribes.

    Parameters
    ----------
    outline
        As in :func:`loft`.
    section
        Simple polygon (n, 2) of positive scale factors and heights, counter-clockwise: up outside, down inside.

    Raises
    ------
    OptionError
        If the outline is not such a polygon, or the section is clockwise or has a factor that is not positive.
    """
    polygon, rows = _validated(outline, section)
    after = np.roll(rows, -1, axis=0)
    if not (rows[:, 0] > 0.0).all() or not (rows[:, 0] * after[:, 1] - rows[:, 1] * after[:, 0]).sum() > 0.0:
        raise OptionError("section must be counter-clockwise and have positive scale factors")
    wall = patches.grid_faces(len(rows), len(polygon), wrap_rows=True, wrap_columns=True)[:, ::-1]
    return Surface(np.concatenate(_rings(polygon, rows)), wall.astype(np.int64))


def _validated(
    outline: Sequence[Sequence[float]] | Outline, profile: Sequence[Sequence[float]] | Outline
) -> tuple[Outline, Outline]:
    """Return an outline (m, 2) and a profile (n, 2) as arrays, after validation."""
    polygon, rows = np.asarray(outline, dtype=np.float64), np.asarray(profile, dtype=np.float64)
    if polygon.ndim != 2 or polygon.shape[1] != 2 or len(polygon) < 3 or not is_star_shaped(polygon):
        raise OptionError(
            f"outline of shape {polygon.shape}; expected (m, 2), counter-clockwise and star-shaped around the origin"
        )
    if rows.ndim != 2 or rows.shape[1] != 2 or len(rows) < 3:
        raise OptionError(f"profile has shape {rows.shape}; expected (n, 2) with n of at least 3")
    return polygon, rows


def _rings(polygon: Outline, rows: Outline) -> list[Outline]:
    """Return the sections (m, 3) of a loft, one for each row of the profile."""
    return [np.pad(size * polygon, ((0, 0), (0, 1)), constant_values=z) for size, z in rows]


def is_star_shaped(outline: Outline) -> bool:
    """Return whether a polygon (m, 2) is counter-clockwise and star-shaped around the origin, with one turn."""
    after = np.roll(outline, -1, axis=0)
    cross = outline[:, 0] * after[:, 1] - outline[:, 1] * after[:, 0]
    turn = np.arctan2(cross, np.einsum("nx,nx->n", outline, after))
    return bool((cross > 0.0).all() and abs(turn.sum() - 2.0 * np.pi) < 1.0)


def sparse_parts() -> dict[str, Surface]:
    """Return ten CAD parts by name, of 12 to a few hundred triangles; creases and corners are exact."""
    turn = 2.0 * np.pi * np.arange(24) / 24
    teeth = np.where(np.arange(24) % 4 < 2, 1.0, 0.75)[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    hexagon = np.stack([np.cos(turn[::4]), np.sin(turn[::4])], axis=1)
    stairs: list[list[float]] = [[0, 0], [4, 0], [4, 1], [3, 1], [3, 2], [2, 2], [2, 3], [1, 3], [1, 4], [0, 4]]
    screw: list[list[float]] = [[0, 0], [1.0, 0], [1.0, 0.6], [0.5, 0.6], [0.5, 3.0], [0.4, 3.2], [0, 3.2]]
    washers: list[list[float]] = [[0, 0], [1, 0], [1, 0.5], [1.6, 0.5], [1.6, 1.0], [0.7, 1.0], [0.7, 2.0], [0, 2.0]]
    return {
        "cube": prism([[0, 0], [1, 0], [1, 1], [0, 1]], 1.0),
        "slab": prism([[0, 0], [3, 0], [3, 2], [0, 2]], 0.2),
        "rod": prism([[0, 0], [0.3, 0], [0.3, 0.3], [0, 0.3]], 4.0),
        "bracket": prism([[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [0, 2]], 0.5),
        "channel": prism([[0, 0], [3, 0], [3, 2], [2.6, 2], [2.6, 0.4], [0.4, 0.4], [0.4, 2], [0, 2]], 4.0),
        "stairs": prism(stairs, 2.0),
        "hexagon": prism(hexagon, 0.8),
        "gear": prism(teeth, 0.4),
        "screw": revolution(screw, 32),
        "washer stack": revolution(washers, 32),
    }


def _triangulate(outline: Outline) -> npt.NDArray[np.int64]:
    """Return triangles (n - 2, 3) of a simple polygon by ear clipping (Meisters 1975); O(n^3), for a few dozen corners.

    Raises
    ------
    OptionError
        If there is no ear: the polygon is clockwise or intersects itself.
    """
    left = list(range(len(outline)))
    triangles = []
    while len(left) >= 3:
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            others = outline[[point for point in left if point not in (a, b, c)]]
            sides = [_side(outline[p], outline[q], others) for p, q in ((a, b), (b, c), (c, a))]
            if _side(outline[a], outline[b], outline[c]) > 0.0 and not np.all(np.stack(sides) >= 0.0, axis=0).any():
                triangles.append([a, b, c])
                del left[k]
                break
        else:
            raise OptionError("outline is not a simple, counter-clockwise polygon")
    return np.array(triangles, dtype=np.int64)


def _side(a: Outline, b: Outline, point: Outline) -> Outline:
    """Return twice the signed area of the triangles a, b, point (..., 2); positive if a point is left of a b."""
    along, to = b - a, point - a
    return np.asarray(along[0] * to[..., 1] - along[1] * to[..., 0])
