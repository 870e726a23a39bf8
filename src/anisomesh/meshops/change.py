"""Local changes of a triangle mesh, and the patch around a fault that they are tried on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceMask, Faces, PointMask, Points
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.intersections import Pairs, self_intersections
from anisomesh.mesh.surface import Surface

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
HalfEdges = set[tuple[int, int]]


def _no_points() -> Ints:
    return np.zeros(0, dtype=np.int64)


def _no_places() -> Floats:
    return np.zeros((0, 3))


@dataclass(frozen=True, eq=False)
class Change:
    """Faces that go, faces in their place, and positions of points that move or are new.

    Attributes
    ----------
    gone
        Faces that go (n,).
    new
        Corners of the faces in their place (m, 3). In a mesh of V points, V, V + 1, ... are new points.
    points, places
        Points that move or are new (k,), and their positions (k, 3). Points left without a face disappear.
    """

    gone: Ints
    new: Ints
    points: Ints = field(default_factory=_no_points)
    places: Floats = field(default_factory=_no_places)

    def corners(self, points: Points) -> Floats:
        """Return the positions of the corners (m, 3, 3) of the new faces."""
        return np.asarray(self.points_after(points)[self.new])

    def points_after(self, points: Points) -> Points:
        """Return the points (V, 3) after the change, with the new ones at the end and the disused ones."""
        n_new = np.count_nonzero(self.points >= len(points))
        after = np.concatenate([points, np.zeros((n_new, 3))])
        after[self.points] = self.places
        return after


@dataclass(frozen=True, eq=False)
class Patch:
    """The part of a mesh around a fault, as a mesh of its own, and the surface that it approximates.

    Attributes
    ----------
    surface
        The part; the points off its boundary have all their faces in it.
    fault
        Its faulty faces (k,).
    points, faces
        The numbers of its points (V,) and faces (F,) in the whole mesh.
    faulty
        Which faces (F,) have a fault, this or another one.
    reference
        The surface that the mesh approximates.
    stays
        Which points (V,) neither move nor go: the ones on the boundary of the part, and held ones.
    """

    surface: Surface
    fault: Ints
    points: Ints
    faces: Ints
    faulty: FaceMask
    reference: ClosestPoints
    stays: PointMask

    @classmethod
    def cut(
        cls, surface: Surface, faces: Ints, fault: Ints, faulty: FaceMask, reference: ClosestPoints, held: PointMask
    ) -> Patch:
        """Return the patch of some faces (F,), in ascending order, around a fault (k,); ``held`` points stay."""
        points, corners = np.unique(surface.faces[faces], return_inverse=True)
        part = Surface(surface.points[points], corners.reshape(-1, 3))
        stays = part.on_boundary | held[points]
        return cls(part, np.searchsorted(faces, fault), points, faces, faulty, reference, stays)

    @property
    def key(self) -> bytes:
        """What tells the patch from all others that differ in shape, connectivity, fault or points that stay."""
        arrays = self.surface.points, self.surface.faces, self.fault, self.stays
        return b"".join(array.tobytes() for array in arrays)

    @cached_property
    def corners(self) -> Floats:
        """Positions of the corners of the faces (F, 3, 3)."""
        return np.asarray(self.surface.points[self.surface.faces])

    @cached_property
    def crossings(self) -> Pairs:
        """Pairs of faces (n, 2) that intersect."""
        return self_intersections(self.surface)

    @cached_property
    def half_edges(self) -> HalfEdges:
        """The directed edges of the faces."""
        return _half_edges(self.surface.faces)

    @property
    def fault_edges(self) -> Ints:
        """Edges (n,) of the faulty faces."""
        return np.unique(self.surface.face_edges[self.fault]).astype(np.int64)

    @property
    def movable(self) -> list[int]:
        """Corners of the faulty faces that may move."""
        corners = np.unique(self.surface.faces[self.fault])
        return [int(corner) for corner in corners[~self.stays[corners]]]

    def star(self, point: int) -> Ints:
        """Return the faces (n,) at a point."""
        return np.flatnonzero((self.surface.faces == point).any(axis=1))

    def keeps_topology(self, change: Change) -> bool:
        """Return whether the new faces are glued to the others as the old ones were, and are as many disks.

        They have the boundary and the Euler characteristic of the old ones, and no edge or face that is elsewhere.
        For the collapse of an edge that is the link condition (Dey, Edelsbrunner, Guha, Nekhayev 1999).
        """
        old_faces = self.surface.faces[change.gone]
        if old_faces.shape == change.new.shape and (old_faces == change.new).all():
            return True
        old, new = _half_edges(old_faces), _half_edges(change.new)
        outside = self.half_edges - old
        if len(new) < 3 * len(change.new) or new & outside or _boundary(new) != _boundary(old):
            return False
        others = np.sort(np.delete(self.surface.faces, change.gone, axis=0), axis=1).tolist()
        twice = any(face in others for face in np.sort(change.new, axis=1).tolist())
        return not twice and _euler(change.new, new) == _euler(old_faces, old)

    def in_mesh(self, change: Change, n_points: int) -> Change:
        """Return a change of the patch as one of the whole mesh of ``n_points`` points."""
        n_new = np.count_nonzero(change.points >= len(self.points))
        number = np.concatenate([self.points, n_points + np.arange(n_new)])
        return Change(self.faces[change.gone], number[change.new], number[change.points], change.places)


def apply_changes(surface: Surface, changes: Sequence[Change]) -> tuple[Points, Faces]:
    """Return points and faces after changes of which no two have a face in common.

    New faces take the places of old ones in the order of faces as far as there are any; new points come last.
    """
    n = surface.n_points
    points, faces = surface.points.copy(), surface.faces.astype(np.int64)
    kept = np.ones(len(faces), dtype=bool)
    used = np.ones(n, dtype=bool)
    added_points: list[Floats] = []
    added_faces: list[Ints] = []
    n_points = n
    for change in changes:
        is_new = change.points >= n
        points[change.points[~is_new]] = change.places[~is_new]
        new = np.where(change.new >= n, change.new - n + n_points, change.new)
        used[faces[change.gone]] = False
        used[change.new[change.new < n]] = True
        shared = min(len(change.gone), len(new))
        faces[change.gone[:shared]] = new[:shared]
        kept[change.gone[shared:]] = False
        added_points.append(change.places[is_new])
        added_faces.append(new[shared:])
        n_points += int(is_new.sum())
    points = np.concatenate([points, *added_points])
    faces = np.concatenate([faces[kept], *added_faces])
    if not used.all():
        used = np.concatenate([used, np.ones(n_points - n, dtype=bool)])
        points, faces = points[used], (np.cumsum(used) - 1)[faces]
    return points, faces.astype(np.int32)


def _half_edges(faces: npt.NDArray[np.integer]) -> HalfEdges:
    a, b, c = faces.T.tolist()
    return {*zip(a, b, strict=True), *zip(b, c, strict=True), *zip(c, a, strict=True)}


def _boundary(half_edges: HalfEdges) -> HalfEdges:
    return {(u, v) for u, v in half_edges if (v, u) not in half_edges}


def _euler(faces: npt.NDArray[np.integer], half_edges: HalfEdges) -> int:
    edges = {(min(edge), max(edge)) for edge in half_edges}
    return len(np.unique(faces)) - len(edges) + len(faces)


def faces_beside(surface: Surface, fault: Ints) -> FaceMask:
    """Return which faces (F,) have a corner in common with some faces (k,) or with a neighbour of them."""
    around = surface.face_neighbours[fault].ravel()
    beside = np.zeros(surface.n_points, dtype=bool)
    beside[surface.faces[np.concatenate([fault, around[around >= 0]])]] = True
    return np.asarray(beside[surface.faces].any(axis=1))
