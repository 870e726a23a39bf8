"""The chains of a mesh of sheets that follow the junctions of the surface."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh.conforming.chains import Bundle, Chain, with_split_sides
from anisomesh.junctions.cut import Junctions
from anisomesh.junctions.graph import Loop
from anisomesh.mesh.boundary_places import LoopPlaces, boundary_places
from anisomesh.mesh.surface import Surface

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Bundled:
    """A mesh with a vertex at every node of the junctions, and its chains along their curves.

    Attributes
    ----------
    points, faces
        The mesh; the points before come first, in their order.
    bundles
        The chains of each curve.
    """

    points: Points
    faces: Faces
    bundles: list[Bundle]


def bundled(mesh: Surface, junctions: Junctions, reference: Surface, *, exact: bool) -> Bundled | None:
    """Return a mesh with a vertex at every node and its chains, None if its boundary is not the one of the sheets.

    Parameters
    ----------
    mesh
        A mesh of the sheets.
    junctions
        The junctions.
    reference
        The sheets, in the units of the mesh.
    exact
        Whether the mesh approximates these sheets, so that nodes go to where they are there, and not a smoothed copy.
    """
    graph = junctions.graph
    placed = boundary_places(mesh, reference, [loop.points for loop in graph.loops])
    if placed is None:
        return None
    chained = _Chained(mesh, reference, junctions)
    for loop, places in zip(graph.loops, placed, strict=True):
        if loop.arcs:
            chained.add(loop, places)
    if [len(chains) for chains in chained.chains] != list(graph.copies):
        return None
    joined_place = np.zeros((int(junctions.joined.max()) + 1, 3))
    joined_place[junctions.joined] = reference.points
    points = chained.points_with_nodes(joined_place, exact=exact)
    between = Counter(tuple(sorted((int(curve[0]), int(curve[-1])))) for curve in graph.curves)
    bundles = []
    for curve, chains in zip(graph.curves, chained.chains, strict=True):
        ends = int(curve[0]), int(curve[-1])
        least = 2 if ends[0] == ends[1] else int(between[min(ends), max(ends)] > 1 and len(curve) > 2)
        bundles.append(Bundle(joined_place[curve], chains, least))
    return Bundled(points, with_split_sides(mesh.faces, chained.splits), bundles)


class _Chained:
    """The chains found so far, points added at nodes, and the points at each node."""

    def __init__(self, mesh: Surface, reference: Surface, junctions: Junctions) -> None:
        self.mesh, self.reference, self.junctions = mesh, reference, junctions
        self.chains: list[list[Chain]] = [[] for _ in junctions.graph.curves]
        self.splits: list[tuple[int, int, Ints]] = []
        self.at_node: list[tuple[int, int]] = []  # point of the mesh, joined point
        self.n_points = mesh.n_points

    def add(self, loop: Loop, placed: LoopPlaces) -> None:
        """Add the chains of a loop with arcs."""
        corners = self.reference.points[np.append(loop.points, loop.points[0])]
        start = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
        wanted = start[[arc.first for arc in loop.arcs]]
        points, places, at = self._with_nodes(placed, wanted, float(start[-1]))
        for arc, first, last in zip(loop.arcs, at, np.append(at[1:], len(points) - 1), strict=True):
            self.at_node.append((int(points[first]), int(self.junctions.joined[loop.points[arc.first]])))
            if arc.curve < 0:
                continue
            length = float(start[arc.last] - start[arc.first])
            own, along = points[first : last + 1], np.clip(places[first : last + 1] - start[arc.first], 0.0, length)
            chain = Chain(own[::-1], length - along[::-1]) if arc.backward else Chain(own, along)
            self.chains[arc.curve].append(chain)

    def points_with_nodes(self, joined_place: Points, *, exact: bool) -> Points:
        """Return the points of the mesh, the ones at nodes moved there."""
        points = np.concatenate([self.mesh.points, np.zeros((self.n_points - self.mesh.n_points, 3))])
        point, node = np.array(self.at_node, dtype=np.int64).T
        goal = joined_place[node]
        old = point < self.mesh.n_points
        if not exact:  # where the points are in the mean
            count = np.bincount(node[old], minlength=len(joined_place))
            mean = np.zeros_like(joined_place)
            np.add.at(mean, node[old], points[point[old]])
            there = count[node] > 0
            goal[there] = (mean[node] / np.maximum(count[node], 1)[:, None])[there]
        points[point] = goal
        return points

    def _with_nodes(self, placed: LoopPlaces, wanted: Floats, length: float) -> tuple[Ints, Floats, Ints]:
        """Return points and places of a loop, closed and from its first node on, and which of them are at its nodes.

        A node takes the nearest point; if another node is nearer to that, it gets a new point.
        """
        points, places = placed.points, placed.places
        after = np.searchsorted(places, wanted, side="right")
        before, after = (after - 1) % len(points), after % len(points)
        behind, ahead = np.mod(wanted - places[before], length), np.mod(places[after] - wanted, length)
        nearest, distance = np.where(behind <= ahead, before, after), np.minimum(behind, ahead)
        taken: dict[int, int] = {}
        for node in np.argsort(distance, kind="stable").tolist():
            taken.setdefault(int(nearest[node]), node)
        places = places.copy()
        owner = np.full(len(points), -1, dtype=np.int64)
        for k, node in taken.items():
            places[k], owner[k] = wanted[node], node
        new = np.setdiff1d(np.arange(len(wanted)), owner)
        numbers = self.n_points + np.arange(len(new))
        self.n_points += len(new)
        points, places = np.concatenate([points, numbers]), np.concatenate([places, wanted[new]])
        owner = np.concatenate([owner, new])
        order = np.argsort(places, kind="stable")
        order = np.roll(order, -int(np.flatnonzero(owner[order] == 0)[0]))
        points, places, owner = points[order], places[order], owner[order]
        points, places = np.append(points, points[0]), np.append(places, length)
        self.splits += _sides_with_new(points, self.mesh.n_points)
        at = np.argsort(np.where(owner >= 0, owner, len(points)), kind="stable")[: len(wanted)]
        return points, places, at


def _sides_with_new(points: Ints, n_before: int) -> list[tuple[int, int, Ints]]:
    """Return the sides of a closed loop (n + 1,) that get new points: both ends, and the new points."""
    old = np.flatnonzero(points < n_before)
    points = np.concatenate([points[old[0] : -1], points[: old[0] + 1]])
    old = np.flatnonzero(points < n_before)
    pairs = zip(old[:-1].tolist(), old[1:].tolist(), strict=True)
    return [(int(points[a]), int(points[b]), points[a + 1 : b]) for a, b in pairs if b > a + 1]
