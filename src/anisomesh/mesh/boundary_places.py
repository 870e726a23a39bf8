"""Where the boundary of a mesh is along the boundary of the surface that it approximates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from anisomesh.mesh.closed_polyline import misfit_of, placed_by_length, placed_on
from anisomesh.mesh.geometry import unit
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import boundary_loops, half_edges

_SPACING = 0.25  # mean edge lengths between samples of the reference; heuristic
_MAX_SAMPLES = 64  # of one side
_MAX_MISFIT = 0.5  # mean sides from a point to its place, up to which the order of places is trusted; heuristic
_MAX_TABLE = 4_000_000  # pairs of sides and samples, up to which the best order is looked for
_MAX_LOOPS = 1_000  # up to which each is compared with all near ones
_FAR = 16.0  # squared distance of loops, in edges, that counts as it is: directions differ by 8 at most
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
    all distances least. Its points lie between the places of the sides at them. Where these are not in order, as where
    a loop passes several times through one place, the order along the reference is found that is nearest in all, by
    dynamic programming; where that does not go around either, as for small loops with faulty faces, they are placed by
    the length of the loop.
    """
    found = [loop.astype(np.int64) for loop in boundary_loops(mesh.faces)]
    if len(found) != len(loops):
        return None
    if not found:
        return []
    sides, wanted = _Sides.of(mesh, found), _Sides.of(reference, loops)
    samples = _Samples.of(wanted, float(sides.lengths.mean()))
    numbers = samples.loops_of(sides)
    if numbers is None:
        return None
    placed = {}
    for k, number in enumerate(numbers.tolist()):
        own, target = sides.of_loop(k), wanted.of_loop(number)
        result = placed_on(own.start, samples.of_loop(number).nearest(own)[1], target.corners)
        misfit = np.inf if result is None else misfit_of(result, own.start, target.corners)
        if misfit > _MAX_MISFIT * own.lengths.mean():
            finer = _Samples.of(target, float(target.lengths.sum()) / len(own.start))
            if len(own.start) * len(finer.place) <= _MAX_TABLE:
                other = placed_on(own.start, finer.in_order(own), target.corners, forward=True)
                if other is not None and misfit_of(other, own.start, target.corners) < misfit:
                    result = other
        result = result or placed_by_length(own.start, target.corners, samples.scale)
        if result is None:
            return None
        placed[number] = LoopPlaces(np.roll(found[k], -result[0]), result[1])
    return [placed[number] for number in range(len(loops))]


@dataclass(frozen=True, eq=False)
class _Sides:
    """The sides of boundary loops, one loop after the other.

    Start and end of each (n, 3), the direction from it into its face and the normal of that (n, 6), and the bounds of
    the loops (m + 1,).
    """

    start: Floats
    end: Floats
    directions: Floats
    bounds: Ints

    @classmethod
    def of(cls, surface: Surface, loops: list[Ints]) -> _Sides:
        """Return the sides of loops of a surface."""
        sides = half_edges(surface.faces).astype(np.int64)
        keys = sides[:, 0] << 32 | sides[:, 1]
        order = np.argsort(keys)
        first, after = np.concatenate(loops), np.concatenate([np.roll(loop, -1) for loop in loops])
        face = order[np.searchsorted(keys[order], first << 32 | after)] // 3
        start, end, normal = surface.points[first], surface.points[after], surface.face_normals[face]
        directions = np.concatenate([np.cross(normal, unit(end - start)), normal], axis=1)
        return cls(start, end, directions, np.cumsum([0, *(len(loop) for loop in loops)]))

    @cached_property
    def lengths(self) -> Floats:
        return np.asarray(np.linalg.norm(self.end - self.start, axis=1))

    @property
    def corners(self) -> Floats:
        """The points (n + 1, 3) of a single loop, the first one again at the end."""
        return np.concatenate([self.start, self.start[:1]])

    def of_loop(self, k: int) -> _Sides:
        """Return the sides of one loop."""
        part = slice(self.bounds[k], self.bounds[k + 1])
        return _Sides(
            self.start[part], self.end[part], self.directions[part], np.array([0, self.bounds[k + 1] - self.bounds[k]])
        )

    def boxes(self) -> Floats:
        """Return the lowest and highest coordinates (2, m, 3) of each loop."""
        first = self.bounds[:-1]
        return np.stack([np.minimum.reduceat(self.start, first), np.maximum.reduceat(self.start, first)])


@dataclass(frozen=True, eq=False)
class _Samples:
    """Samples of the sides of loops: nine coordinates, the loop of each, ascending, and its arc length on that."""

    coordinates: Floats
    loop: Ints
    place: Floats
    scale: float
    boxes: Floats

    @classmethod
    def of(cls, sides: _Sides, scale: float) -> _Samples:
        """Return samples about a quarter of ``scale`` apart."""
        length = sides.lengths
        count = np.clip(np.ceil(length / (_SPACING * scale)), 1, _MAX_SAMPLES).astype(np.int64)
        side = np.repeat(np.arange(len(length)), count)
        share = (np.arange(len(side)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[side]
        at = sides.start[side] + share[:, None] * (sides.end - sides.start)[side]
        loop = np.repeat(np.arange(len(sides.bounds) - 1), np.diff(sides.bounds))
        before = np.concatenate([[0.0], np.cumsum(length)])
        place = (before[:-1] - before[sides.bounds[loop]])[side] + share * length[side]
        coordinates = np.concatenate([at / scale, sides.directions[side]], axis=1)
        return cls(coordinates, loop[side], place, scale, sides.boxes())

    @cached_property
    def tree(self) -> cKDTree:
        return cKDTree(self.coordinates)

    def loops_of(self, sides: _Sides) -> Ints | None:
        """Return the loop (m,) that each of as many loops of a mesh follows, None if they cannot be told apart."""
        nearest = np.split(self.nearest(sides)[0], sides.bounds[1:-1])
        numbers = np.array([np.bincount(each).argmax() for each in nearest])
        if len(np.unique(numbers)) == len(numbers):
            return numbers
        if len(numbers) > _MAX_LOOPS:
            return None
        (low, high), (own_low, own_high) = self.boxes, sides.boxes()
        gaps = np.maximum(np.maximum(low[None] - own_high[:, None], own_low[:, None] - high[None]), 0.0)
        costs = ((gaps / self.scale) ** 2).sum(axis=2)
        loops = [sides.of_loop(j) for j in range(len(numbers))]
        for k in np.flatnonzero((costs < _FAR).any(axis=0)).tolist():
            tree = self.of_loop(k).tree
            for j in np.flatnonzero(costs[:, k] < _FAR).tolist():
                costs[j, k] = (tree.query(self._queries(loops[j]))[0] ** 2).mean()
        from scipy.optimize import linear_sum_assignment  # rarely needed, and a tenth of the time of importing all

        return np.asarray(linear_sum_assignment(costs)[1])

    def of_loop(self, number: int) -> _Samples:
        """Return the samples of one loop."""
        part = slice(*np.searchsorted(self.loop, [number, number + 1]))
        box = self.boxes[:, number : number + 1]
        return _Samples(self.coordinates[part], self.loop[part], self.place[part], self.scale, box)

    def nearest(self, sides: _Sides) -> tuple[Ints, Floats]:
        """Return the loop (n,) and the arc length on it (n,) nearest to sides (n,)."""
        nearest = self.tree.query(self._queries(sides))[1]
        return self.loop[nearest], self.place[nearest]

    def _queries(self, sides: _Sides) -> Floats:
        return np.concatenate([0.5 * (sides.start + sides.end) / self.scale, sides.directions], axis=1)

    def in_order(self, sides: _Sides) -> Floats:
        """Return the arc lengths (n,) on one loop of sides (n,) around it, in their order and near in all."""
        table = cdist(self._queries(sides), self.coordinates, "sqeuclidean")
        clearest = int(np.argmin(table.min(axis=1)))
        table = np.roll(table, -clearest, axis=0)
        best, chosen = np.inf, [0] * len(table)
        starts = min(_STARTS, max(_MAX_TABLE // table.size, 1))
        for start in np.argsort(table[0], kind="stable")[:starts].tolist():
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
