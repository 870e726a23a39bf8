"""Points of the input at which the result has vertices, found again on the prepared surface."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from anisomesh._arrays import EdgeEnds, PointMask
from anisomesh.attributes.model import Ints, Mesh
from anisomesh.errors import OptionError
from anisomesh.features.tagged import checked_pairs, search_radius
from anisomesh.mesh.surface import Surface
from anisomesh.options import RemeshOptions
from anisomesh.repair.prepare import Prepared

_FEW_ENDS = 64  # of lines that are fixed in any case; heuristic
_MAX_END_SHARE = 0.5  # of the points on lines, if there are more; heuristic


def with_fixed_points(mesh: Mesh, prepared: Prepared, options: RemeshOptions) -> tuple[Prepared, PointMask]:
    """Return the prepared surface with fixed points and points to keep exactly where they were, and which these are.

    Raises
    ------
    OptionError
        If ``keep_points`` are not points of the mesh, or have vanished in the repair.

    Notes
    -----
    Repair merges and copies points, so they are found again by their positions, all copies of each. Ends of prescribed
    lines are fixed like the fixed points of the mesh, and so are ends of their regions, such as physical curves, unless
    borders are not followed.
    """
    asked = checked_points("keep_points", options.keep_points, mesh.surface.n_points)
    more = checked_pairs(mesh.surface, [] if options.features is None else options.features)
    ends = line_ends(mesh.surface, np.concatenate([mesh.features, more]))
    if options.attributes and options.regions:
        ends = np.union1d(ends, curve_ends(mesh))
    wanted = np.concatenate([asked, mesh.fixed_points, ends])
    fixed = np.zeros(prepared.surface.n_points, dtype=bool)
    if len(wanted) == 0:
        return prepared, fixed
    places, points = mesh.surface.points[wanted], np.array(prepared.surface.points)
    radius = search_radius(mesh.surface, options.weld_tolerance)
    tree = cKDTree(points)
    distance, nearest = tree.query(places)
    lost = np.flatnonzero(distance[: len(asked)] > radius)
    if len(lost):
        raise OptionError(
            f"keep_points has {asked[lost[0]]}, which the repair of the mesh removes: no face with an area "
            "has it, or it was merged with points farther away; leave it out, or lower weld_tolerance"
        )
    owner = np.full(len(points), -1)
    copies = tree.query_ball_point(points[nearest], 0.0)
    for k in np.flatnonzero(distance <= radius).tolist():
        other = owner[nearest[k]]
        if other >= 0 and k < len(asked) and (places[k] != places[other]).any():
            raise OptionError(
                f"keep_points has {wanted[other]} and {wanted[k]}, which become one point with weld_tolerance = "
                f"{options.weld_tolerance}; keep one of them, or lower weld_tolerance"
            )
        if other < 0:
            owner[copies[k]] = k
    fixed = owner >= 0
    if (points[fixed] == places[owner[fixed]]).all():
        return prepared, fixed
    points[fixed] = places[owner[fixed]]
    return replace(prepared, surface=prepared.surface.with_points(points)), fixed


def line_ends(surface: Surface, edges: EdgeEnds) -> Ints:
    """Return the points (n,) of a surface at which one of some edges (m, 2) ends, and no other one."""
    points, place = _places(surface, edges)
    pairs = np.unique(np.sort(place.reshape(-1, 2), axis=1), axis=0)
    return _few(points, place, (np.bincount(pairs.ravel(), minlength=1) == 1)[place])


def curve_ends(mesh: Mesh) -> Ints:
    """Return the points (n,) at which a region of the features of a mesh ends or branches."""
    points, place = _places(mesh.surface, mesh.features)
    is_end = np.zeros(len(points), dtype=bool)
    for regions in mesh.feature_regions.values():
        label = np.repeat(regions.labels, 2)
        pairs, number, count = np.unique(
            np.stack([place, label], axis=1), axis=0, return_inverse=True, return_counts=True
        )
        is_end |= ((count != 2) & (pairs[:, 1] != 0))[number.reshape(-1)]
    return _few(points, place, is_end)


def _places(surface: Surface, edges: EdgeEnds) -> tuple[Ints, Ints]:
    """Return the point at each end of edges (2 m,), and the number of its place."""
    points = edges.ravel().astype(np.int64)
    return points, np.unique(surface.points[points], axis=0, return_inverse=True)[1].reshape(-1)


def _few(points: Ints, place: Ints, is_end: PointMask) -> Ints:
    """Return the points (n,) of ends, one at each place; none if most places are ends: these are edges and no lines."""
    ends, n_places = np.unique(place[is_end], return_index=True)[1], len(np.unique(place))
    if len(ends) > max(_FEW_ENDS, _MAX_END_SHARE * n_places):
        return points[:0]
    return np.asarray(points[is_end][ends], dtype=np.int64)


def checked_points(name: str, values: npt.ArrayLike | None, n_points: int) -> Ints:
    """Return points of a mesh, given as integers or a mask (V,), as integers (n,), each once, or raise OptionError."""
    if values is None:
        return np.zeros(0, dtype=np.int64)
    given: npt.NDArray[Any] = np.asarray(values)
    if given.dtype == bool:
        if given.shape != (n_points,):
            raise OptionError(
                f"{name} is a mask of shape {given.shape}; expected ({n_points},), a value for each point, or numbers "
                "of points"
            )
        return np.flatnonzero(given).astype(np.int64)
    if given.size == 0:
        return np.zeros(0, dtype=np.int64)
    if given.ndim != 1 or given.dtype.kind not in "iu":
        raise OptionError(
            f"{name} has shape {given.shape} and type {given.dtype}; expected (n,) whole numbers, a point each, or a "
            f"mask ({n_points},) of bools"
        )
    wrong = given[(given < 0) | (given >= n_points)]
    if len(wrong):
        raise OptionError(f"{name} has {wrong[0]}; expected 0 to {n_points - 1} since there are {n_points:,} points")
    return np.unique(given).astype(np.int64)
