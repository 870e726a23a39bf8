"""The dual at the boundary: cells with one arc each, and their vertices on the boundary."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import EmbeddedPoints, PointMask, Points, Sites
from anisomesh.cvt.boundary import BoundaryArcs
from anisomesh.features.boundary import BoundaryCurves
from anisomesh.voronoi.cells import Cells
from anisomesh.voronoi.intervals import nearest_to_sites

MIN_ARCS = 3  # of a boundary curve, so that the dual has a loop there


def points_on_boundary(arcs: BoundaryArcs, curves: BoundaryCurves, cells: Cells, sites: Sites) -> EmbeddedPoints:
    """Return points of the boundary (n, d) that are missing as sites.

    A component of a cell with several arcs would pinch the dual, and a boundary curve of fewer than three arcs has no
    loop in it. New sites go to the arcs of such a cell but the one nearest to its site, at the point closest to the
    site: so near the tip of a wedge sites on its sides come to be opposite each other. They also go to the quarter
    points of the longest arc of such a curve, and to corners that share their arc with others.
    """
    component = cells.of_polygon[arcs.polygon]
    distance = np.linalg.norm(sites[arcs.site] - arcs.place, axis=1)
    order = np.lexsort((distance, component))
    torn = order[1:][component[order[1:]] == component[order[:-1]]]
    few = np.flatnonzero(np.bincount(arcs.curve, minlength=curves.n_curves) < MIN_ARCS)
    order = np.lexsort((arcs.length, arcs.curve))
    longest = order[np.searchsorted(arcs.curve[order], few, side="right") - 1]
    quarters = [curves.at(arcs.start[longest] + share * arcs.length[longest], few) for share in (0.25, 0.75)]
    return np.concatenate([nearest_to_sites(arcs, curves, torn, sites), *quarters, arcs.second])


def put_on_boundary(points: Points, arcs: BoundaryArcs, cells: Cells) -> tuple[Points, PointMask]:
    """Return the vertices of the dual (V, d), those of cells at the boundary on their arcs, and which these are (V,).

    The vertex goes to the sharpest corner in the arc, or else to the middle of it; of several arcs the longest counts.
    """
    component = cells.of_polygon[arcs.polygon]
    order = np.argsort(arcs.length, kind="stable")
    moved, mask = np.array(points), np.zeros(len(points), dtype=bool)
    moved[component[order]] = arcs.place[order]
    mask[component] = True
    return moved, mask
