"""The points of the boundary of a mesh in order with the anchors on the boundary of the surface."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Points
from anisomesh.mesh.boundary_places import LoopPlaces, boundary_places
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import boundary_loops, edge_keys
from anisomesh.meshops.anchors import Anchors, places_found
from anisomesh.meshops.change import Floats, Ints
from anisomesh.meshops.held import at_places

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, eq=False)
class Stops:
    """The stops along a boundary loop of a mesh: its points, and the anchors that are not among them.

    Attributes
    ----------
    point
        Point of the mesh at each stop (n,), -1 for anchors that are missing. The first stop is a point.
    places
        Where the stops are (n, 3).
    arc
        Arc length along the loop of the surface (n + 1,) from the first stop, ascending; the last is the whole length.
    anchored
        Which stops (n,) are anchors.
    outlined
        Which stops (n,) the outline begins at or goes past.
    """

    point: Ints
    places: Points
    arc: Floats
    anchored: Mask
    outlined: Mask

    @property
    def missing(self) -> Mask:
        """Which stops (n,) are anchors that the mesh lacks."""
        return self.point < 0

    @property
    def surplus(self) -> Mask:
        """Which stops (n,) are points that the outline does not have."""
        return self.outlined & ~self.anchored


class SurfaceBoundary:
    """The boundary loops of a surface, with the anchors on them."""

    def __init__(self, surface: Surface, anchors: Anchors) -> None:
        self._surface, self._anchors = surface, anchors
        self._loops = [loop.astype(np.int64) for loop in boundary_loops(surface.faces)]
        outline = edge_keys(places_found(anchors.places, surface.points)[anchors.outline])
        self._anchored = [at_places(surface.points[loop], anchors.places) for loop in self._loops]
        self._outlined = [
            np.isin(edge_keys(np.stack([loop, np.roll(loop, -1)], axis=1)), outline) for loop in self._loops
        ]

    def stops(self, mesh: Surface) -> Iterator[Stops]:
        """Yield the stops along each boundary loop of a mesh that belongs to a loop with anchors.

        There are none if the loops of the mesh are not the ones of the surface.
        """
        if not any(anchored.any() for anchored in self._anchored):
            return
        placed = boundary_places(mesh, self._surface, self._loops)
        for number, loop in enumerate(placed or []):
            if self._anchored[number].any():
                yield self._merged(number, loop, mesh.points[loop.points])

    def _merged(self, number: int, loop: LoopPlaces, points: Points) -> Stops:
        """Return the stops of one loop: points of the mesh (n, 3) and missing anchors."""
        own, anchored = self._surface.points[self._loops[number]], self._anchored[number]
        start = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.roll(own, -1, axis=0) - own, axis=1))])
        length = start[-1]
        vertex = places_found(points, own)
        arc = np.maximum.accumulate(np.where(vertex >= 0, start[vertex], loop.places))
        missing = np.flatnonzero(anchored)
        missing = missing[~at_places(own[missing], points)]
        along = np.concatenate([arc - arc[0], np.mod(start[missing] - arc[0], length)])
        order = np.argsort(along, kind="stable")
        place = np.concatenate([points, own[missing]])[order]
        is_anchor = at_places(place, self._anchors.places)
        last_anchor = np.maximum.accumulate(np.where(is_anchor, np.arange(len(place)), -1))
        last_anchor = np.where(last_anchor >= 0, last_anchor, last_anchor[-1])  # before the first: around the loop
        side = places_found(place, own)[last_anchor]
        return Stops(
            point=np.concatenate([loop.points, np.full(len(missing), -1)])[order],
            places=place,
            arc=np.append(along[order], length),
            anchored=is_anchor,
            outlined=is_anchor.any() & (side >= 0) & self._outlined[number][side],
        )
