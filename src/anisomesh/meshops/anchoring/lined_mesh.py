"""A mesh with edges along lines, which stay with it while points are inserted, moved and removed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeEnds, Faces, Points
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.meshops.anchors import places_found
from anisomesh.meshops.change import Change, Ints, Patch, apply_changes
from anisomesh.meshops.split import edge_split

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Step:
    """A change of a mesh, and what becomes of the lines.

    Attributes
    ----------
    change
        The change.
    split
        Ends of the edge that it splits, None if it splits none.
    replaced
        A point that moves or goes, None if none does: lines at it continue to ``place``.
    place
        Where the point is that the edge is split at, or that replaces another (3,).
    """

    change: Change
    split: tuple[int, int] | None = None
    replaced: int | None = None
    place: Floats = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True, eq=False)
class LinedMesh:
    """A mesh with edges along lines.

    Attributes
    ----------
    surface
        The mesh.
    lines
        The two end points of each edge along a line (n, 2, 3).
    """

    surface: Surface
    lines: Floats

    @classmethod
    def of(cls, points: Points, faces: Faces, edges: EdgeEnds) -> LinedMesh:
        """Return a mesh (V, 3), (F, 3) with these edges (n, 2) along lines."""
        return cls(Surface(points, faces), points[edges])

    @cached_property
    def line_edges(self) -> EdgeEnds:
        """Edges along lines (n, 2) that the mesh has."""
        ends = places_found(self.lines.reshape(-1, 3), self.surface.points).reshape(-1, 2)
        ends = ends[(ends >= 0).all(axis=1)]
        return np.asarray(ends[np.isin(edge_keys(ends), edge_keys(self.surface.edges))])

    @cached_property
    def on_line(self) -> npt.NDArray[np.bool_]:
        """Which points (V,) are on a line."""
        mask = np.zeros(self.surface.n_points, dtype=bool)
        mask[self.line_edges] = True
        return mask

    @cached_property
    def _stars(self) -> tuple[Ints, Ints]:
        corners = self.surface.faces.ravel()
        count = np.bincount(corners, minlength=self.surface.n_points)
        return np.argsort(corners, kind="stable") // 3, np.concatenate([[0], np.cumsum(count)])

    def star(self, point: int) -> Ints:
        """Return the faces (n,) at a point."""
        faces, first = self._stars
        return faces[first[point] : first[point + 1]]

    def edge(self, a: int, b: int) -> int:
        """Return the number of the edge between two points."""
        return int(np.searchsorted(edge_keys(self.surface.edges), edge_keys(np.array([[a, b]]))[0]))

    def neighbours(self, point: int) -> set[int]:
        """Return the points that share an edge with a point."""
        return set(self.surface.faces[self.star(point)].ravel().tolist()) - {point}

    def on_patch(self, change: Change, reference: ClosestPoints) -> tuple[Patch, Change]:
        """Return the patch of all faces at the faces that a change takes away, and the change as one of it."""
        corners = np.unique(self.surface.faces[change.gone]).tolist()
        faces = np.unique(np.concatenate([self.star(corner) for corner in corners]))
        none, held = np.zeros(len(faces), dtype=bool), np.zeros(self.surface.n_points, dtype=bool)
        patch = Patch.cut(self.surface, faces, faces[:0], none, reference, held)
        n, gone = self.surface.n_points, np.searchsorted(faces, change.gone)

        def number(points: Ints) -> Ints:
            own = np.searchsorted(patch.points, points)
            return np.where(points >= n, points - n + len(patch.points), own)

        return patch, Change(gone, number(change.new), number(change.points), change.places)

    def split(self, edge: int, place: Floats) -> Step:
        """Return the split of an edge at a place (3,)."""
        low, high = self.surface.edges[edge].tolist()
        return Step(change=edge_split(self.surface, edge, place), split=(low, high), place=place)

    def after(self, steps: Sequence[Step]) -> LinedMesh:
        """Return the mesh after steps, of which no two change the same face."""
        surface = self.surface
        points, lines = surface.points, [self.lines]
        edges = {(min(a, b), max(a, b)) for a, b in self.line_edges.tolist()}
        for step in steps:
            if step.split in edges:
                a, b = points[list(step.split)]
                lines.append(np.array([[a, step.place], [step.place, b]]))
            if step.replaced is not None:
                here = (lines[0] == points[step.replaced]).all(axis=2)
                lines[0] = np.where(here[:, :, None], step.place, lines[0])
        new_points, faces = apply_changes(surface, [step.change for step in steps])
        return LinedMesh(Surface(new_points, faces), np.concatenate(lines))


def disjoint(mesh: LinedMesh, steps: Sequence[tuple[Step, Ints]]) -> list[Step]:
    """Return the steps whose faces (n,), listed beside each, are not among the ones of an earlier step."""
    taken = np.zeros(mesh.surface.n_faces, dtype=bool)
    chosen = []
    for step, faces in steps:
        if not taken[faces].any():
            taken[faces] = True
            chosen.append(step)
    return chosen
