"""Energies of a tessellation: the normal metric of the paper, and the protocol for a user's own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import PointTensors, Sites, real_array
from anisomesh._values import real_number
from anisomesh.errors import OptionError
from anisomesh.voronoi.restricted import EnergyValue, RestrictedVoronoi

_STIFFNESS_SHARE = 0.35  # of the sharpness that cells of moving boundaries have; heuristic
_LARGEST_NUMBER = 1e100  # so that products of two numbers do not overflow


class Energy(Protocol):
    """Anything that assigns sites on an embedded surface an energy with a gradient."""

    def evaluate(self, voronoi: RestrictedVoronoi, sites: Sites, /) -> EnergyValue:
        """Return the energy of sites (S, d), its gradient, and mass and energy of each cell."""
        ...


@runtime_checkable
class PreconditionedEnergy(Energy, Protocol):
    """An energy that knows roughly how stiff it is in space around each site, which saves iterations."""

    def inverse_blocks(self, voronoi: RestrictedVoronoi, sites: Sites, /) -> PointTensors | None:
        """Return symmetric positive definite matrices (S, 3, 3), or None for unit matrices.

        They stand for the inverse of the Hessian by each site in space, over twice the mass of its cell.
        """
        ...


def evaluate_energy(energy: Energy, voronoi: RestrictedVoronoi, sites: Sites) -> EnergyValue:
    """Return the value of an energy for sites (S, d) after validation, in arrays of its own.

    Raises
    ------
    OptionError
        If it is not an :class:`~anisomesh.voronoi.restricted.EnergyValue`, a shape is wrong, a number is not finite or
        not real, or a mass is negative.
    """
    found = energy.evaluate(voronoi, sites)
    if not isinstance(found, EnergyValue):
        raise OptionError(f"the energy returned {type(found).__name__}; expected an EnergyValue")
    n = len(sites)
    value = _finite("value", found.value, ())
    gradient = _finite("gradient", found.gradient, sites.shape)
    mass, per_cell = _finite("mass", found.mass, (n,)), _finite("per_cell", found.per_cell, (n,))
    if n and mass.min() < 0.0:
        raise OptionError(f"mass[{np.argmin(mass)}] of the energy is {mass.min():g}; expected no negative mass")
    return EnergyValue(value=float(value), gradient=gradient, mass=mass, per_cell=per_cell)


def inverse_blocks(energy: Energy, voronoi: RestrictedVoronoi, sites: Sites) -> PointTensors | None:
    """Return the blocks (S, 3, 3) of an energy for sites (S, d) after validation, None if it has none.

    Raises
    ------
    OptionError
        If the shape is wrong, or a number is not finite or not real.
    """
    blocks = energy.inverse_blocks(voronoi, sites) if isinstance(energy, PreconditionedEnergy) else None
    return None if blocks is None else _finite("inverse_blocks", blocks, (len(sites), 3, 3))


def _finite(name: str, values: Any, shape: tuple[int, ...]) -> npt.NDArray[np.float64]:
    """Return a field of an energy as a new array after validation."""
    array = real_array(f"{name} of the energy", values, shape, OptionError)
    if not (np.abs(array) < _LARGEST_NUMBER).all():
        raise OptionError(f"{name} of the energy has a number that is not finite or above {_LARGEST_NUMBER:g}")
    return array


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
        if not (np.isfinite(real_number("sharpness", self.sharpness)) and self.sharpness >= 1.0):
            raise OptionError(f"sharpness = {self.sharpness}; expected a finite number of at least 1 (the plain CVT)")

    def evaluate(self, voronoi: RestrictedVoronoi, sites: Sites, /) -> EnergyValue:
        """Return the energy of sites (S, d), its gradient, and mass and energy of each cell."""
        return voronoi.integrate(sites, self.sharpness)

    def inverse_blocks(self, voronoi: RestrictedVoronoi, sites: Sites, /) -> PointTensors | None:
        """Return approximately the inverse of the Hessian over twice the mass of each cell, in space (S, 3, 3).

        Returns
        -------
        ndarray or None
            The inverse of I + ((c s)^2 - 1) times the mean of N N^t over the cell, c = .35; None for s up to 1 / c.

        Notes
        -----
        With cells that stay as they are the Hessian of the energy is the sum of 2 A (I + (s^2 - 1) N N^t) over the
        polygons of a cell. The cells do not stay: their boundaries give way to a large part of the stiffness along the
        normals, which the factor c, found on training meshes, allows for.
        """
        stiffness = (_STIFFNESS_SHARE * self.sharpness) ** 2 - 1.0
        if stiffness <= 0.0:
            return None
        diagram = voronoi.diagram(sites)
        surface = voronoi.embedded.surface
        area = diagram.fractions * surface.face_areas[diagram.facet]
        normal = surface.face_normals[diagram.facet]
        total = np.maximum(np.bincount(diagram.site, area, minlength=len(sites)), np.finfo(float).tiny)
        blocks = np.tile(np.eye(3), (len(sites), 1, 1))
        for i, j in np.ndindex(3, 3):
            share = np.bincount(diagram.site, area * normal[:, i] * normal[:, j], minlength=len(sites)) / total
            blocks[:, i, j] += stiffness * share
        return np.asarray(np.linalg.inv(blocks))
