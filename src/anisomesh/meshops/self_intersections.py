"""Taking triangles apart that intersect where the surface does not: flips, moves of points, splits of edges."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh.deadline import NO_DEADLINE, Deadline
from anisomesh.mesh import geometry
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.intersections import self_intersections
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import crossing_facets, new_intersections
from anisomesh.meshops.flip import possible_flips
from anisomesh.meshops.moves import faces_around

MAX_ROUNDS = 30
_MAX_SPLITS = 6  # rounds of splits that leave as many pairs
_ZONE = 100  # faces around a pair, about; a try takes time in proportion to them
_MAX_ZONE = 2_000  # faces around a pair; with more the mesh is crumpled there, and every try takes long
_MIN_THICKNESS = 1e-3  # area over squared longest side of a triangle that a change may leave
_LIFTS = (-0.15, -0.05, 0.05, 0.15)  # trial moves of a point along its normal, in lengths of the edges there

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _Change:
    """Faces that go (n,), faces in their place (m, 3), and where a point (V for a new one) is to be."""

    gone: Ints
    new: Ints
    point: int = -1
    place: Floats | None = None


@dataclass
class _Tries:
    """How many more pairs may be looked at, and the pieces of meshes on which nothing helped."""

    left: int
    deadline: Deadline
    failed: set[bytes] = field(default_factory=set)


def separate(
    points: Points, faces: Faces, reference: ClosestPoints, *, max_tries: int = 300, deadline: Deadline = NO_DEADLINE
) -> tuple[Points, Faces, int]:
    """Mend pairs of triangles that intersect, where the reference does not, without changing the topology.

    Parameters
    ----------
    points, faces
        An oriented manifold mesh (V, 3), (F, 3).
    reference
        The surface that it stands for.
    max_tries
        Pairs that are looked at, in all rounds together; one amid many faces counts for several.
    deadline
        Asked before every pair whether to end.

    Returns
    -------
    points, faces, left
        The mended mesh, in which points may have been added at the end, and the number of pairs left.

    Notes
    -----
    In each round every pair, unless one near by has been mended, gets the change that leaves fewest pairs in its
    neighbourhood, if they are fewer than before: the flip of an edge of the two triangles, the move of a corner onto
    the surface, to the average of its neighbours or along its normal, or the split of an edge at a point of the
    surface. None of these makes a triangle that is turned against the surface. Where nothing helps, splits are made
    that leave as many pairs, a few times over. The rounds are bounded, and the best mesh met is returned.
    """
    if len(self_intersections(Surface(points, faces))) == 0:
        return points, faces, 0  # most often, and without a search for intersections of the reference
    crossing = crossing_facets(reference.surface)
    best = points, faces, len(faces) ** 2
    splits = 0
    tries = _Tries(max_tries, deadline)
    for _ in range(MAX_ROUNDS):
        surface = Surface(points, faces)
        pairs = new_intersections(surface, crossing).astype(np.int64)
        if len(pairs) < best[2]:
            best = points, faces, len(pairs)
        changes = _changes(surface, pairs, reference, tries, allow_equal=False)
        if not changes and splits < _MAX_SPLITS:
            changes = _changes(surface, pairs, reference, tries, allow_equal=True)
            splits += 1
        if not changes:
            break
        points, faces = _applied(surface, changes)
    return best


def _changes(
    surface: Surface, pairs: Ints, reference: ClosestPoints, tries: _Tries, *, allow_equal: bool
) -> list[_Change]:
    """Return changes that mend pairs, no two of them near each other."""
    busy = np.zeros(surface.n_faces, dtype=bool)
    changes = []
    corners = surface.points[surface.faces]
    boxes = corners.min(axis=1), corners.max(axis=1)
    for pair in pairs:
        if tries.left <= 0 or tries.deadline.passed():
            break
        zone = _zone(surface, pair, boxes)
        if busy[zone].any():
            continue
        if len(zone) > _MAX_ZONE:
            tries.left -= 1
            continue
        used, faces = np.unique(surface.faces[zone], return_inverse=True)
        local = Surface(surface.points[used], faces.reshape(-1, 3))
        here = np.searchsorted(zone, pair)
        key = b"".join((local.points.tobytes(), local.faces.tobytes(), here.tobytes(), bytes([allow_equal])))
        if key in tries.failed:
            continue
        tries.left -= 1 + len(zone) // _ZONE
        change = _best_change(local, here, reference, allow_equal)
        if change is None:
            tries.failed.add(key)
        else:
            busy[zone] = True
            names = np.append(used, surface.n_points)  # the last stands for a new point
            point = int(names[change.point]) if change.place is not None else -1
            changes.append(_Change(zone[change.gone], names[change.new], point, change.place))
    return changes


def _zone(surface: Surface, pair: Ints, boxes: tuple[Floats, Floats]) -> Ints:
    """Return the faces (n,) around a pair: as far as its longest edge, and all at the corners of its neighbours."""
    corners = surface.points[surface.faces[pair]]
    room = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max()
    low, high = corners.min(axis=(0, 1)) - room, corners.max(axis=(0, 1)) + room
    inside = ((boxes[1] >= low) & (boxes[0] <= high)).all(axis=1)
    around = surface.face_neighbours[pair].ravel()
    beside = np.zeros(surface.n_points, dtype=bool)
    beside[surface.faces[np.concatenate([pair, around[around >= 0]])]] = True
    return np.flatnonzero(inside | beside[surface.faces].any(axis=1))


def _best_change(surface: Surface, pair: Ints, reference: ClosestPoints, allow_equal: bool) -> _Change | None:
    """Return the change that leaves fewest pairs on a piece of the mesh, None if none leaves fewer than there are.

    With ``allow_equal`` a split will do that leaves as many.
    """
    least, best = len(self_intersections(surface)), None
    for change in _candidates(surface, pair, reference):
        points, faces = _applied(surface, [change])
        after = len(self_intersections(Surface(points, faces)))
        better = after < least or (allow_equal and best is None and after == least and change.point == surface.n_points)
        if better and _is_sound(surface, change, reference):
            least, best = after, change
            if after == 0:
                break
    return best


def _is_sound(surface: Surface, change: _Change, reference: ClosestPoints) -> bool:
    """Return whether a change makes no triangle that is turned or thin, beyond those that it takes away."""
    points = surface.points
    if change.place is not None:
        points = np.concatenate([points, change.place[None]])
        points[change.point] = change.place
    old, new = surface.points[surface.faces[change.gone]], points[change.new]
    if geometry.thickness(new).min() < min(_MIN_THICKNESS, geometry.thickness(old).min()):
        return False
    if reference.inverted(new).sum() > reference.inverted(old).sum():
        return False
    return bool((~reference.clearly_facing(new)).sum() <= (~reference.clearly_facing(old)).sum())


def _candidates(surface: Surface, pair: Ints, reference: ClosestPoints) -> Iterator[_Change]:
    """Yield the changes to try for a pair."""
    edges = np.unique(surface.face_edges[pair])
    flips = possible_flips(surface, edges)
    for two, triangles in zip(flips.pair, flips.triangles, strict=True):
        yield _Change(two, triangles)
    corners = np.unique(surface.faces[pair])
    corners = corners[~surface.on_boundary[corners]]
    for point, around in faces_around(surface, corners).items():
        for place in _places(surface, point, around, reference):
            yield _Change(around, surface.faces[around].astype(np.int64), point, place)
    for edge in edges[surface.edge_face_count[edges] == 2].tolist():
        yield _split(surface, edge, reference)


def _places(surface: Surface, point: int, around: Ints, reference: ClosestPoints) -> Iterator[Floats]:
    """Yield places (3,) for a point: on its sheet of the surface, at the average of its neighbours, up and down."""
    here, normal = surface.points[point], surface.point_normals[point]
    ring = np.setdiff1d(surface.faces[around], [point])
    average = surface.points[ring].mean(axis=0)
    length = float(np.linalg.norm(surface.points[ring] - here, axis=1).mean())
    for start in (here, average):
        yield _on_sheet(start, normal, reference)
    yield 0.5 * (here + average)
    for lift in _LIFTS:
        yield here + lift * length * normal


def _on_sheet(start: Floats, normal: Floats, reference: ClosestPoints) -> Floats:
    """Return the closest point of the surface, or the start itself if the surface faces the other way there."""
    facet, weights = reference.locate(start[None])
    if reference.normals_at(facet, weights)[0] @ normal <= 0.0:
        return start
    return np.asarray(weights[0] @ reference.surface.points[reference.surface.faces[facet[0]]])


def _split(surface: Surface, edge: int, reference: ClosestPoints) -> _Change:
    """Return the split of an edge at the point of the surface that is closest to its middle."""
    x, y = surface.edges[edge].tolist()
    pair = surface.edge_faces[edge].astype(np.int64)
    normal = surface.face_normals[pair].sum(axis=0)
    place = _on_sheet(surface.points[[x, y]].mean(axis=0), normal, reference)
    old = surface.faces[pair].astype(np.int64)
    m = surface.n_points
    new = np.concatenate([np.where(old == x, m, old), np.where(old == y, m, old)])
    return _Change(pair, new, m, place)


def _applied(surface: Surface, changes: list[_Change]) -> tuple[Points, Faces]:
    """Return points and faces after changes of which no two have a face in common."""
    points, kept = list(surface.points), np.ones(surface.n_faces, dtype=bool)
    new = []
    for change in changes:
        kept[change.gone] = False
        rows = change.new
        if change.place is not None and change.point == surface.n_points:
            rows = np.where(rows == surface.n_points, len(points), rows)
            points.append(change.place)
        elif change.place is not None:
            points[change.point] = change.place
        new.append(rows)
    return np.array(points), np.concatenate([surface.faces[kept], *new]).astype(np.int32)
