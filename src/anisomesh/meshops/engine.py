"""The removal of faults of a mesh by local changes: the best one for each fault, until none is left or none helps."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

import numpy as np

from anisomesh._arrays import Faces, Points
from anisomesh.execution.deadline import NO_DEADLINE, Deadline
from anisomesh.mesh import geometry
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.meshops.change import Change, Ints, Patch, apply_changes
from anisomesh.meshops.held import Held, at_places

_FACES_PER_TRY = 100  # a patch of more faces counts for several tries
_MAX_PATCH = 2_000  # faces of a patch; in a larger one the mesh is crumpled, and every try takes long
MIN_THICKNESS = 1e-3  # area over squared longest side of a triangle that a change may make

_PLATEAU = -1  # number of the source of plateau changes

Candidates = Callable[[Patch], Iterable[Change]]
"""Return changes of a patch to try for its fault."""


class Objective(Protocol):
    """What is wrong with a mesh, as a number of faults to lower."""

    def faults(self, surface: Surface) -> Ints:
        """Return the faults, as the faces (n, k) of each."""

    def patch_faces(self, surface: Surface, faults: Ints) -> Iterator[Ints]:
        """Yield for each fault the faces (m,) around it on which faults are counted."""

    def count(self, patch: Patch) -> int:
        """Return the number of faults of a patch."""

    def bounds_after(self, patch: Patch, changes: Sequence[Change]) -> Ints:
        """Return lower bounds (n,) of the number of faults of a patch after each of these changes."""

    def count_after(self, patch: Patch, change: Change, bound: int) -> int:
        """Return the number of faults of a patch after a change with this lower bound."""


@dataclass(frozen=True, kw_only=True)
class Strategy:
    """Which changes are tried, and how often.

    Attributes
    ----------
    candidates
        Sources of changes that lower the number of faults, the preferred ones first.
    plateau
        The source of changes that leave as many faults, for rounds in which no change lowers their number.
    max_rounds, max_plateaus
        Rounds in all, and rounds that leave as many faults.
    max_tries
        Patches looked at in all rounds together, large ones counted as several.
    held
        Points and faces that stay.
    """

    candidates: Sequence[Candidates]
    plateau: Candidates
    max_rounds: int
    max_plateaus: int
    max_tries: float = np.inf
    held: Held = field(default_factory=Held)


def remove_faults(
    points: Points,
    faces: Faces,
    reference: ClosestPoints,
    objective: Objective,
    strategy: Strategy,
    *,
    deadline: Deadline = NO_DEADLINE,
) -> tuple[Points, Faces, int]:
    """Lower the number of faults of a mesh by local changes that keep its topology.

    Parameters
    ----------
    points, faces
        An oriented manifold mesh (V, 3), (F, 3).
    reference
        The surface that the mesh approximates.
    objective
        What the faults are.
    strategy
        The changes to try.
    deadline
        Asked before every fault whether to end.

    Returns
    -------
    points, faces, left
        The mesh with the fewest faults that was met, the input arrays if that is the input, and their number.

    Notes
    -----
    In each round every fault gets the change that leaves the fewest faults on the patch around it, if those are fewer
    than before: from the first source of candidates that has one. Changes of one round have disjoint patches. Where
    no fault can be helped the round makes changes that leave as many faults; the number of these rounds is bounded.
    A change is made only if it keeps the topology, the boundary and what is held, and makes no triangle inverted or
    thin. Patches that nothing helped are remembered, and looked at again when something on them has changed.
    """
    best = points, faces, -1
    search = _Search(objective, strategy, deadline)
    for _ in range(strategy.max_rounds):
        surface = Surface(points, faces)
        faults = objective.faults(surface)
        if best[2] < 0 or len(faults) < best[2]:
            best = points, faces, len(faults)
        if len(faults) == 0:
            break
        changes = search.changes(_Round(surface, faults, objective, reference, strategy.held))
        if not changes:
            break
        points, faces = apply_changes(surface, changes)
    return best


class _Round:
    """A mesh and its faults at the start of a round, with the patches around them."""

    def __init__(
        self, surface: Surface, faults: Ints, objective: Objective, reference: ClosestPoints, held: Held
    ) -> None:
        self.surface, self.faults, self.reference = surface, faults, reference
        self.held, self.n_held_faces = at_places(surface.points, held.places), held.n_faces
        self.patch_faces = list(objective.patch_faces(surface, faults))
        self.faulty = np.zeros(surface.n_faces, dtype=bool)
        self.faulty[faults] = True
        self._patches: dict[int, Patch] = {}

    def patch(self, k: int) -> Patch:
        """Return the patch of one fault."""
        if k not in self._patches:
            faces = self.patch_faces[k]
            fault, faulty = self.faults[k], self.faulty[faces]
            self._patches[k] = Patch.cut(self.surface, faces, fault, faulty, self.reference, self.held)
        return self._patches[k]


@dataclass
class _Search:
    """The search for changes: the attempts that failed, and how many were made."""

    objective: Objective
    strategy: Strategy
    deadline: Deadline
    failed: set[tuple[int, bytes]] = field(default_factory=set)
    tries: int = 0
    plateaus: int = 0

    def changes(self, start: _Round) -> list[Change]:
        """Return changes from the first source that lowers the number of faults, or else plateau changes."""
        for number in range(len(self.strategy.candidates)):
            changes = self._changes_from(number, start)
            if changes:
                return changes
        self.plateaus += 1
        return self._changes_from(_PLATEAU, start) if self.plateaus <= self.strategy.max_plateaus else []

    def _changes_from(self, number: int, start: _Round) -> list[Change]:
        """Return changes from one source of candidates, on disjoint patches."""
        on_plateau = number == _PLATEAU
        source = self.strategy.plateau if on_plateau else self.strategy.candidates[number]
        busy = np.zeros(start.surface.n_faces, dtype=bool)
        changes = []
        for k, faces in enumerate(start.patch_faces):
            if self.tries >= self.strategy.max_tries or self.deadline.passed():
                break
            if busy[faces].any():
                continue
            if len(faces) > _MAX_PATCH:
                self.tries += 1
                continue
            patch = start.patch(k)
            if (number, patch.key) in self.failed:
                continue
            self.tries += 1 + len(faces) // _FACES_PER_TRY
            change = _best_change(patch, partial(_allowed, source, start), self.objective, allow_equal=on_plateau)
            if change is None:
                self.failed.add((number, patch.key))
            else:
                busy[faces] = True
                changes.append(patch.in_mesh(change, start.surface.n_points))
        return changes


def _allowed(source: Candidates, start: _Round, patch: Patch) -> list[Change]:
    """Return the changes of a source that leave the faces as they are that stay."""
    changes = list(source(patch))
    if start.n_held_faces == 0:
        return changes
    return [change for change in changes if (patch.faces[change.gone] >= start.n_held_faces).all()]


def _best_change(patch: Patch, source: Candidates, objective: Objective, *, allow_equal: bool) -> Change | None:
    """Return the sound change that leaves the fewest faults on a patch, fewer than there are (or as many), or None.

    Among equally good changes it is the first of the source.
    """
    least, best = objective.count(patch) + int(allow_equal), -1
    changes = list(source(patch))
    bounds = objective.bounds_after(patch, changes)
    for k in np.argsort(bounds, kind="stable").tolist():
        if bounds[k] > least or (bounds[k] == least and best < k):
            break
        count = objective.count_after(patch, changes[k], int(bounds[k]))
        if (count < least or (count == least and k < best)) and is_sound(patch, changes[k]):
            least, best = count, k
    return changes[best] if best >= 0 else None


def is_sound(patch: Patch, change: Change) -> bool:
    """Return whether a change keeps the topology and makes no triangle inverted, unclear or thin.

    Not more of them, that is, than it takes away.
    """
    return patch.keeps_topology(change) and is_sound_in_shape(patch, change)


def is_sound_in_shape(patch: Patch, change: Change) -> bool:
    """Return whether a change makes no more triangles inverted, unclear or thin than it takes away."""
    old, new = patch.corners[change.gone], change.corners(patch.surface.points)
    if geometry.thickness(new).min(initial=np.inf) < min(MIN_THICKNESS, geometry.thickness(old).min()):
        return False
    corners, sign = np.concatenate([new, old]), np.repeat([1, -1], [len(new), len(old)])
    unclear = np.flatnonzero(~patch.reference.clearly_facing(corners))
    if len(unclear) == 0 or sign[unclear].sum() > 0:
        return len(unclear) == 0
    inverted = unclear[patch.reference.inverted(corners[unclear])]
    return bool(sign[inverted].sum() <= 0)
