"""Sites that stay on the boundary and on the creases of the surface."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Sites
from anisomesh._groups import first_of_each
from anisomesh.cvt.lloyd import lloyd
from anisomesh.features.network import FeatureNetwork
from anisomesh.voronoi.diagram import Diagram
from anisomesh.voronoi.intervals import (
    LONG_INTERVAL,
    BoundaryIntervals,
    CellIntervals,
    boundary_intervals,
    crease_intervals,
)
from anisomesh.voronoi.restricted import RestrictedVoronoi

_SPREADING_STEPS = 5  # Lloyd steps that spread the sites along features; heuristic

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class ConstrainedSites:
    """Sites and which of them are fixed on features.

    Attributes
    ----------
    positions
        Positions (S, d).
    on_boundary, on_crease
        Which sites are on the boundary, and which on a crease (S,).
    """

    positions: Sites
    on_boundary: Mask
    on_crease: Mask

    @classmethod
    def free(cls, positions: Sites) -> ConstrainedSites:
        """Return sites of which none is on a feature."""
        none = np.zeros(len(positions), dtype=bool)
        return cls(positions, none, none)

    @property
    def fixed(self) -> Mask:
        """Which sites (S,) are on a feature."""
        return self.on_boundary | self.on_crease

    def moved(self, positions: Sites) -> ConstrainedSites:
        """Return the sites at other positions (S, d)."""
        return replace(self, positions=positions)


def snap_to_features(features: FeatureNetwork, voronoi: RestrictedVoronoi, sites: ConstrainedSites) -> ConstrainedSites:
    """Return the sites, moved onto boundary and creases where their cells have enough of these.

    Notes
    -----
    A site on a feature goes to the middle of its longest interval, or to the corner in it: Lloyd's algorithm on a
    curve. A site inside moves onto a feature if its cell has an interval longer than .4 site spacings, or a crease
    corner.
    """
    diagram = voronoi.diagram(sites.positions, features.facets)
    boundary = boundary_intervals(features, diagram)
    positions, on_boundary = _onto_intervals(boundary, sites.positions, sites.on_boundary, features.spacing)
    to_crease, on_crease = _onto_creases(features, diagram, sites.on_crease)
    on_crease &= ~on_boundary
    return ConstrainedSites(np.where(on_crease[:, None], to_crease, positions), on_boundary, on_crease)


def spread_on_features(
    features: FeatureNetwork, voronoi: RestrictedVoronoi, sites: ConstrainedSites
) -> ConstrainedSites:
    """Return the sites after a few steps of Lloyd's algorithm, along the features and elsewhere."""
    for _ in range(_SPREADING_STEPS):
        sites = snap_to_features(features, voronoi, sites)
        sites = sites.moved(lloyd(voronoi, sites.positions, 1, fixed=sites.fixed))
    return snap_to_features(features, voronoi, sites)


def _onto_intervals(
    intervals: CellIntervals | BoundaryIntervals, sites: Sites, already: Mask, spacing: float
) -> tuple[Sites, Mask]:
    """Return the sites (S, d), moved to the places of their longest intervals, and which have one (S,)."""
    _, longest = first_of_each(intervals.site, np.lexsort((intervals.length, intervals.site))[::-1])
    chosen = longest[already[intervals.site[longest]] | (intervals.length[longest] > LONG_INTERVAL * spacing)]
    moved, mask = np.array(sites), np.zeros(len(sites), dtype=bool)
    moved[intervals.site[chosen]] = intervals.place[chosen]
    mask[intervals.site[chosen]] = True
    return moved, mask


def _onto_creases(features: FeatureNetwork, diagram: Diagram, already: Mask) -> tuple[Sites, Mask]:
    """Return the sites (S, d), moved to the nearest crease corner in their cells or onto creases, and which (S,)."""
    intervals = crease_intervals(features, diagram)
    moved, mask = _onto_intervals(intervals, diagram.sites, already, features.spacing)
    interval, corner = intervals.corner_owners()
    positions, site = features.creases.positions, intervals.site[interval]
    distance = np.linalg.norm(positions[corner] - diagram.sites[site], axis=1)
    owner, nearest = first_of_each(site, np.argsort(-distance, kind="stable")[::-1])
    moved[owner] = positions[corner[nearest]]
    mask[owner] = True
    return moved, mask
