"""Polylines on the boundary of a mesh that are given the same vertices, so that they can be joined."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points

_SAME_VERTEX_REACH = 0.7  # distances to the next vertices, up to which two vertices become one; heuristic
_LEAST_GAP = 0.01  # of the mean distance of vertices on a curve, below which they are spaced evenly; heuristic

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Chain:
    """A part of the boundary of a mesh along a curve.

    Attributes
    ----------
    points
        Points of the mesh (n,) in the order of the curve, with both ends.
    places
        Arc length on the curve of each (n,), ascending.
    """

    points: Ints
    places: Floats


@dataclass(frozen=True, eq=False)
class Bundle:
    """The chains of a mesh that follow the same curve from end to end.

    Attributes
    ----------
    curve
        The curve (m, 3), from the common place of the first points to the one of the last points.
    chains
        The chains.
    least
        Number of vertices that the curve has at least between its ends.
    """

    curve: Floats
    chains: Sequence[Chain]
    least: int = 0


@dataclass(frozen=True, eq=False)
class ConformedMesh:
    """A mesh whose chains have the same vertices.

    Attributes
    ----------
    points, faces
        The mesh; the points before come first, in their order.
    chains
        For each bundle the points of its chains (k, n): column by column they are at the same place.
    """

    points: Points
    faces: Faces
    chains: tuple[Ints, ...]


def conform(points: Points, faces: Faces, bundles: Sequence[Bundle]) -> ConformedMesh:
    """Give the chains of each bundle the same vertices at the same places.

    Parameters
    ----------
    points, faces
        An oriented manifold mesh (V, 3), (F, 3).
    bundles
        Its chains. Points that are ends of several chains at one place have to be there already.

    Notes
    -----
    The vertices of the chain that has most are kept where they are. Vertices of the others go to the ones of these that
    are nearest, without a change of order, and are added where none is near; then the sides of chains are split at
    vertices that they have none for. So a curve gets about as many vertices as the sheet that needs most has there, and
    the only changes of the mesh are moves along the boundary, by less than an edge, and splits of its sides.
    """
    points = np.array(points)
    plans = [_common_vertices(points, bundle) for bundle in bundles]
    splits: list[tuple[int, int, Ints]] = []
    added, chains = [], []
    n_points = len(points)
    for bundle, vertices in zip(bundles, plans, strict=True):
        places = np.array([vertex.point for vertex in vertices]).reshape(-1, 3)
        table = np.full((len(bundle.chains), len(vertices) + 2), -1, dtype=np.int64)
        for row, chain in enumerate(bundle.chains):
            own = np.array([vertex.of_chain.get(row, -1) for vertex in vertices], dtype=np.int64)
            missing = np.flatnonzero(own < 0)
            points[own[own >= 0]] = places[own >= 0]
            own[missing] = n_points + np.arange(len(missing))
            n_points += len(missing)
            added.append(places[missing])
            table[row] = np.concatenate([chain.points[:1], own, chain.points[-1:]])
            splits += _splits(table[row], len(points))
        chains.append(table)
    everything = np.concatenate([points, *added])
    return ConformedMesh(everything, with_split_sides(faces, splits), tuple(chains))


def with_split_sides(faces: Faces, splits: list[tuple[int, int, Ints]]) -> Faces:
    """Return faces (F', 3) with sides on the boundary split at new points.

    Parameters
    ----------
    faces
        Faces (F, 3), which keep their numbers.
    splits
        Sides, each as its two ends and the new points (n,) between them in this order.
    """
    faces = faces.astype(np.int64)
    waiting = splits
    while waiting:
        sides = {}
        for face, corners in enumerate(faces.tolist()):
            for c in range(3):
                a, b = corners[c], corners[(c + 1) % 3]
                sides[min(a, b), max(a, b)] = (face, c)
        new_faces, later, taken = [], [], set()
        for a, b, between in waiting:
            face, c = sides[min(a, b), max(a, b)]
            if face in taken:
                later.append((a, b, between))
                continue
            taken.add(face)
            middle = len(between) // 2
            first, second, apex = faces[face][[c, (c + 1) % 3, (c + 2) % 3]]
            faces[face] = first, between[middle], apex
            new_faces.append([between[middle], second, apex])
            later += [(a, int(between[middle]), between[:middle]), (int(between[middle]), b, between[middle + 1 :])]
        waiting = [each for each in later if len(each[2])]
        faces = np.concatenate([faces, np.array(new_faces, dtype=np.int64)])
    return faces.astype(np.int32)


@dataclass(eq=False)
class _Vertex:
    """A vertex that all chains of a bundle get, and the points of those that have one for it already."""

    place: float
    point: Floats
    of_chain: dict[int, int] = field(default_factory=dict)


def _common_vertices(points: Points, bundle: Bundle) -> list[_Vertex]:
    """Return the vertices of a bundle between its ends, in order."""
    start = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(bundle.curve, axis=0), axis=1))])
    order = sorted(range(len(bundle.chains)), key=lambda row: -len(bundle.chains[row].points))
    vertices: list[_Vertex] = []
    for row in order:
        chain = bundle.chains[row]
        inner, places = chain.points[1:-1], chain.places[1:-1]
        found = _matched(np.array([each.place for each in vertices]), places, float(start[-1])) if vertices else {}
        for k, j in found.items():
            vertices[j].of_chain[row] = int(inner[k])
        _insert_others(vertices, row, chain, points, float(start[-1]))
    while len(vertices) < bundle.least:
        ends = np.array([0.0, *(vertex.place for vertex in vertices), float(start[-1])])
        widest = int(np.argmax(np.diff(ends)))
        middle = 0.5 * float(ends[widest] + ends[widest + 1])
        vertices.insert(widest, _Vertex(middle, _at(middle, start, bundle.curve)))
    return _told_apart(vertices, start, bundle.curve)


def _at(place: float, start: Floats, curve: Floats) -> Floats:
    """Return the point (3,) at an arc length of a curve (m, 3), of which the arc length at each point is given."""
    return np.array([np.interp(place, start, axis) for axis in curve.T])


def _told_apart(vertices: list[_Vertex], start: Floats, curve: Floats) -> list[_Vertex]:
    """Return vertices in order on a curve, evenly spaced if some are at one place."""
    ends = curve[:1], [vertex.point for vertex in vertices], curve[-1:]
    gaps = np.linalg.norm(np.diff(np.concatenate([each for each in ends if len(each)]), axis=0), axis=1)
    if len(vertices) == 0 or gaps.min() > _LEAST_GAP * start[-1] / len(gaps):
        return vertices
    for vertex, place in zip(vertices, np.linspace(0.0, start[-1], len(vertices) + 2)[1:-1].tolist(), strict=True):
        vertex.place, vertex.point = place, _at(place, start, curve)
    return vertices


def _matched(wanted: Floats, places: Floats, length: float) -> dict[int, int]:
    """Return for places (n,) the vertices near them, as {place: vertex}: nearest first, in order, each at most once."""
    ends = np.concatenate([[0.0], wanted, [length]])
    gap = np.minimum(wanted - ends[:-2], ends[2:] - wanted)
    chosen: list[tuple[int, int]] = []
    low = np.searchsorted(wanted, places)
    pairs = [(k, j) for k in range(len(places)) for j in range(max(low[k] - 2, 0), min(low[k] + 2, len(wanted)))]
    for k, j in sorted(pairs, key=lambda pair: abs(float(places[pair[0]] - wanted[pair[1]]))):
        if abs(places[k] - wanted[j]) > _SAME_VERTEX_REACH * gap[j]:
            continue
        at = bisect_left(chosen, (k, j))
        after_before = at == 0 or (chosen[at - 1][0] < k and chosen[at - 1][1] < j)
        before_after = at == len(chosen) or (k < chosen[at][0] and j < chosen[at][1])
        if after_before and before_after:
            chosen.insert(at, (k, j))
    return dict(chosen)


def _insert_others(vertices: list[_Vertex], row: int, chain: Chain, points: Points, length: float) -> None:
    """Insert the points of a chain that no vertex is matched with, in the order of the chain."""
    inner, places = chain.points[1:-1], chain.places[1:-1]
    ends = points[chain.points[[0, -1]]]
    at = 0  # where the next vertex of the chain may be at first
    position = {each.of_chain[row]: each for each in vertices if row in each.of_chain}
    for k, point in enumerate(inner.tolist()):
        if point in position:
            at = vertices.index(position[point]) + 1
            continue
        last = next((j for j in range(at, len(vertices)) if row in vertices[j].of_chain), len(vertices))
        before = min(max(bisect_left([each.place for each in vertices], float(places[k])), at), last)
        low = vertices[before - 1].place if before > 0 else 0.0
        high = vertices[before].place if before < len(vertices) else length
        place, at_point = float(places[k]), points[point].copy()
        if not low < place < high:
            place, at_point = 0.5 * (low + high), _between(vertices, before, ends)
        vertices.insert(before, _Vertex(place, at_point, {row: point}))
        at = before + 1


def _between(vertices: list[_Vertex], k: int, ends: Floats) -> Floats:
    """Return the middle (3,) between two vertices of a bundle with these ends (2, 3), of which the second is k."""
    before = vertices[k - 1].point if k > 0 else ends[0]
    after = vertices[k].point if k < len(vertices) else ends[1]
    return np.asarray(0.5 * (before + after))


def _splits(chain: Ints, n_before: int) -> list[tuple[int, int, Ints]]:
    """Return the sides of a chain with new points between their ends: both ends, and the new points (n,)."""
    old = np.flatnonzero(chain < n_before)
    pairs = zip(old[:-1].tolist(), old[1:].tolist(), strict=True)
    return [(int(chain[a]), int(chain[b]), chain[a + 1 : b]) for a, b in pairs if b > a + 1]
