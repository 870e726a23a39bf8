"""Sites on the boundary of the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh._arrays import Points, Sites
from anisomesh.features.boundary import BoundaryCurves, boundary_curves
from anisomesh.features.polylines import Floats, Ints
from anisomesh.mesh.surface import Surface
from anisomesh.voronoi.diagram import Diagram
from anisomesh.voronoi.intervals import Arcs, Mask, arcs_of
from anisomesh.voronoi.restricted import RestrictedVoronoi

_REACH = 0.75  # of the distance between sites: over which the turn of a corner is measured
_SAME = 1e-6  # of the distance between sites: a site so near to a corner is the corner


@dataclass(frozen=True, eq=False)
class BoundaryArcs(Arcs):
    """Arcs of the boundary and the corners in them.

    Attributes
    ----------
    place
        The sharpest corner in the arc, or else its middle (A, d).
    corner
        That corner as a number among those of the boundary (A,), -1 for none.
    second
        Corners that share their arc with others and have no site (n, d).
    """

    corner: Ints
    second: Points


class Boundary:
    """The boundary of an embedded surface, for cells of about one size.

    Parameters
    ----------
    voronoi
        The diagram over the embedded surface.
    surface
        The surface in space, its faces in the order of ``voronoi``.
    n_sites
        Number of sites that the surface is divided among; it says how far apart corners are.
    creases
        Which edges of the surface (E,) are on a crease; where one meets the boundary there is a corner.
    """

    def __init__(self, voronoi: RestrictedVoronoi, surface: Surface, n_sites: int, creases: Mask) -> None:
        self.curves: BoundaryCurves = boundary_curves(voronoi.points, surface)
        self.spacing = float(np.sqrt(2.0 * voronoi.facets.area.sum() / (np.sqrt(3.0) * n_sites)))
        ends = np.unique(surface.edges[creases]).astype(np.int64)
        self.corners, self._turns = self.curves.corners(_REACH * self.spacing, ends)

    def arcs(self, diagram: Diagram) -> BoundaryArcs:
        """Return the arcs of a diagram over the surface, of each curve in order of their starts."""
        curves, arcs = self.curves, arcs_of(self.curves, diagram)
        arc = self._arcs_of_corners(arcs.curve, arcs.start)
        corner = np.full(len(arcs.site), -1, dtype=np.int64)
        order = np.argsort(self._turns, kind="stable")
        corner[arc[order]] = order  # of several the sharpest, the last, stays
        crowded = np.flatnonzero(np.bincount(arc, minlength=len(arcs.site))[arc] > 1)
        at_corner = curves.positions[curves.point[self.corners]]
        away = np.linalg.norm(at_corner[crowded] - diagram.sites[arcs.site[arc[crowded]]], axis=1)
        place = arcs.place.copy()
        place[corner >= 0] = at_corner[corner[corner >= 0]]
        second = at_corner[crowded[away > _SAME * self.spacing]]
        return BoundaryArcs(**(vars(arcs) | {"place": place}), corner=corner, second=second)

    def draw(self, diagram: Diagram, on_boundary: Mask) -> tuple[Sites, Mask]:
        """Return the sites (S, d) with those of cells at the boundary on it, and which these are (S,).

        Parameters
        ----------
        diagram
            The diagram of the sites.
        on_boundary
            Which of them are there already (S,). Others go there if they have a long arc.

        Notes
        -----
        A site on the boundary is in the middle of its longest arc, or at the corner in it.
        """
        return self.arcs(diagram).draw(diagram.sites, on_boundary, self.spacing)

    def _arcs_of_corners(self, curve: Ints, start: Floats) -> Ints:
        """Return the arc that holds each corner, given curve and start of the arcs (A,)."""
        corner_curve = self.curves.curve[self.corners]
        last = np.searchsorted(curve, corner_curve, side="right") - 1  # it may go over the end of the curve
        before = np.searchsorted(start, self.curves.start[self.corners], side="right") - 1
        return np.where((before >= 0) & (curve[before] == corner_curve), before, last)
