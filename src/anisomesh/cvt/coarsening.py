"""Fewer sites from many: the start of a coarser level of detail."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from anisomesh._arrays import Floats, Sites, SiteScalars
from anisomesh.cvt.energy import Energy, evaluate_energy
from anisomesh.cvt.lloyd import lloyd
from anisomesh.voronoi.restricted import RestrictedVoronoi

_FREE_DISTANCE = 2.0  # spacings of the sites that are left, from which on a neighbour costs nothing; Yuksel 2015
_POWER = 8  # of the price; the same
_NEIGHBOURS = 4.0  # neighbours looked at for each site that a remaining one stands for, beside a few; heuristic
_LEAST_NEIGHBOURS = 8
_SETTLING_STEPS = 2  # of Lloyd's algorithm before the energy is known well enough; heuristic
_LEAST_SHARE, _LEAST_AREA = 0.05, 1e-6  # of the mean, for cells that have no energy or no area; heuristics
_MAX_SHARE = 0.2  # of the sites that go at once, so that the price of the others is known; heuristic

Ints = npt.NDArray[np.int64]


def spread_subset(
    voronoi: RestrictedVoronoi,
    sites: Sites,
    n: int,
    energy: Energy | None = None,
    mass: SiteScalars | None = None,
) -> Sites:
    """Return n of some sites (n, d), spread evenly in proportion to the distances that they should have.

    Parameters
    ----------
    voronoi
        The diagram over the embedded surface.
    sites
        Positions (S, d).
    n
        How many are left, at most S.
    energy
        If given, they are denser where cells of that many sites have more of this energy for their size, as in
        :func:`~anisomesh.cvt.sampling.resample_by_energy`; else where the sites are denser.
    mass
        Masses of the cells (S,) of the sites, if they are known.

    Notes
    -----
    The sites that crowd others most are removed. The price of a site is the sum of (1 - l / 2)^8 over its neighbours at
    the distance l, in local spacings of the sites that are left. In a round those go whose price is larger than the
    prices of all their neighbours, the dearest first.

    References
    ----------
    Yuksel, "Sample elimination for generating Poisson disk sample sets", 2015 (the price; there in one queue).
    """
    if n >= len(sites):
        return sites
    mass = voronoi.integrate(sites).mass if mass is None else mass
    chosen = sites[_eliminated(sites, _spacings(mass, n / len(sites)), n)]
    if energy is None:
        return chosen
    chosen = lloyd(voronoi, chosen, _SETTLING_STEPS)
    value = evaluate_energy(energy, voronoi, chosen)
    wanted = np.sqrt(np.maximum(value.per_cell, 0.0))
    share = np.maximum(wanted / wanted.mean(), _LEAST_SHARE)
    spacing = _spacings(value.mass / share, 1.0)
    return np.asarray(sites[_eliminated(sites, spacing[cKDTree(chosen).query(sites)[1]], n)])


def _spacings(area: Floats, share: float) -> Floats:
    """Return the distances (S,) of sites in equilateral triangles from the areas of their cells, if a share is left."""
    least = area.mean() * _LEAST_AREA
    return np.asarray(np.sqrt(np.maximum(area, least) * (2.0 / np.sqrt(3.0)) / share))


def _eliminated(sites: Sites, spacing: Floats, n: int) -> Ints:
    """Return which n of the sites (S, d) are left, of the wanted distances (S,)."""
    count = len(sites)
    k = min(count - 1, _LEAST_NEIGHBOURS + round(_NEIGHBOURS * count / n))
    distance, other = cKDTree(sites).query(sites, k + 1)
    one, other, distance = np.repeat(np.arange(count), k + 1), other.ravel(), distance.ravel()
    _, first = np.unique(np.minimum(one, other) * count + np.maximum(one, other), return_index=True)
    first = first[one[first] != other[first]]
    one, other, distance = one[first], other[first], distance[first]
    price = np.maximum(1.0 - distance / (0.5 * _FREE_DISTANCE * (spacing[one] + spacing[other])), 0.0) ** _POWER
    return _left(count, n, one, other, price)


def _left(count: int, n: int, one: Ints, other: Ints, price: Floats) -> Ints:
    """Return which n of the sites (n,) are left, in their order, from the prices (p,) of pairs of them."""
    stays = np.ones(count, dtype=bool)
    n_left = count
    while n_left > n:
        total = np.bincount(one, price, minlength=count) + np.bincount(other, price, minlength=count)
        total = np.where(stays, total, -1.0)
        rank = np.empty(count, dtype=np.int64)
        order = np.argsort(-total, kind="stable")
        rank[order] = np.arange(count)
        largest = np.full(count, count, dtype=np.int64)  # rank of the dearest neighbour
        np.minimum.at(largest, one, rank[other])
        np.minimum.at(largest, other, rank[one])
        peaks = order[:n_left][(rank < largest)[order[:n_left]]]
        gone = peaks[: max(1, min(n_left - n, round(_MAX_SHARE * n_left)))]
        stays[gone] = False
        n_left -= len(gone)
        alive = stays[one] & stays[other]
        one, other, price = one[alive], other[alive], price[alive]
    return np.flatnonzero(stays)
