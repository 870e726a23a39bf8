"""Anchors: places at which a mesh has vertices, and stretches of its boundary that are prescribed edge by edge."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from anisomesh._arrays import EdgeEnds, Faces, PointMask, Points
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.meshops.held import at_places


@dataclass(frozen=True, eq=False)
class Anchors:
    """Places at which a mesh has vertices, and edges of its boundary.

    Attributes
    ----------
    places
        The places (n, 3): points of the surface that the mesh approximates.
    outline
        Edges of the boundary of that surface (m, 2) as pairs of numbers of places, which are edges of the mesh.
    """

    places: Points = field(default_factory=lambda: np.zeros((0, 3)))
    outline: EdgeEnds = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))

    @property
    def count(self) -> int:
        """Number of places."""
        return len(self.places)

    def held_in(self, points: Points) -> PointMask:
        """Return which points (V,) are at an anchor."""
        return at_places(points, self.places)

    def outline_in(self, surface: Surface) -> EdgeEnds:
        """Return the edges of the outline (m', 2) that a surface has on its boundary, in numbers of its points."""
        number = places_found(self.places, surface.points)
        ends = number[self.outline]
        boundary = edge_keys(surface.edges[surface.edge_face_count == 1])
        return np.asarray(ends[(ends >= 0).all(axis=1) & np.isin(edge_keys(np.maximum(ends, 0)), boundary)])

    def are_in(self, points: Points, faces: Faces) -> bool:
        """Return whether a mesh (V, 3), (F, 3) has all anchors and the outline."""
        if self.count == 0:
            return True
        present = bool(at_places(self.places, points).all())
        return present and len(self.outline_in(Surface(points, faces))) == len(self.outline)


def places_found(places: Points, points: Points) -> EdgeEnds:
    """Return the point (n,) at each of some places (n, 3), -1 if there is none; the last of several."""
    number = {point.tobytes(): k for k, point in enumerate(points + 0.0)}
    return np.array([number.get(place.tobytes(), -1) for place in places + 0.0], dtype=np.int64)
