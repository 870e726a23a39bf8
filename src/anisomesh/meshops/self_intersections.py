"""Removal of self-intersections that the reference surface does not have."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np

from anisomesh._arrays import Faces, Points
from anisomesh.execution.deadline import NO_DEADLINE, Deadline
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.intersections import count_intersections_from
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import new_intersections
from anisomesh.meshops import candidates
from anisomesh.meshops.change import Change, Ints, Patch, faces_beside
from anisomesh.meshops.engine import Strategy, remove_faults
from anisomesh.meshops.held import Held

MAX_INTERSECTION_ROUNDS = 30
_MAX_INTERSECTION_PLATEAUS = 6


def remove_self_intersections(
    points: Points,
    faces: Faces,
    reference: ClosestPoints,
    *,
    held: Held | None = None,
    max_tries: int = 300,
    deadline: Deadline = NO_DEADLINE,
) -> tuple[Points, Faces, int]:
    """Remove pairs of triangles that intersect, where the reference does not, without changing the topology.

    Parameters
    ----------
    points, faces
        An oriented manifold mesh (V, 3), (F, 3).
    reference
        The surface that the mesh approximates.
    held
        Points and faces that stay.
    max_tries
        Pairs that are looked at, in all rounds together; one amid many faces counts for several.
    deadline
        Asked before every pair whether to end.

    Returns
    -------
    points, faces, left
        The mesh, in which points may have been added at the end, and the number of pairs left.

    Notes
    -----
    See :func:`~anisomesh.meshops.engine.remove_faults`.
    """
    strategy = Strategy(
        candidates=(_changes, candidates.nudges, candidates.smoothing),
        plateau=candidates.edge_splits,
        max_rounds=MAX_INTERSECTION_ROUNDS,
        max_plateaus=_MAX_INTERSECTION_PLATEAUS,
        max_tries=max_tries,
        held=held or Held(),
    )
    return remove_faults(points, faces, reference, _NewIntersections(reference), strategy, deadline=deadline)


def _changes(patch: Patch) -> Iterator[Change]:
    return chain(candidates.flips(patch), candidates.moves_on_side(patch), candidates.edge_splits(patch))


class _NewIntersections:
    """The objective: the number of pairs of triangles that intersect where the reference does not."""

    def __init__(self, reference: ClosestPoints) -> None:
        self.reference = reference

    def faults(self, surface: Surface) -> Ints:
        return new_intersections(surface, self.reference).astype(np.int64)

    def patch_faces(self, surface: Surface, faults: Ints) -> Iterator[Ints]:
        """Yield the faces as near to a pair as its longest edge, and all at the corners of its neighbours."""
        corners = surface.points[surface.faces]
        low, high = corners.min(axis=1), corners.max(axis=1)
        for pair in faults:
            room = np.linalg.norm(corners[pair] - corners[pair][:, [1, 2, 0]], axis=2).max()
            near = (high >= low[pair].min(axis=0) - room) & (low <= high[pair].max(axis=0) + room)
            yield np.flatnonzero(near.all(axis=1) | faces_beside(surface, pair))

    def count(self, patch: Patch) -> int:
        return len(patch.crossings)

    def bounds_after(self, patch: Patch, changes: Sequence[Change]) -> Ints:
        """Return the numbers of pairs that the changes do not touch."""
        pairs, gone = patch.crossings, np.zeros((len(changes), patch.surface.n_faces), dtype=bool)
        for row, change in zip(gone, changes, strict=True):
            row[change.gone] = True
        return np.asarray((~gone[:, pairs].any(axis=2)).sum(axis=1))

    def count_after(self, patch: Patch, change: Change, bound: int) -> int:
        stays = np.ones(patch.surface.n_faces, dtype=bool)
        stays[change.gone] = False
        others = patch.surface.faces[stays]
        faces = np.concatenate([others, change.new.astype(np.int32)])
        return bound + count_intersections_from(len(others), change.points_after(patch.surface.points), faces)
