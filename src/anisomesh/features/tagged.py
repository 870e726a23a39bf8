"""Edges that the user names as features, on the surfaces that are made of the user's mesh."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from anisomesh._arrays import EdgeMask
from anisomesh.errors import MeshFileError, OptionError
from anisomesh.mesh.subdivision import Subdivision
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys

_DIGITS = 18  # of a number that fits in 64 bits


def load_pairs(path: str | os.PathLike[str]) -> npt.NDArray[np.int64]:
    """Return the pairs of points (n, 2) in a text file: two whole numbers a line, from 0 on; # begins a remark.

    Raises
    ------
    MeshFileError
        If the file cannot be read, or has something else in it.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise MeshFileError(f"{path}: cannot be read as text: {error}") from error
    pairs = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        if len(words) != 2 or not all(word.isdecimal() and len(word) < _DIGITS for word in words):
            raise MeshFileError(f"{path}, line {number}: {line.strip()[:40]!r}; expected two vertex numbers, from 0 on")
        pairs.append([int(word) for word in words])
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def tagged_edges(given: Surface, pairs: npt.ArrayLike, prepared: Surface, tolerance: float) -> EdgeMask:
    """Return which edges (E,) of the prepared surface are those named.

    Parameters
    ----------
    given
        The user's mesh.
    pairs
        Points of it that edges join (n, 2).
    prepared
        The surface after repair.
    tolerance
        Distance up to which the repair has welded points.

    Raises
    ------
    OptionError
        If the pairs are no whole numbers (n, 2) in range, or no edges of the mesh.

    Notes
    -----
    The repair may merge points and copy others, so edges are found again by the places of their ends.
    """
    ends = _checked(given, pairs)
    tree = cKDTree(prepared.points)
    found = np.zeros(len(prepared.edges), dtype=bool)
    keys = edge_keys(prepared.edges)
    reach = max(tolerance, 1e-12 * given.diagonal)
    copies = [tree.query_ball_point(given.points[column], reach) for column in ends.T]
    wanted = [(a, b) for first, second in zip(*copies, strict=True) for a in first for b in second if a != b]
    if wanted:
        found = np.isin(keys, edge_keys(np.array(wanted, dtype=np.int64)))
    return found


def edges_within(refined: Subdivision, parent: Surface, tagged: EdgeMask) -> EdgeMask:
    """Return which edges (E',) of a subdivided surface lie in tagged edges (E,) of its parent."""
    used = refined.barycentric > 0.0
    some = refined.point_corners[np.arange(len(used)), used.argmax(axis=1)]
    corners = np.where(used, refined.point_corners, some[:, None])
    low, high = corners.min(axis=1), corners.max(axis=1)
    middle = corners.sum(axis=1) - low - high
    on_edge = (middle == low) | (middle == high)
    a, b = refined.surface.edges.T
    ends = np.stack([np.minimum(low[a], low[b]), np.maximum(high[a], high[b])], axis=1)
    fits = on_edge[a] & on_edge[b]
    for end in (a, b):
        fits &= (low[end, None] == ends).any(axis=1) & (high[end, None] == ends).any(axis=1)
    return np.asarray(fits & np.isin(edge_keys(ends), edge_keys(parent.edges[tagged])))


def _checked(given: Surface, pairs: npt.ArrayLike) -> npt.NDArray[np.int64]:
    values: npt.NDArray[Any] = np.asarray(pairs)
    if values.ndim != 2 or values.shape[1] != 2 or not np.issubdtype(values.dtype, np.number):
        raise OptionError(f"features has shape {values.shape}; expected (n, 2), two points of the mesh for each edge")
    if len(values) == 0:
        return np.zeros((0, 2), dtype=np.int64)
    ends = values.astype(np.int64)
    if (ends != values).any() or ends.min() < 0 or ends.max() >= given.n_points:
        raise OptionError(
            f"features names points from {values.min()} to {values.max()}; expected whole numbers from 0 to "
            f"{given.n_points - 1}"
        )
    missing = ~np.isin(edge_keys(ends), edge_keys(given.edges))
    if missing.any():
        a, b = ends[np.argmax(missing)]
        raise OptionError(
            f"{missing.sum():,} of the {len(ends):,} pairs in features are no edges of the mesh, the first {a} - {b}"
        )
    return ends
