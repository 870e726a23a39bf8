"""Removal of inverted triangles, which face away from the reference surface."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anisomesh._arrays import Faces, Points
from anisomesh.execution.deadline import NO_DEADLINE, Deadline
from anisomesh.mesh import geometry
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.meshops import candidates
from anisomesh.meshops.change import Change, Ints, Patch, faces_beside
from anisomesh.meshops.engine import MIN_THICKNESS, Strategy, remove_faults
from anisomesh.meshops.flip import do_flips, possible_flips
from anisomesh.meshops.held import Held

MAX_INVERSION_ROUNDS = 100  # heuristic: hard training meshes take about 70
_MAX_INVERSION_PLATEAUS = 40  # heuristic
_PLATEAU_TRIES = 32  # random moves tried for a triangle that nothing helps; with 8 more of them stay inverted


def remove_inverted_triangles(
    points: Points,
    faces: Faces,
    reference: ClosestPoints,
    *,
    held: Held | None = None,
    deadline: Deadline = NO_DEADLINE,
) -> tuple[Points, Faces, int]:
    """Remove triangles that face away from the reference, without changing the topology.

    Parameters
    ----------
    points, faces
        An oriented manifold mesh (V, 3), (F, 3).
    reference
        The surface that the mesh approximates.
    held
        Points and faces that stay.
    deadline
        Asked before every inverted triangle whether to end.

    Returns
    -------
    points, faces, left
        The mesh and the number of inverted triangles left.

    Notes
    -----
    First all edges are flipped whose flip lowers the number of inverted triangles; the rest is left to
    :func:`~anisomesh.meshops.engine.remove_faults`, which tries one triangle after the other.
    """
    faces = _flip_inverted(points, faces, reference, 0 if held is None else held.n_faces)
    rng = np.random.default_rng(0)

    def random_nudges(patch: Patch) -> list[Change]:
        found = list(candidates.nudges(patch))
        return [found[k] for k in rng.permutation(len(found))[:_PLATEAU_TRIES]]

    strategy = Strategy(
        candidates=(
            candidates.flips,
            candidates.moves_to_average,
            candidates.nudges,
            candidates.collapses,
            candidates.splits,
            candidates.smoothing,
        ),
        plateau=random_nudges,
        max_rounds=MAX_INVERSION_ROUNDS,
        max_plateaus=_MAX_INVERSION_PLATEAUS,
        held=held or Held(),
    )
    return remove_faults(points, faces, reference, _InvertedTriangles(reference), strategy, deadline=deadline)


def _flip_inverted(points: Points, faces: Faces, reference: ClosestPoints, n_held: int) -> Faces:
    """Return the faces (F, 3) after flips, as long as any lowers the number of inverted triangles.

    The first ``n_held`` faces stay. As in the engine, no flip makes a thin triangle unless it takes away a thinner one.
    """
    while True:
        surface = Surface(points, faces)
        inverted = reference.inverted(points[faces])
        flips = possible_flips(surface, np.unique(surface.face_edges[inverted]))
        corners = points[flips.triangles].reshape(-1, 3, 3)
        gain = inverted[flips.pair].sum(axis=1) - reference.inverted(corners).reshape(-1, 2).sum(axis=1)
        before, after = (
            geometry.thickness(points[triangles].reshape(-1, 3, 3)).reshape(-1, 2).min(axis=1)
            for triangles in (faces[flips.pair], flips.triangles)
        )
        sound = after >= np.minimum(MIN_THICKNESS, before)
        order = np.lexsort((-after, -gain))
        order = order[((gain > 0) & sound & (flips.pair >= n_held).all(axis=1))[order]]
        if len(order) == 0:
            return faces
        faces = do_flips(surface, flips, order)


class _InvertedTriangles:
    """The objective: the number of triangles that face away from the reference."""

    def __init__(self, reference: ClosestPoints) -> None:
        self.reference = reference
        self.corners = np.zeros((0, 3, 3))
        self.inverted = np.zeros(0, dtype=bool)

    def faults(self, surface: Surface) -> Ints:
        corners, n = surface.points[surface.faces], min(surface.n_faces, len(self.corners))
        stale = np.ones(len(corners), dtype=bool)
        stale[:n] = (corners[:n] != self.corners[:n]).any(axis=(1, 2))
        self.inverted = np.resize(self.inverted, len(corners))
        self.inverted[stale], self.corners = self.reference.inverted(corners[stale]), corners
        return np.flatnonzero(self.inverted)[:, None]

    def patch_faces(self, surface: Surface, faults: Ints) -> Iterator[Ints]:
        return (np.flatnonzero(faces_beside(surface, fault)) for fault in faults)

    def count(self, patch: Patch) -> int:
        return int(patch.faulty.sum())

    def bounds_after(self, patch: Patch, changes: Sequence[Change]) -> Ints:
        if not changes:
            return np.zeros(0, dtype=np.int64)
        corners = [change.corners(patch.surface.points) for change in changes]
        first = np.cumsum([0, *(len(new) for new in corners[:-1])])
        new = np.add.reduceat(self.reference.inverted(np.concatenate(corners)).astype(np.int64), first)
        gone = [np.count_nonzero(patch.faulty[change.gone]) for change in changes]
        return np.asarray(self.count(patch) - np.array(gone) + new)

    def count_after(self, patch: Patch, change: Change, bound: int) -> int:
        return bound  # the bounds are exact
