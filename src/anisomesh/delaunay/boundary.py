"""Sites that the dual needs at the boundary: one interval per cell component, three per boundary loop."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import EmbeddedPoints
from anisomesh.features.boundary import BoundaryLoops
from anisomesh.voronoi.cells import CellComplex
from anisomesh.voronoi.intervals import BoundaryIntervals, nearest_to_sites

MIN_INTERVALS = 3  # of a boundary loop, so that the dual has a loop there


def points_on_boundary(intervals: BoundaryIntervals, loops: BoundaryLoops, cells: CellComplex) -> EmbeddedPoints:
    """Return points of the boundary (n, d) that are missing as sites.

    A component of a cell with several boundary intervals would pinch the dual, and a boundary loop of fewer than three
    intervals has no loop in it. New sites go to the intervals of such a cell, except for the one nearest to its site,
    at the point closest to the site: so near the tip of a wedge sites on its two sides become opposite each other. They
    also go to the quarter points of the longest interval of such a loop, and to corners that share their interval with
    others.
    """
    sites = cells.diagram.sites
    component = cells.of_polygon[intervals.polygon]
    distance = np.linalg.norm(sites[intervals.site] - intervals.place, axis=1)
    order = np.lexsort((distance, component))
    further = order[1:][component[order[1:]] == component[order[:-1]]]
    few = np.flatnonzero(np.bincount(intervals.polyline, minlength=loops.n_polylines) < MIN_INTERVALS)
    order = np.lexsort((intervals.length, intervals.polyline))
    longest = order[np.searchsorted(intervals.polyline[order], few, side="right") - 1]
    quarters = [loops.at(intervals.start[longest] + share * intervals.length[longest], few) for share in (0.25, 0.75)]
    return np.concatenate([nearest_to_sites(intervals, loops, further, sites), *quarters, intervals.crowded_corners])
