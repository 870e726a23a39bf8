"""Polygon soups, as read from files, and their triangulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Carried
from anisomesh.mesh.surface import Surface

_FLAT = 1e-14  # twice the area over the squared extent of its polygon up to which a triangle has no area; rounding

Integers = npt.NDArray[np.int64]


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
    source
        The face or cell of the file that each polygon was made from (P,), counted from 0 in file order; by default
        there is one for each polygon.
    remarks
        What was left out or changed, a line each.
    carried
        What the file carries besides.
    """

    points: npt.NDArray[np.float64]
    corners: Integers
    sizes: Integers
    source: Integers = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    remarks: tuple[str, ...] = ()
    carried: Carried = field(default_factory=Carried)

    def __post_init__(self) -> None:
        if len(self.source) != len(self.sizes):
            object.__setattr__(self, "source", np.arange(len(self.sizes)))

    @classmethod
    def from_array(
        cls,
        points: npt.NDArray[Any],
        polygons: npt.NDArray[Any],
        *,
        remarks: Sequence[str] = (),
        carried: Carried | None = None,
    ) -> PolygonSoup:
        """Return the soup of polygons (P, k) with k corners each."""
        return cls(
            points=np.asarray(points, dtype=np.float64),
            corners=np.asarray(polygons, dtype=np.int64).ravel(),
            sizes=np.full(len(polygons), polygons.shape[1], dtype=np.int64),
            remarks=tuple(remarks),
            carried=carried or Carried(),
        )


class Triangulation(NamedTuple):
    """Triangles of polygons.

    Attributes
    ----------
    corners
        Numbers of corners of the soup (F, 3), in the order of the polygons.
    polygon
        The polygon of each triangle (F,).
    overlapping
        Polygons (n,) whose triangles overlap, because their outlines cross themselves.
    """

    corners: Integers
    polygon: Integers
    overlapping: Integers


class Triangles(NamedTuple):
    """A surface made of polygons.

    Attributes
    ----------
    surface
        All points, in the order of the soup, and the triangles.
    source
        The face or cell of the file that each triangle belongs to (F,).
    corners
        The corner of the soup that each corner of a triangle is (F, 3).
    remarks
        What was left out or changed, a line each: what the reader said, polygons of fewer than three corners, unused
        points that are not finite, polygons that cross themselves.
    """

    surface: Surface
    source: Integers
    corners: Integers
    remarks: tuple[str, ...]


def as_triangles(soup: PolygonSoup) -> Triangles:
    """Return polygons as triangles.

    Raises
    ------
    ValueError
        If polygons are missing, an index is out of range, or a coordinate of a polygon is not finite.
    """
    kept, soup = _without_odd_parts(soup)
    validate(soup)
    corners, polygon, overlapping = triangulate(soup)
    remarks = soup.remarks
    if len(overlapping):
        remarks += (
            f"{len(overlapping)} polygon(s) cross themselves or are far from flat, so that their triangles overlap; "
            f"the first is face {soup.source[overlapping[0]]} (counted from 0)",
        )
    surface = Surface(soup.points, soup.corners[corners])
    return Triangles(surface, soup.source[polygon], corners if kept is None else kept[corners], remarks)


def _without_odd_parts(soup: PolygonSoup) -> tuple[Integers | None, PolygonSoup]:
    """Leave out polygons of fewer than three corners, and give unused points finite coordinates.

    Returns the numbers of the corners that are left too, None if all are.
    """
    remarks, kept = [], None
    few = soup.sizes < 3
    if few.any() and not few.all():
        first = int(np.flatnonzero(few)[0])
        remarks.append(
            f"left out {np.count_nonzero(few)} face(s) of fewer than 3 corners; the first is face "
            f"{soup.source[first]} (counted from 0) with {soup.sizes[first]}"
        )
        kept = np.flatnonzero(~np.repeat(few, soup.sizes))
        soup = replace(
            soup,
            corners=soup.corners[kept],
            sizes=soup.sizes[~few],
            source=soup.source[~few],
        )
    odd = ~np.isfinite(soup.points).all(axis=1)
    if odd.any():
        used = np.zeros(len(soup.points), dtype=bool)
        used[soup.corners[(soup.corners >= 0) & (soup.corners < len(used))]] = True
        unused = np.flatnonzero(odd & ~used)
        if len(unused) and (used & ~odd).any():
            remarks.append(
                f"{len(unused)} point(s) that no face uses, the first of them {unused[0]} (counted from 0), have "
                "coordinates that are not finite; they were moved onto another point"
            )
            points = soup.points.copy()
            points[unused] = points[np.flatnonzero(used & ~odd)[0]]
            soup = replace(soup, points=points)
    return kept, replace(soup, remarks=(*soup.remarks, *remarks))


def validate(soup: PolygonSoup) -> None:
    """Raise ValueError if polygons are missing or have fewer than 3 corners, a bad index or a bad coordinate."""
    if len(soup.sizes) == 0:
        raise ValueError("it has no face")
    few = np.flatnonzero(soup.sizes < 3)
    if len(few):
        raise ValueError(f"face {soup.source[few[0]]} has {soup.sizes[few[0]]} corners; expected at least 3")
    n_points = len(soup.points)
    bad = np.flatnonzero((soup.corners < 0) | (soup.corners >= n_points))
    if len(bad):
        face = soup.source[np.searchsorted(np.cumsum(soup.sizes), bad[0], side="right")]
        index = soup.corners[bad[0]]
        raise ValueError(f"face {face} refers to point {index} (counted from 0) but there are {n_points} points")
    bad = np.flatnonzero(~np.isfinite(soup.points).all(axis=1))
    if len(bad):
        raise ValueError(f"point {bad[0]} (counted from 0) is {soup.points[bad[0]].tolist()}, which is not finite")


def triangulate(soup: PolygonSoup) -> Triangulation:
    """Return the triangles of valid polygons, in the order of the polygons.

    Notes
    -----
    Quadrilaterals are split along their shorter diagonal, larger polygons into fans from their first corner. Where a
    triangle would have no area or face away from the polygon, which is then concave or has a straight angle, ears are
    clipped in the plane of the polygon's Newell normal (Newell's method: the normal is the vector area).
    """
    sizes, corners = soup.sizes, soup.corners
    none = np.zeros(0, dtype=np.int64)
    if (sizes == 3).all():
        return Triangulation(np.arange(len(corners)).reshape(-1, 3), np.arange(len(sizes)), none)
    first = np.cumsum(sizes) - sizes
    polygon = np.repeat(np.arange(len(sizes)), sizes - 2)
    rank = np.arange(len(polygon)) - np.repeat(np.cumsum(sizes - 2) - (sizes - 2), sizes - 2)
    shift = np.zeros(len(sizes), dtype=np.int64)
    quads = np.flatnonzero(sizes == 4)
    a, b, c, d = (soup.points[corners[first[quads] + k]] for k in range(4))
    with np.errstate(over="ignore"):
        shift[quads] = np.linalg.norm(b - d, axis=1) < np.linalg.norm(a - c, axis=1)
    local = np.stack([np.zeros_like(rank), rank + 1, rank + 2], axis=1) + shift[polygon, None]
    local %= sizes[polygon, None]
    large = np.flatnonzero(sizes > 3)
    shape = _relative_corners(soup, large, first)
    normals = _newell_normals(shape, sizes[large])
    wrong = _folded(shape, normals, sizes[large], local[sizes[polygon] > 3])
    overlapping = none
    if wrong.any():
        chosen = large[wrong]
        of_chosen = np.repeat(wrong, sizes[large])
        clipped, forced = _clip_ears(shape[of_chosen], normals[wrong], sizes[chosen])
        local[np.isin(polygon, chosen)] = clipped
        overlapping = chosen[forced]
    return Triangulation(first[polygon, None] + local, polygon, overlapping)


def _relative_corners(soup: PolygonSoup, chosen: Integers, first: Integers) -> npt.NDArray[np.float64]:
    """Return the corners (n, 3) of polygons, from the first of each, divided by its extent."""
    sizes = soup.sizes[chosen]
    start = np.repeat(np.cumsum(sizes) - sizes, sizes)
    rows = soup.corners[np.repeat(first[chosen], sizes) + np.arange(len(start)) - start]
    shape = np.ldexp(soup.points[rows], -np.frexp(np.abs(soup.points).max())[1])  # so that differences do not overflow
    shape = shape - shape[start]
    extent = np.maximum.reduceat(np.abs(shape).max(axis=1), np.cumsum(sizes) - sizes) if len(sizes) else np.ones(0)
    scaled: npt.NDArray[np.float64] = shape / np.repeat(np.where(extent > 0, extent, 1.0), sizes)[:, None]
    return scaled


def _newell_normals(shape: npt.NDArray[np.float64], sizes: Integers) -> npt.NDArray[np.float64]:
    """Return the unit normals (P, 3) of polygons, zero where a polygon has no area."""
    if len(sizes) == 0:
        return np.zeros((0, 3))
    first = np.cumsum(sizes) - sizes
    following = np.arange(1, len(shape) + 1)
    following[np.cumsum(sizes) - 1] = first
    area = np.add.reduceat(np.cross(shape, shape[following]), first, axis=0)
    length = np.linalg.norm(area, axis=1, keepdims=True)
    normals: npt.NDArray[np.float64] = np.where(length > _FLAT, area / np.where(length > _FLAT, length, 1.0), 0.0)
    return normals


def _folded(
    shape: npt.NDArray[np.float64], normals: npt.NDArray[np.float64], sizes: Integers, local: Integers
) -> npt.NDArray[np.bool_]:
    """Return which polygons (P,) have an area and a triangle, given by its corners, without one or facing away."""
    owner = np.repeat(np.arange(len(sizes)), sizes - 2)
    a, b, c = (shape[(np.cumsum(sizes) - sizes)[owner] + local[:, k]] for k in range(3))
    turned = np.einsum("ij,ij->i", np.cross(b - a, c - a), normals[owner]) <= _FLAT
    return (np.bincount(owner[turned], minlength=len(sizes)) > 0) & normals.any(axis=1)


def _clip_ears(
    shape: npt.NDArray[np.float64], normals: npt.NDArray[np.float64], sizes: Integers
) -> tuple[Integers, npt.NDArray[np.bool_]]:
    """Return the triangles of polygons by the numbers of their corners, and which of the polygons are not simple."""
    from anisomesh._kernels.ears import Corners, clip_polygons

    axis = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    u = np.cross(axis, normals)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(normals, u)
    xy = np.stack([np.einsum("ij,ij->i", shape, np.repeat(w, sizes, axis=0)) for w in (u, v)], axis=1)
    first = np.concatenate([[0], np.cumsum(sizes)])
    largest = int(sizes.max())
    before, after, stamp, concave = np.zeros((4, largest), dtype=np.int64)
    queue = np.zeros((3 * largest, 2), dtype=np.int64)
    triangles = np.zeros((len(shape) - 2 * len(sizes), 3), dtype=np.int64)
    forced = np.zeros(len(sizes), dtype=np.bool_)
    clip_polygons(xy, first, Corners(xy, before, after, stamp, concave, queue), triangles, forced)
    return triangles, forced
