"""The arcs into which cells cut the boundary of the surface, and sites that stay on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Points, Sites
from anisomesh.cvt.diagram import Diagram
from anisomesh.cvt.optimise import lloyd
from anisomesh.cvt.voronoi import RestrictedVoronoi
from anisomesh.surface.boundary import BoundaryCurves, boundary_curves
from anisomesh.surface.features import sharp_edges
from anisomesh.surface.mesh import Surface

_LONG = 0.4  # of the distance between sites: a cell with a longer arc gets its site onto the boundary
_REACH = 0.75  # of the distance between sites: over which the turn of a corner is measured
_SAME = 1e-6  # of the distance between sites: a site so near to a corner is the corner
_STEPS = 5  # Lloyd steps after which the sites on the boundary are spread

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Arcs:
    """Pieces of the boundary curves in one cell each: A of them, along the curves.

    Attributes
    ----------
    site
        Site of each arc (A,).
    polygon
        A polygon of the diagram at each arc (A,).
    curve
        Boundary curve of each arc (A,).
    start, end
        Running arc length at its ends (A,); the end is past that of the curve where the arc goes over it.
    corner
        The sharpest corner in each arc, as a number among those of the boundary (A,), -1 for none.
    place
        The corner, or else the middle of the arc (A, d).
    second
        Corners that share their arc with others and have no site (n, d).
    """

    site: Ints
    polygon: Ints
    curve: Ints
    start: Floats
    end: Floats
    corner: Ints
    place: Points
    second: Points

    @property
    def length(self) -> Floats:
        """Length of each arc (A,) in the embedding."""
        return np.asarray(self.end - self.start)


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
    crease_angle
        Where edges whose faces differ by more than this many degrees end at the boundary there is a corner.
    """

    def __init__(self, voronoi: RestrictedVoronoi, surface: Surface, n_sites: int, crease_angle: float) -> None:
        self.curves: BoundaryCurves = boundary_curves(voronoi.points, surface.faces, surface.face_neighbours)
        self.spacing = float(np.sqrt(2.0 * voronoi.facets.area.sum() / (np.sqrt(3.0) * n_sites)))
        ends = np.unique(surface.edges[sharp_edges(surface, crease_angle)]).astype(np.int64)
        self.corners, self._turns = self.curves.corners(_REACH * self.spacing, ends)

    def arcs(self, diagram: Diagram) -> Arcs:
        """Return the arcs of a diagram over the surface, of each curve in order of their starts."""
        curves = self.curves
        polygon, side, share = self._segments(diagram)
        length = curves.start[side + 1] - curves.start[side]
        place = curves.start[side, None] + share * length[:, None]
        site, curve = diagram.site[polygon].astype(np.int64), curves.curve[side]
        first = np.flatnonzero(_changes(site) | _changes(curve))
        last = np.append(first[1:], len(site))[: len(first)] - 1
        site, curve, polygon = site[first], curve[first], polygon[first]
        start, end = place[first, 0], place[last, 1]
        # the first and the last arc of a curve are one where they have the same site
        head = np.flatnonzero(_changes(curve))
        tail = np.append(head[1:], len(curve))[: len(head)] - 1
        joined = (head != tail) & (site[head] == site[tail])
        end[tail[joined]] += (end - start)[head[joined]]
        kept = np.ones(len(site), dtype=bool)
        kept[head[joined]] = False
        site, polygon, curve = site[kept], polygon[kept], curve[kept]
        start, end = start[kept], end[kept]
        arc = self._arcs_of_corners(curve, start)
        corner = np.full(len(site), -1, dtype=np.int64)
        order = np.argsort(self._turns, kind="stable")
        corner[arc[order]] = order  # of several the sharpest, the last, stays
        crowded = np.flatnonzero(np.bincount(arc, minlength=len(site))[arc] > 1)
        at_corner = curves.positions[curves.point[self.corners]]
        away = np.linalg.norm(at_corner[crowded] - diagram.sites[site[arc[crowded]]], axis=1) > _SAME * self.spacing
        place = curves.at(0.5 * (start + end), curve)
        place[corner >= 0] = at_corner[corner[corner >= 0]]
        return Arcs(
            site=site,
            polygon=polygon,
            curve=curve,
            start=start,
            end=end,
            corner=corner,
            place=place,
            second=at_corner[crowded[away]],
        )

    def _segments(self, diagram: Diagram) -> tuple[Ints, Ints, Floats]:
        """Return polygon (n,), side of the boundary (n,) and share of the side (n, 2) of the pieces in their order."""
        edge = np.flatnonzero(diagram.label < 0)
        opposite = -1 - diagram.label[edge].astype(np.int64)
        side = self.curves.rank[diagram.facet[diagram.polygon_of[edge]], opposite]
        edge, opposite, side = edge[side >= 0], opposite[side >= 0], side[side >= 0]
        ahead = (opposite + 2) % 3
        ends = edge, diagram.following[edge]
        share = np.stack([diagram.barycentric[end, ahead] for end in ends], axis=1)
        order = np.lexsort((share[:, 1], share[:, 0], side))
        return diagram.polygon_of[edge[order]].astype(np.int64), side[order], share[order]

    def draw(self, voronoi: RestrictedVoronoi, sites: Sites, on_boundary: Mask) -> tuple[Sites, Mask]:
        """Return the sites (S, d) with those of cells at the boundary on it, and which these are (S,).

        Parameters
        ----------
        voronoi
            The diagram over the embedded surface.
        sites
            Positions (S, d).
        on_boundary
            Which of them are there already (S,). Others go there if they have a long arc.

        Notes
        -----
        A site on the boundary is in the middle of its arc, or at the corner in it: Lloyd's algorithm on a curve.
        """
        arcs = self.arcs(voronoi.diagram(sites))
        order = np.lexsort((arcs.length, arcs.site))
        longest = order[_changes(arcs.site[order][::-1])[::-1]]
        chosen = longest[on_boundary[arcs.site[longest]] | (arcs.length[longest] > _LONG * self.spacing)]
        drawn, mask = np.array(sites), np.zeros(len(sites), dtype=bool)
        drawn[arcs.site[chosen]] = arcs.place[chosen]
        mask[arcs.site[chosen]] = True
        return drawn, mask

    def spread(self, voronoi: RestrictedVoronoi, sites: Sites, on_boundary: Mask) -> tuple[Sites, Mask]:
        """Return the same after a few steps of Lloyd's algorithm, on the boundary and within."""
        for _ in range(_STEPS):
            sites, on_boundary = self.draw(voronoi, sites, on_boundary)
            sites = lloyd(voronoi, sites, 1, fixed=on_boundary)
        return self.draw(voronoi, sites, on_boundary)

    def _arcs_of_corners(self, curve: Ints, start: Floats) -> Ints:
        """Return the arc that holds each corner, given curve and start of the arcs (A,)."""
        corner_curve = self.curves.curve[self.corners]
        last = np.searchsorted(curve, corner_curve, side="right") - 1  # it may go over the end of the curve
        before = np.searchsorted(start, self.curves.start[self.corners], side="right") - 1
        return np.where((before >= 0) & (curve[before] == corner_curve), before, last)


def _changes(labels: Ints) -> Mask:
    """Return where a label (n,) is not that of the one before; the first counts as such."""
    return np.append(True, labels[1:] != labels[:-1])[: len(labels)]
