"""All feature polylines of an embedded surface: its boundary loops and its creases."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, Points
from anisomesh.errors import OptionError
from anisomesh.features.boundary import BoundaryLoops, trace_boundary
from anisomesh.features.creases import select_creases
from anisomesh.features.detect import corners
from anisomesh.features.polylines import FeaturePolylines, Floats, Ints
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.mesh.surface import Surface

_CORNER_SCALE = 0.75  # site spacings over which the turn of a boundary is measured; heuristic
_MAX_CREASE_LENGTH = 1.6  # site spacings of crease for each site; longer ones leave no sites for the faces; heuristic


@dataclass(frozen=True, eq=False)
class FeatureNetwork:
    """Boundary loops and creases that the sites of a tessellation follow.

    Attributes
    ----------
    boundary
        Boundary loops.
    boundary_corners, boundary_turns
        Segments of the boundary that start at a corner (n,), and the turning angles there (n,) in degrees.
    creases
        The creases that sites at ``spacing`` can follow, from corner to corner.
    spacing
        Distance between sites in the embedding.
    sharp
        All edges of the surface on a crease (E,), followed or not.
    required
        Edges that are followed in any case (E,).
    apexes
        Points of the surface (n,) at which there is a vertex in any case.
    """

    boundary: BoundaryLoops
    boundary_corners: Ints
    boundary_turns: Floats
    creases: FeaturePolylines
    spacing: float
    sharp: EdgeMask
    required: EdgeMask
    apexes: Ints

    @cached_property
    def facets(self) -> npt.NDArray[np.int32]:
        """Faces of the surface (n,) with sides on the boundary or on creases, on which all intervals of cells are."""
        sides = (self.boundary.segment_of_side >= 0) | (self.creases.segment_of_side >= 0)
        return np.flatnonzero(sides.any(axis=1)).astype(np.int32)

    @property
    def any(self) -> bool:
        """Whether there is a boundary or a crease."""
        return self.boundary.n_polylines + self.creases.n_polylines > 0

    def corner_places(self, surface: Surface) -> Points:
        """Return where the surface has corners of creases and apexes (n, 3)."""
        chosen = corners(surface, self.sharp)
        chosen[self.apexes] = True
        return np.asarray(surface.points[chosen])


def trace_features(
    embedded: EmbeddedSurface,
    n_sites: int,
    *,
    sharp: EdgeMask,
    required: EdgeMask | None = None,
    apexes: Ints | None = None,
) -> FeatureNetwork:
    """Return the feature network of an embedded surface for a number of sites.

    Parameters
    ----------
    embedded
        The embedded surface.
    n_sites
        Number of sites.
    sharp
        Which edges of the surface (E,) are on a crease.
    required
        Which of these (E,) are followed in any case; none by default.
    apexes
        Points of the surface (n,) at which there is a vertex in any case; none by default.

    Raises
    ------
    OptionError
        If there is not one value per edge.
    """
    positions, surface, spacing = embedded.points, embedded.surface, embedded.site_spacing(n_sites)
    if required is None:
        required = np.zeros_like(sharp)
    for name, mask in (("sharp", sharp), ("required", required)):
        if np.shape(mask) != (len(surface.edges),) or mask.dtype != bool:
            raise OptionError(f"{name} is not a mask ({len(surface.edges)},) of the edges of the embedded surface")
    boundary = trace_boundary(positions, surface)
    if apexes is None:
        apexes = np.zeros(0, dtype=np.int64)
    always = np.union1d(surface.edges[sharp], apexes).astype(np.int64)
    prescribed = surface.edges[required & (surface.edge_face_count > 1)]  # so that they are followed to the boundary
    corners, turns = boundary.corners(_CORNER_SCALE * spacing, always, kept=prescribed.astype(np.int64))
    creases = select_creases(
        positions, surface, sharp, required=required, spacing=spacing, max_length=_MAX_CREASE_LENGTH * n_sites
    )
    return FeatureNetwork(boundary, corners, turns, creases, spacing, sharp, required, apexes)
