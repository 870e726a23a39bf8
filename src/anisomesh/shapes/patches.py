"""Triangulated patches from which procedural shapes are assembled."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Indices, Points
from anisomesh.mesh.weld import coincident

Patch = tuple[Points, Faces]

_MIN_DISK_LOOP = 6  # points of the smallest loop of a disk around its centre: equilateral triangles


def grid_faces(rows: int, columns: int, *, wrap_rows: bool = False, wrap_columns: bool = False) -> Faces:
    """Return the triangles of a grid of points numbered row by row, two per cell.

    Normals have the direction of (from row to row) x (from column to column).
    """
    i, j = np.meshgrid(np.arange(rows - (not wrap_rows)), np.arange(columns - (not wrap_columns)), indexing="ij")
    a = i * columns + j
    b = (i + 1) % rows * columns + j
    c = (i + 1) % rows * columns + (j + 1) % columns
    d = i * columns + (j + 1) % columns
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3).astype(np.int32)


def zip_loops(outer: npt.NDArray[np.float64], inner: npt.NDArray[np.float64]) -> Faces:
    """Triangulate the strip between two loops around the origin.

    Parameters
    ----------
    outer, inner
        Angles of the points of each loop in radians, increasing, over less than a full turn, with about equal start.

    Returns
    -------
    ndarray
        Faces (len(outer) + len(inner), 3), counter-clockwise; inner points are numbered after the outer ones.
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


def patch_between_loops(loops: Sequence[npt.NDArray[np.float64]]) -> Patch:
    """Return the patch (z = 0, normals up) between loops (n, 2) around the origin, ordered from the outermost inwards.

    A last loop of one point closes the patch with a triangle fan.
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
    """Return a planar disk (z = 0, normals up) of evenly sized triangles with ``n_around`` boundary points."""
    n_rings = max(1, round(n_around / (2 * np.pi)))
    loops = [circle(radius, n_around, start)]
    for k in range(1, n_rings):
        t = 1 - k / n_rings
        loops.append(circle(radius * t, max(_MIN_DISK_LOOP, round(n_around * t)), start))
    return patch_between_loops([*loops, np.zeros((1, 2))])


def circle(radius: float, n_around: int, start: float = 0.0) -> npt.NDArray[np.float64]:
    """Return points (n, 2) on a circle around the origin, counter-clockwise from the angle ``start`` in radians."""
    angle = start + 2 * np.pi * np.arange(n_around) / n_around
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def join_patches(patches: Sequence[Patch]) -> tuple[Points, Faces, Indices]:
    """Join patches at equal points; return points, faces and the index in them of every point of the patches."""
    first = np.cumsum([0, *(len(points) for points, _ in patches)])
    points = np.concatenate([points for points, _ in patches])
    faces = np.concatenate([faces + start for (_, faces), start in zip(patches, first, strict=False)])
    kept, number = np.unique(coincident(points), return_inverse=True)
    return points[kept], number[faces].astype(np.int32), number.astype(np.int32)


def _angles(loop: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the angles (n,) of the points of a loop (n, 2), without jumps of a full turn."""
    return np.unwrap(np.arctan2(loop[:, 1], loop[:, 0]))
