"""Where the boundary of a mesh is along the boundary of the surface that it approximates."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from anisomesh.mesh.geometry import unit
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import boundary_loops, half_edges

_SPACING = 0.25  # mean edge lengths between samples of the reference; heuristic
_MAX_SAMPLES = 64  # of one side
_MAX_TABLE = 4_000_000  # pairs of sides and samples, up to which the best order is looked for
_MAX_LOOPS = 300  # up to which each is compared with each
_STARTS = 32  # samples tried for the first side then

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LoopPlaces:
    """A boundary loop of a mesh along a boundary loop of its reference.

    Attributes
    ----------
    points
        Points of the mesh (n,) in order, the surface on the left.
    places
        Arc length (n,) of each on the loop of the reference, ascending, from 0 at its first point up to its length.
    """

    points: Ints
    places: Floats


def boundary_places(mesh: Surface, reference: Surface, loops: list[Ints]) -> list[LoopPlaces] | None:
    """Return for each boundary loop of a reference the loop of a mesh that follows it, None if they do not correspond.

    Parameters
    ----------
    mesh
        An oriented manifold mesh of the same topology.
    reference
        The surface.
    loops
        All boundary loops of the surface, as points (n,) in order, the surface on the left.

    Notes
    -----
    Loops of several sheets can be at the same place. So a side is compared by its place, its normal and the direction
    from it into its face: the nearest side of the reference is found among samples in nine dimensions. A loop belongs
    to the one that most of its sides are at, or, if two would belong to the same one, to the one that makes the sum of
    all distances least. Its points lie between the places of the sides at them. Where these are not in order, the
    order along the reference is found that is nearest in all, by dynamic programming.
    """
    found = [loop.astype(np.int64) for loop in boundary_loops(mesh.faces)]
    if len(found) != len(loops):
        return None
    lengths = np.concatenate([_side_lengths(mesh, loop) for loop in found])
    samples = _Samples.of(reference, loops, float(lengths.mean()))
    numbers = samples.loops_of(mesh, found)
    if numbers is None:
        return None
    placed = {}
    for loop, number in zip(found, numbers.tolist(), strict=True):
        corners = reference.points[np.append(loops[number], loops[number][0])]
        order = _placed(mesh.points[loop], samples.of_loop(number).nearest(*_frames(mesh, loop))[1], corners)
        if order is None:
            scale = _side_lengths(reference, loops[number]).sum() / len(loop)
            own = _Samples.of(reference, [loops[number]], float(scale))
            if len(loop) * len(own.place) <= _MAX_TABLE:
                order = _placed(mesh.points[loop], own.in_order(*_frames(mesh, loop)), corners, forward=True)
        if order is None:
            return None
        placed[number] = LoopPlaces(np.roll(loop, -order[0]), order[1])
    return [placed[number] for number in range(len(loops))]


def _side_lengths(surface: Surface, loop: Ints) -> Floats:
    corners = surface.points[loop]
    return np.asarray(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1))


def _frames(surface: Surface, loop: Ints) -> tuple[Floats, Floats]:
    """Return the middles (n, 3) of the sides of a loop, and their inward directions and normals (n, 6)."""
    sides = half_edges(surface.faces).astype(np.int64)
    keys = sides[:, 0] << 32 | sides[:, 1]
    order = np.argsort(keys)
    after = np.roll(loop, -1)
    face = order[np.searchsorted(keys[order], loop << 32 | after)] // 3
    normal = surface.face_normals[face]
    inward = np.cross(normal, unit(surface.points[after] - surface.points[loop]))
    return 0.5 * (surface.points[loop] + surface.points[after]), np.concatenate([inward, normal], axis=1)


@dataclass(frozen=True, eq=False)
class _Samples:
    """Samples of boundary loops: nine coordinates, the loop of each, and its arc length on that."""

    coordinates: Floats
    loop: Ints
    place: Floats
    scale: float

    @classmethod
    def of(cls, reference: Surface, loops: list[Ints], scale: float) -> _Samples:
        """Return samples about a quarter of ``scale`` apart."""
        coordinates, numbers, places = [], [], []
        for number, loop in enumerate(loops):
            length, directions = _side_lengths(reference, loop), _frames(reference, loop)[1]
            count = np.clip(np.ceil(length / (_SPACING * scale)), 1, _MAX_SAMPLES).astype(np.int64)
            side = np.repeat(np.arange(len(loop)), count)
            share = (np.arange(len(side)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[side]
            start, end = reference.points[loop][side], reference.points[np.roll(loop, -1)][side]
            at = start + share[:, None] * (end - start)
            coordinates.append(np.concatenate([at / scale, directions[side]], axis=1))
            numbers.append(np.full(len(side), number))
            places.append((np.cumsum(length) - length)[side] + share * length[side])
        return cls(np.concatenate(coordinates), np.concatenate(numbers), np.concatenate(places), scale)

    def loops_of(self, mesh: Surface, found: list[Ints]) -> Ints | None:
        """Return the loop (n,) that each of as many loops of a mesh follows, None if they cannot be told apart."""
        numbers = np.array([np.bincount(self.nearest(*_frames(mesh, loop))[0]).argmax() for loop in found])
        if len(np.unique(numbers)) == len(found):
            return numbers
        if len(found) > _MAX_LOOPS:
            return None
        costs = np.empty((len(found), len(found)))
        for k in range(len(found)):
            tree = cKDTree(self.of_loop(k).coordinates)
            for j, loop in enumerate(found):
                costs[j, k] = (tree.query(self._queries(*_frames(mesh, loop)))[0] ** 2).mean()
        return np.asarray(linear_sum_assignment(costs)[1])

    def of_loop(self, number: int) -> _Samples:
        """Return the samples of one loop."""
        mine = self.loop == number
        return _Samples(self.coordinates[mine], self.loop[mine], self.place[mine], self.scale)

    def nearest(self, points: Floats, directions: Floats) -> tuple[Ints, Floats]:
        """Return the loop (n,) and the arc length on it (n,) nearest to points (n, 3) with directions (n, 6)."""
        nearest = cKDTree(self.coordinates).query(self._queries(points, directions))[1]
        return self.loop[nearest], self.place[nearest]

    def _queries(self, points: Floats, directions: Floats) -> Floats:
        return np.concatenate([points / self.scale, directions], axis=1)

    def in_order(self, points: Floats, directions: Floats) -> Floats:
        """Return the arc lengths (n,) on one loop of places (n, 3) around it, in their order and near in all."""
        table = cdist(self._queries(points, directions), self.coordinates, "sqeuclidean")
        clearest = int(np.argmin(table.min(axis=1)))
        table = np.roll(table, -clearest, axis=0)
        best, chosen = np.inf, [0] * len(table)
        for start in np.argsort(table[0], kind="stable")[:_STARTS].tolist():
            costs = np.roll(table, -start, axis=1)
            total, way = costs[0, :1].repeat(costs.shape[1]), []
            for row in costs[1:]:
                way.append(_argmin_so_far(total))
                total = total[way[-1]] + row
            if total.min() < best:
                best, chosen = float(total.min()), [int(np.argmin(total))]
                for before in way[::-1]:
                    chosen.append(int(before[chosen[-1]]))
                chosen = [(start + k) % len(total) for k in chosen[::-1]]
        return np.asarray(np.roll(self.place[chosen], clearest))


def _argmin_so_far(values: Floats) -> Ints:
    """Return for each of some values (n,) where the lowest one up to it is."""
    lowest = np.minimum.accumulate(values)
    return np.asarray(np.maximum.accumulate(np.where(values == lowest, np.arange(len(values)), 0)))


def _placed(points: Floats, sides: Floats, corners: Floats, *, forward: bool = False) -> tuple[int, Floats] | None:
    """Return the arc lengths (n,) of the points of a loop on a closed polyline (m + 1, 3), ascending.

    ``sides`` are the arc lengths (n,) of the sides that follow each point. They begin at the first of the points behind
    the start of the polyline, of which the number is returned too. None if the loop does not go around once; with
    ``forward`` no side is behind the one before it, however far that is.
    """
    start = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    total = float(start[-1])
    shift = 0.0 if forward else 0.5 * total
    steps = np.mod(sides - np.roll(sides, 1) + shift, total) - shift
    if len(points) < 3 or abs(steps.sum() - total) > 0.5 * total:
        return None
    before = sides[-1] + np.cumsum(steps) - steps
    placed = np.empty(len(points))
    for k, (point, low, step) in enumerate(zip(points, before.tolist(), steps.tolist(), strict=True)):
        placed[k] = _closest(point, low + min(step, 0.0), abs(step), start, corners)
    placed = np.minimum(np.maximum.accumulate(placed), placed[0] + total)
    turn = np.floor(placed / total)
    first = int(np.argmax(turn > turn[0])) if turn[-1] > turn[0] else 0
    return first, np.roll(placed - turn * total, -first)


def _closest(point: Floats, first: float, length: float, start: Floats, corners: Floats) -> float:
    """Return the arc length on a closed polyline closest to a point (3,), in an interval that starts at ``first``."""
    total = float(start[-1])
    turns = np.floor(first / total) * total
    first -= turns
    inner = np.concatenate([start, start[1:] + total])
    cuts = np.concatenate([[first], inner[(inner > first) & (inner < first + length)], [first + length]])
    best, nearest = np.inf, first
    for low, high in pairwise(cuts.tolist()):
        a, b = _at(low, start, corners), _at(high, start, corners)
        way = b - a
        square = float(way @ way)
        share = min(max(float((point - a) @ way) / square, 0.0), 1.0) if square > 0.0 else 0.0
        distance = float(np.linalg.norm(a + share * way - point))
        if distance < best:
            best, nearest = distance, low + share * (high - low)
    return float(nearest + turns)


def _at(place: float, start: Floats, corners: Floats) -> Floats:
    """Return the point (3,) of a closed polyline at an arc length."""
    place = place % float(start[-1])
    k = min(int(np.searchsorted(start, place, side="right")) - 1, len(start) - 2)
    length = max(float(start[k + 1] - start[k]), np.finfo(np.float64).tiny)
    return np.asarray(corners[k] + (place - start[k]) / length * (corners[k + 1] - corners[k]))
