"""Polygon soups, as read from files, and their triangulation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, kw_only=True)
class PolygonSoup:
    """Polygons as a reader found them in a file, not validated.

    Attributes
    ----------
    points
        Coordinates (V, 3).
    corners
        Point indices (sum of sizes,) of all polygons, concatenated.
    sizes
        Number of corners of each polygon (P,).
    """

    points: npt.NDArray[np.float64]
    corners: npt.NDArray[np.int64]
    sizes: npt.NDArray[np.int64]

    @classmethod
    def from_array(cls, points: npt.NDArray[Any], polygons: npt.NDArray[Any]) -> PolygonSoup:
        """Return the soup of polygons (P, k) with k corners each."""
        return cls(
            points=np.asarray(points, dtype=np.float64),
            corners=np.asarray(polygons, dtype=np.int64).ravel(),
            sizes=np.full(len(polygons), polygons.shape[1], dtype=np.int64),
        )


def validate(soup: PolygonSoup) -> None:
    """Raise ValueError if there is no polygon, or one with fewer than 3 corners, a bad index or coordinate."""
    if len(soup.sizes) == 0:
        raise ValueError("it has no face")
    few = np.flatnonzero(soup.sizes < 3)
    if len(few):
        raise ValueError(f"face {few[0]} has {soup.sizes[few[0]]} corners; expected at least 3")
    n_points = len(soup.points)
    bad = np.flatnonzero((soup.corners < 0) | (soup.corners >= n_points))
    if len(bad):
        face = np.searchsorted(np.cumsum(soup.sizes), bad[0], side="right")
        index = soup.corners[bad[0]]
        raise ValueError(f"face {face} refers to point {index} (counted from 0) but there are {n_points} points")
    bad = np.flatnonzero(~np.isfinite(soup.points).all(axis=1))
    if len(bad):
        raise ValueError(f"point {bad[0]} (counted from 0) is {soup.points[bad[0]].tolist()}, which is not finite")


def triangulate(soup: PolygonSoup) -> npt.NDArray[np.int64]:
    """Return triangles (F, 3) in the order of their polygons.

    Quadrilaterals are split along their shorter diagonal, larger polygons into fans from their first corner.
    """
    sizes, corners = soup.sizes, soup.corners
    if (sizes == 3).all():
        return corners.reshape(-1, 3)
    first = np.cumsum(sizes) - sizes
    polygon = np.repeat(np.arange(len(sizes)), sizes - 2)
    rank = np.arange(len(polygon)) - np.repeat(np.cumsum(sizes - 2) - (sizes - 2), sizes - 2)
    shift = np.zeros(len(sizes), dtype=np.int64)
    quads = np.flatnonzero(sizes == 4)
    a, b, c, d = (soup.points[corners[first[quads] + k]] for k in range(4))
    shift[quads] = np.linalg.norm(b - d, axis=1) < np.linalg.norm(a - c, axis=1)
    local = np.stack([np.zeros_like(rank), rank + 1, rank + 2], axis=1) + shift[polygon, None]
    return corners[first[polygon, None] + local % sizes[polygon, None]]
