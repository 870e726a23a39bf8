"""Energies of a tessellation: the normal metric of the paper, and the protocol for a user's own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from anisomesh._arrays import Sites
from anisomesh.errors import OptionError
from anisomesh.voronoi.restricted import EnergyValue, RestrictedVoronoi


class Energy(Protocol):
    """Anything that assigns sites on an embedded surface an energy with a gradient."""

    def evaluate(self, voronoi: RestrictedVoronoi, sites: Sites, /) -> EnergyValue:
        """Return the energy of sites (S, d), its gradient, and mass and energy of each cell."""
        ...


@dataclass(frozen=True)
class NormalMetric:
    """The CVT energy with the metric I + (s - 1) N N^t, which penalises the distance of a site to the facets' planes.

    Parameters
    ----------
    sharpness
        The factor s, at least 1: 1 is the plain CVT with the most regular elements, 7 the paper's value; larger values
        draw sites onto creases and corners more strongly.

    Raises
    ------
    OptionError
        If ``sharpness`` is not a finite number of at least 1.

    References
    ----------
    NASM, energy of the normal-metric CVT; Levy, Liu, "Lp centroidal Voronoi tessellation and its applications", TOG
    2010.
    """

    sharpness: float = 7.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.sharpness) and self.sharpness >= 1.0):
            raise OptionError(f"sharpness = {self.sharpness}; expected a finite number of at least 1 (the plain CVT)")

    def evaluate(self, voronoi: RestrictedVoronoi, sites: Sites, /) -> EnergyValue:
        """Return the energy of sites (S, d), its gradient, and mass and energy of each cell."""
        return voronoi.integrate(sites, self.sharpness)
