"""Moving sites from where they matter least to where the dual mesh misses the surface."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from anisomesh._arrays import EmbeddedPoints, PointScalars
from anisomesh.cvt.constraints import ConstrainedSites
from anisomesh.cvt.energy import Energy, evaluate_energy
from anisomesh.voronoi.restricted import RestrictedVoronoi

# heuristics, chosen on procedural parts and training meshes
_MAX_RELOCATED_SHARE = 0.02  # of the sites that go to missed points at once
_MISSED_FACTOR = 4.0  # times the mean squared distance, from which on a point counts as missed
_MAX_CREASE_SHARE = 0.2  # of the free sites that go to creases at once
_CANDIDATES_PER_SITE = 20  # candidates looked at for each site relocated


def relocate_to_missed_points(
    voronoi: RestrictedVoronoi, sites: ConstrainedSites, energy: Energy, squared_errors: PointScalars
) -> ConstrainedSites:
    """Return as many sites, some of them moved to points of the surface that the dual mesh misses.

    Parameters
    ----------
    voronoi
        The diagram over the embedded surface.
    sites
        Optimised sites; sites on features stay.
    energy
        The energy by which the least important sites are found.
    squared_errors
        Squared distance of each point of the surface to the dual mesh (V,).

    Notes
    -----
    Descent moves sites within their neighbourhood; a corner or the end of a crease that no site has come near stays
    missed. The new positions are the points farthest from the dual, no two in one cell; the sites of lowest energy, no
    two of them neighbours, move there.
    """
    points, positions = voronoi.embedded.points, sites.positions
    spacing = float(np.sqrt(voronoi.embedded.area / len(positions)))
    n = max(1, int(_MAX_RELOCATED_SHARE * len(positions)))
    new = _spaced(points, np.argsort(-squared_errors, kind="stable"), n, spacing)
    new = new[squared_errors[new] > _MISSED_FACTOR * squared_errors.mean()]
    old = _spaced(positions, _least_important(voronoi, sites, energy), len(new), 2.0 * spacing)
    moved = np.array(positions)
    moved[old] = points[new[: len(old)]]
    return sites.moved(moved)


def relocate_to_creases(
    voronoi: RestrictedVoronoi, sites: ConstrainedSites, energy: Energy, missing: EmbeddedPoints
) -> ConstrainedSites:
    """Return as many sites, some of them moved to places on creases that lack a site (m, d), most important first."""
    order = _least_important(voronoi, sites, energy)
    n = min(len(missing), int(_MAX_CREASE_SHARE * len(order)))
    spacing = float(np.sqrt(voronoi.embedded.area / len(sites.positions)))
    old = _spaced(sites.positions, order, n, spacing)
    moved, on_crease = np.array(sites.positions), np.array(sites.on_crease)
    moved[old], on_crease[old] = missing[: len(old)], True
    return ConstrainedSites(moved, sites.on_boundary, on_crease)


def _least_important(voronoi: RestrictedVoronoi, sites: ConstrainedSites, energy: Energy) -> npt.NDArray[np.int64]:
    """Return the free sites (n,), the one with the least energy in its cell first."""
    order = np.argsort(evaluate_energy(energy, voronoi, sites.positions).per_cell, kind="stable")
    return np.asarray(order[~sites.fixed[order]])


def _spaced(
    positions: npt.NDArray[np.float64], order: npt.NDArray[np.int64], n: int, distance: float
) -> npt.NDArray[np.int64]:
    """Return the first n positions (m, d) in an order of preference that keep a distance from each other."""
    pool = order[: _CANDIDATES_PER_SITE * n]
    tree = cKDTree(positions[pool])
    blocked = np.zeros(len(pool), dtype=bool)
    chosen: list[int] = []
    for k in range(len(pool)):
        if len(chosen) == n:
            break
        if not blocked[k]:
            chosen.append(k)
            blocked[tree.query_ball_point(positions[pool[k]], distance)] = True
    return np.asarray(pool[np.array(chosen, dtype=np.int64)])
