"""Topology control: sites are added until the dual is homeomorphic to the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh._arrays import EmbeddedPoints, Sites
from anisomesh.delaunay.boundary import points_on_boundary
from anisomesh.delaunay.creases import CreaseCells, crease_cells
from anisomesh.delaunay.noncontractible_loops import points_on_noncontractible_loops
from anisomesh.delaunay.small_components import points_in_small_components
from anisomesh.features.network import FeatureNetwork
from anisomesh.voronoi.cells import CellComplex, cell_complex
from anisomesh.voronoi.intervals import BoundaryIntervals, boundary_intervals
from anisomesh.voronoi.restricted import RestrictedVoronoi

MAX_INSERTION_ROUNDS = 20  # of new sites; heuristic
MAX_NON_DISK_SHARE = 0.25  # of the cells; with more the sites are too few for this surface
MAX_CREASE_SHARE = 0.5  # of the vertices asked for: sites added on creases
MAX_SITE_FACTOR, MAX_MORE_SITES = 4, 1_000  # largest number of sites: factor times the vertices asked for, and more


@dataclass(frozen=True, eq=False)
class ControlledCells:
    """The cells of sites after topology control.

    Attributes
    ----------
    cells
        The cell components.
    boundary, creased
        What they have of boundary and creases.
    complete
        Whether all are disks with at most one boundary interval, in sufficient number: the conditions under which the
        dual is homeomorphic to the surface (a regular cell complex).
    """

    cells: CellComplex
    boundary: BoundaryIntervals
    creased: CreaseCells
    complete: bool


def control_topology(
    voronoi: RestrictedVoronoi, sites: Sites, features: FeatureNetwork, n_vertices: int
) -> ControlledCells:
    """Return the cells of these sites (S, d) and of as many more as the topology of the surface needs.

    Parameters
    ----------
    voronoi
        The diagram over the embedded surface.
    sites
        Optimised positions (S, d).
    features
        Boundary and creases of the surface.
    n_vertices
        Vertices asked for; it limits the sites that are added on creases.

    References
    ----------
    Edelsbrunner, Shah, "Triangulating topological spaces", 1997 (closed ball property).
    """
    max_sites = MAX_SITE_FACTOR * n_vertices + MAX_MORE_SITES
    room = int(MAX_CREASE_SHARE * n_vertices)
    for _ in range(MAX_INSERTION_ROUNDS):
        cells = cell_complex(voronoi.diagram(sites))
        boundary = boundary_intervals(features, cells.diagram)
        creased = crease_cells(features, cells, boundary)
        missing = _missing_sites(cells, boundary, features)
        non_disk = cells.euler != 1
        complete = len(missing) == 0 and not non_disk.any()
        on_creases = creased.missing[:room]
        stuck = non_disk.mean() > MAX_NON_DISK_SHARE or len(sites) + len(missing) > max_sites
        if len(missing) + len(on_creases) == 0 or stuck:
            break
        room -= len(on_creases)
        sites = np.concatenate([sites, missing, on_creases])
    return ControlledCells(cells, boundary, creased, complete)


def _missing_sites(cells: CellComplex, boundary: BoundaryIntervals, features: FeatureNetwork) -> EmbeddedPoints:
    """Return the points (n, d) that the topology needs as sites."""
    return np.concatenate(
        [
            points_on_noncontractible_loops(cells),
            points_in_small_components(cells),
            points_on_boundary(boundary, features.boundary, cells),
        ]
    )
