"""Sites that stay on the boundary and on the creases of the surface."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import Sites
from anisomesh.cvt.boundary import Boundary
from anisomesh.cvt.creases import Creases
from anisomesh.cvt.optimise import lloyd
from anisomesh.mesh.surface import Surface
from anisomesh.voronoi.intervals import Mask
from anisomesh.voronoi.restricted import RestrictedVoronoi

_STEPS = 5  # Lloyd steps after which the sites on boundary and creases are spread


class Features:
    """Boundary and creases of an embedded surface.

    Parameters
    ----------
    voronoi
        The diagram over the embedded surface.
    surface
        The surface in space, its faces in the order of ``voronoi``.
    n_sites
        Number of sites that the surface is divided among.
    sharp
        Which edges of the surface (E,) are on a crease.
    always
        Which of these are followed in any case (E,).

    Attributes
    ----------
    boundary, creases
        The two.
    sharp
        All edges of the surface on a crease (E,), also those that the sites are too far apart to follow.
    """

    def __init__(self, voronoi: RestrictedVoronoi, surface: Surface, n_sites: int, sharp: Mask, always: Mask) -> None:
        self.sharp = sharp
        self.boundary = Boundary(voronoi, surface, n_sites, sharp)
        self.creases = Creases(voronoi, surface, n_sites, sharp, always)

    @property
    def any(self) -> bool:
        """Whether there is a boundary or a crease."""
        return self.boundary.curves.n_curves + self.creases.curves.n_curves > 0

    def draw(
        self, voronoi: RestrictedVoronoi, sites: Sites, on_boundary: Mask, on_crease: Mask
    ) -> tuple[Sites, Mask, Mask]:
        """Return the sites (S, d) with those of cells at boundary and creases on them, and which these are (S,) each.

        Parameters
        ----------
        voronoi
            The diagram over the embedded surface.
        sites
            Positions (S, d).
        on_boundary, on_crease
            Which of them are there already (S,).
        """
        diagram = voronoi.diagram(sites)
        drawn, on_boundary = self.boundary.draw(diagram, on_boundary)
        to_crease, on_crease = self.creases.draw(diagram, on_crease)
        on_crease &= ~on_boundary
        return np.where(on_crease[:, None], to_crease, drawn), on_boundary, on_crease

    def spread(
        self, voronoi: RestrictedVoronoi, sites: Sites, on_boundary: Mask, on_crease: Mask
    ) -> tuple[Sites, Mask, Mask]:
        """Return the same after a few steps of Lloyd's algorithm, on boundary and creases and elsewhere."""
        for _ in range(_STEPS):
            sites, on_boundary, on_crease = self.draw(voronoi, sites, on_boundary, on_crease)
            sites = lloyd(voronoi, sites, 1, fixed=on_boundary | on_crease)
        return self.draw(voronoi, sites, on_boundary, on_crease)
