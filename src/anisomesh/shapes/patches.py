"""Structured pieces from which the exact test shapes are put together."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Indices, Points
from anisomesh.mesh.weld import coincident

Patch = tuple[Points, Faces]


def grid_faces(rows: int, columns: int, *, wrap_rows: bool = False, wrap_columns: bool = False) -> Faces:
    """Return the triangles of a grid of points numbered row by row, two for each cell.

    A face is counter-clockwise seen from the side from which rows run away to the right and columns upwards,
    that is its normal is (row direction) x (column direction).
    """
    i, j = np.meshgrid(np.arange(rows - (not wrap_rows)), np.arange(columns - (not wrap_columns)), indexing="ij")
    a = i * columns + j
    b = (i + 1) % rows * columns + j
    c = (i + 1) % rows * columns + (j + 1) % columns
    d = i * columns + (j + 1) % columns
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3).astype(np.int32)


def zip_loops(outer: npt.NDArray[np.float64], inner: npt.NDArray[np.float64]) -> Faces:
    """Triangulate between two loops around the origin.

    Parameters
    ----------
    outer, inner
        Angles of the points of each loop, increasing, over less than a full turn and starting about equal.

    Returns
    -------
    ndarray
        Faces (len(outer) + len(inner), 3), counter-clockwise; inner points are numbered behind the outer ones.
    """
    n, m = len(outer), len(inner)
    outer_middle = 0.5 * (outer + np.append(outer[1:], outer[0] + 2 * np.pi))
    inner_middle = 0.5 * (inner + np.append(inner[1:], inner[0] + 2 * np.pi))
    i, j = np.arange(n), np.arange(m)
    from_outer = np.stack([i, (i + 1) % n, n + np.searchsorted(inner_middle, outer_middle, side="left") % m], axis=1)
    from_inner = np.stack(
        [n + (j + 1) % m, n + j, np.searchsorted(outer_middle, inner_middle, side="right") % n], axis=1
    )
    return np.concatenate([from_outer, from_inner]).astype(np.int32)


def rings(loops: Sequence[npt.NDArray[np.float64]]) -> Patch:
    """Return the patch (z = 0, facing up) between loops (n, 2) around the origin, from the outermost inwards.

    A last loop of one point closes the patch with a fan.
    """
    points, faces, first = np.concatenate(loops), [], 0
    for outer, inner in pairwise(loops):
        if len(inner) == 1:
            i = np.arange(len(outer))
            strip = np.stack([i, (i + 1) % len(outer), np.full_like(i, len(outer))], axis=1).astype(np.int32)
        else:
            strip = zip_loops(_angles(outer), _angles(inner))
        faces.append(strip + np.int32(first))
        first += len(outer)
    return np.pad(points, ((0, 0), (0, 1))), np.concatenate(faces)


def disk(radius: float, n_around: int, start: float = 0.0) -> Patch:
    """Return a flat disk (z = 0, facing up) with about even triangles and ``n_around`` points on its rim."""
    n_rings = max(1, round(n_around / (2 * np.pi)))
    loops = [circle(radius, n_around, start)]
    for k in range(1, n_rings):
        share = 1 - k / n_rings
        loops.append(circle(radius * share, max(6, round(n_around * share)), start))
    return rings([*loops, np.zeros((1, 2))])


def circle(radius: float, n_around: int, start: float = 0.0) -> npt.NDArray[np.float64]:
    """Return points (n, 2) on a circle around the origin, counter-clockwise from the angle ``start``."""
    angle = start + 2 * np.pi * np.arange(n_around) / n_around
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def joined(patches: Sequence[Patch]) -> tuple[Points, Faces, Indices]:
    """Join patches where their points are equal; return also the new number of each of all the points."""
    first = np.cumsum([0, *(len(points) for points, _ in patches)])
    points = np.concatenate([points for points, _ in patches])
    faces = np.concatenate([faces + start for (_, faces), start in zip(patches, first, strict=False)])
    kept, number = np.unique(coincident(points), return_inverse=True)
    return points[kept], number[faces].astype(np.int32), number.astype(np.int32)


def _angles(loop: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return np.unwrap(np.arctan2(loop[:, 1], loop[:, 0]))
