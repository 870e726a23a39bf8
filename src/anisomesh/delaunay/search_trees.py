"""Search trees of surfaces, shared by tasks on the same surfaces."""

from __future__ import annotations

from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface


class SearchTrees:
    """Closest points of surfaces, each built when it is first asked for and kept."""

    def __init__(self) -> None:
        self._known: list[ClosestPoints] = []

    def of(self, surface: Surface) -> ClosestPoints:
        """Return the closest points of a surface."""
        for known in self._known:
            if known.surface is surface:
                return known
        self._known.append(ClosestPoints(surface))
        return self._known[-1]
