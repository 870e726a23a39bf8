"""Recovery of edges that a mesh must have, by flips."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from anisomesh._arrays import Faces, Points
from anisomesh.mesh.closest_points import ClosestPoints


def recover_edges(points: Points, faces: Faces, paths: list[list[int]], reference: ClosestPoints) -> Faces:
    """Return the faces (F, 3) after flips that make an edge from the first to the last point of each path.

    Parameters
    ----------
    points, faces
        An oriented manifold mesh (V, 3), (F, 3).
    paths
        Points, each of which has an edge to the next.
    reference
        The surface that the mesh approximates.

    Notes
    -----
    Inner points are cut off the path one by one. Around such a point there are two fans of triangles between its two
    neighbours on the path; one of them is retriangulated with an edge between the neighbours, such that all triangles
    face the way of the surface. If a point cannot be cut off, the triangles around its path stay as they are.
    """
    mesh = _HalfEdgeTriangles(faces)
    for wanted in paths:
        path, done = list(wanted), []
        while len(path) > 2:
            for k in range(1, len(path) - 1):
                cut = mesh.cut_off(path[k - 1], path[k], path[k + 1], points, reference)
                if cut is not None:
                    done.append(cut)
                    del path[k]
                    break
            else:
                for old, new in reversed(done):
                    mesh.replace(new, old)
                break
    return mesh.faces()


Triangle = tuple[int, int, int]
Replacement = tuple[list[Triangle], list[Triangle]]


class _HalfEdgeTriangles:
    """Oriented triangles, found by their directed edges."""

    def __init__(self, faces: Faces) -> None:
        self._across: dict[tuple[int, int], int] = {}
        self.replace([], [(a, b, c) for a, b, c in faces.tolist()])

    def replace(self, old: list[Triangle], new: list[Triangle]) -> None:
        """Replace triangles by others."""
        for a, b, c in old:
            del self._across[a, b], self._across[b, c], self._across[c, a]
        for a, b, c in new:
            self._across[a, b], self._across[b, c], self._across[c, a] = c, a, b

    def cut_off(
        self, before: int, middle: int, after: int, points: Points, reference: ClosestPoints
    ) -> Replacement | None:
        """Join two neighbours of a point; return the triangles before and after, None if that is impossible."""
        if before == after:
            return None
        if self._joined(before, after):
            return [], []
        for first, last in ((before, after), (after, before)):
            fan = self._fan(middle, first, last)
            if fan is None or any(self._joined(first, point) for point in fan[2:]):
                continue
            spokes = list(pairwise(fan))
            old = [(middle, a, b) for a, b in spokes]
            new = [(middle, first, last), *((first, a, b) for a, b in spokes[1:])]
            if reference.clearly_facing(points[np.array(new)]).all():
                self.replace(old, new)
                return old, new
        return None

    def faces(self) -> Faces:
        """Return the triangles (F, 3)."""
        return np.array([(a, b, c) for (a, b), c in self._across.items() if a < b and a < c], dtype=np.int32)

    def _joined(self, a: int, b: int) -> bool:
        return (a, b) in self._across or (b, a) in self._across

    def _fan(self, centre: int, first: int, last: int) -> list[int] | None:
        """Return the neighbours of a point from one to another, counter-clockwise; None across a boundary."""
        result = [first]
        while result[-1] != last:
            following = self._across.get((centre, result[-1]))
            if following is None or following == first:
                return None
            result.append(following)
        return result
