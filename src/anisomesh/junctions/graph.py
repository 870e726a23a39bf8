"""The junctions of a cut surface as curves between nodes, and the parts of boundary loops that follow them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import PointLabels, PointMask
from anisomesh.features.boundary import CORNER_TURN
from anisomesh.mesh.geometry import unit
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import boundary_loops, edge_keys

Ints = npt.NDArray[np.int64]

FREE = -1


@dataclass(frozen=True, kw_only=True, eq=False)
class Arc:
    """A part of a boundary loop from one node to the next.

    Attributes
    ----------
    first, last
        Where it begins and ends in the loop; the end of the last arc is the length of the loop.
    curve
        The curve that it follows, or ``FREE``.
    backward
        Whether it runs from the end of the curve to its start.
    """

    first: int
    last: int
    curve: int
    backward: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class Loop:
    """A boundary loop of the sheets.

    Attributes
    ----------
    points
        Its points (n,) in order, the surface on the left; the first one is a node if there is any.
    arcs
        Its parts from node to node; none if it has no node.
    """

    points: Ints
    arcs: tuple[Arc, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class JunctionGraph:
    """Curves between nodes, at which sheets are joined.

    Attributes
    ----------
    curves
        For each curve its joined points (n,) from one node to another.
    copies
        For each curve how often boundary loops follow it: the number of faces at each of its edges.
    nodes
        Which points of the sheets (V,) are nodes: where curves end, meet or turn, and one of each closed curve.
    loops
        All boundary loops of the sheets.
    """

    curves: tuple[Ints, ...]
    copies: tuple[int, ...]
    nodes: PointMask
    loops: tuple[Loop, ...]


def graph_of(
    sheets: Surface, joined: PointLabels, keys: Ints, nodes: PointMask, *, turns_are_corners: bool
) -> JunctionGraph:
    """Return the junction graph of sheets.

    Parameters
    ----------
    sheets
        The sheets.
    joined
        The number of each of their points (V,) when they are joined.
    keys
        Keys (n,) of the junction edges between joined points, ascending.
    nodes
        Joined points that are nodes if curves go through them.
    turns_are_corners
        Whether a curve ends where it turns by 45 degrees or more.
    """
    loops = [loop.astype(np.int64) for loop in boundary_loops(sheets.faces)]
    is_node = _ends_and_meetings(sheets, joined, keys, loops, turns_are_corners=turns_are_corners)
    on_curves = np.unique(np.stack([keys >> 32, keys & 0xFFFFFFFF]))
    is_node[on_curves] |= nodes[on_curves]
    curves = _curves(keys, is_node)
    place = {int(key): (number, k) for number, curve in enumerate(curves) for k, key in enumerate(_keys_along(curve))}
    found = tuple(_loop(points, joined, is_node, place, curves) for points in loops)
    copies = np.bincount([arc.curve for loop in found for arc in loop.arcs if arc.curve >= 0], minlength=len(curves))
    return JunctionGraph(
        curves=tuple(curves), copies=tuple(copies.tolist()), nodes=np.asarray(is_node[joined]), loops=found
    )


def _keys_along(points: Ints) -> Ints:
    return edge_keys(np.stack([points[:-1], points[1:]], axis=1))


def _ends_and_meetings(
    sheets: Surface, joined: PointLabels, keys: Ints, loops: list[Ints], *, turns_are_corners: bool
) -> PointMask:
    """Return which joined points curves end at, because they end, meet, turn, or leave the boundary of a sheet."""
    count = int(joined.max()) + 1
    ends = np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1)
    degree = np.bincount(ends.ravel(), minlength=count)
    is_node = (degree > 0) & (degree != 2)
    if turns_are_corners:
        where = np.zeros((count, 3))
        where[joined] = sheets.points
        along, outward = unit(where[ends[:, 1]] - where[ends[:, 0]]), np.zeros((count, 3))
        np.add.at(outward, ends[:, 0], along)
        np.add.at(outward, ends[:, 1], -along)
        is_node |= (degree == 2) & (np.linalg.norm(outward, axis=1) >= 2.0 * np.sin(np.radians(CORNER_TURN) / 2.0))
    for points in loops:
        own = joined[points].astype(np.int64)
        after = edge_keys(np.stack([own, np.roll(own, -1)], axis=1))
        before, on = np.roll(after, 1), np.isin(after, keys)
        is_node[own[(on != np.roll(on, 1)) | (on & (before == after))]] = True
    return np.asarray(is_node)


def _curves(keys: Ints, is_node: PointMask) -> list[Ints]:
    """Return curves of joined points from node to node; a closed one gets its lowest point as a node."""
    beside: dict[int, list[int]] = {}
    for a, b in zip((keys >> 32).tolist(), (keys & 0xFFFFFFFF).tolist(), strict=True):
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    used: set[tuple[int, int]] = set()
    curves = []
    starts = [point for point in beside if is_node[point]] + [point for point in beside if not is_node[point]]
    for start in starts:
        for following in beside[start]:
            if (start, following) in used:
                continue
            is_node[start] = True
            curve = [start, following]
            while not is_node[curve[-1]]:
                first, second = beside[curve[-1]]
                curve.append(second if first == curve[-2] else first)
            used.update(pairwise(curve))
            used.update(pairwise(curve[::-1]))
            curves.append(np.array(curve, dtype=np.int64))
    return curves


def _loop(
    points: Ints, joined: PointLabels, is_node: PointMask, place: dict[int, tuple[int, int]], curves: list[Ints]
) -> Loop:
    """Return a boundary loop with its arcs."""
    at = np.flatnonzero(is_node[joined[points]])
    if len(at) == 0:
        return Loop(points=points, arcs=())
    points, bounds = np.roll(points, -at[0]), [*(at - at[0]).tolist(), len(points)]
    own = joined[np.append(points, points[0])].astype(np.int64)
    arcs = []
    for first, last in pairwise(bounds):
        curve, k = place.get(int(edge_keys(own[None, first : first + 2])[0]), (FREE, 0))
        backward = curve != FREE and int(curves[curve][k]) != int(own[first])
        arcs.append(Arc(first=first, last=last, curve=curve, backward=backward))
    return Loop(points=points, arcs=tuple(arcs))
