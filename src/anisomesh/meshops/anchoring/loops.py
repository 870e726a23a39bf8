"""Where the boundary of a mesh is on the boundary of the surface that it approximates."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass

import igl
import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Points
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import boundary_loops, edge_keys
from anisomesh.meshops.anchors import Anchors, places_found
from anisomesh.meshops.change import Floats, Ints
from anisomesh.meshops.held import at_places

_BACKWARDS = 0.75  # of a loop ahead, from which on a point counts as behind the one before

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
        loops = boundary_loops(surface.faces)
        self.anchors = anchors
        self.point = np.concatenate([np.zeros(0, dtype=np.int32), *loops]).astype(np.int64)
        self.loop = np.repeat(np.arange(len(loops)), [len(loop) for loop in loops])
        self.first = np.concatenate([[0], np.cumsum([len(loop) for loop in loops])]).astype(np.int64)
        self.places = surface.points[self.point]
        ahead = np.arange(1, len(self.point) + 1)
        if len(loops):
            ahead[self.first[1:] - 1] = self.first[:-1]
        self.ahead = ahead
        length = np.linalg.norm(self.places[ahead] - self.places, axis=1) if len(loops) else np.zeros(0)
        self.arc = np.concatenate([[0.0], np.cumsum(length)])
        self.anchored = at_places(self.places, anchors.places)
        outline = edge_keys(places_found(anchors.places, surface.points)[anchors.outline])
        ends = np.stack([self.point, self.point[ahead]], axis=1) if len(loops) else np.zeros((0, 2), dtype=np.int64)
        self.outlined = np.isin(edge_keys(ends), outline)

    def stops(self, mesh: Surface) -> Iterator[Stops]:
        """Yield the stops along each boundary loop of a mesh that belongs to a loop with anchors."""
        loops = boundary_loops(mesh.faces)
        if len(loops) == 0 or not self.anchored.any():
            return
        taken: dict[int, int] = defaultdict(int)
        for loop in loops:
            segment, arc = self._located(mesh.points[loop])
            own = int(np.bincount(self.loop[segment]).argmax())
            taken[own] += 1
            if self.anchored[self.loop == own].any() and taken[own] == 1:
                yield self._merged(own, loop.astype(np.int64), mesh.points[loop], arc)

    def _located(self, points: Points) -> tuple[Ints, Floats]:
        """Return the segment (n,) nearest to each point and its arc length (n,)."""
        segments = np.stack([np.arange(len(self.point)), self.ahead], axis=1)
        _, segment, closest = igl.point_mesh_squared_distance(np.ascontiguousarray(points), self.places, segments)
        segment = np.asarray(segment, dtype=np.int64)
        arc = self.arc[segment] + np.linalg.norm(closest - self.places[segment], axis=1)
        vertex = places_found(points, self.places)
        return np.where(vertex >= 0, vertex, segment), np.where(vertex >= 0, self.arc[vertex], arc)

    def _merged(self, own: int, loop: Ints, points: Points, arc: Floats) -> Stops:
        """Return the stops of one loop: points of the mesh (n,) at arc lengths (n,), and missing anchors."""
        first, last = self.first[own], self.first[own + 1]
        length = self.arc[last] - self.arc[first]
        steps = np.mod(np.diff(arc), length)
        steps[steps > _BACKWARDS * length] = 0.0
        along = np.minimum(np.concatenate([[0.0], np.cumsum(steps)]), length)
        members = np.arange(first, last)[self.anchored[first:last]]
        members = members[~at_places(self.places[members], points)]
        offset = np.mod(self.arc[members] - arc[0], length)
        order = np.argsort(np.concatenate([along, offset]), kind="stable")
        place = np.concatenate([points, self.places[members]])[order]
        anchored = at_places(place, self.anchors.places)
        last_anchor = np.maximum.accumulate(np.where(anchored, np.arange(len(place)), -1))
        last_anchor = np.where(last_anchor >= 0, last_anchor, last_anchor[-1])  # before the first: around the loop
        segment = places_found(place, self.places)[last_anchor]
        return Stops(
            point=np.concatenate([loop, np.full(len(members), -1)])[order],
            places=place,
            arc=np.append(np.concatenate([along, offset])[order], length),
            anchored=anchored,
            outlined=anchored.any() & (segment >= 0) & self.outlined[segment],
        )
