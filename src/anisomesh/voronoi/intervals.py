"""The arcs into which cells cut curves on the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EmbeddedPoints, Points, Sites
from anisomesh.features.polylines import Curves, Floats, Ints
from anisomesh.voronoi.diagram import Diagram

LONG = 0.4  # of the distance between sites: a cell with a longer arc gets its site onto the curve
_SAMPLES = 32  # of an arc, for the point closest to its site

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Arcs:
    """Pieces of curves in one cell each: A of them, along the curves.

    Attributes
    ----------
    site
        Site of each arc (A,).
    polygon
        A polygon of the diagram at each arc (A,).
    curve
        Curve of each arc (A,).
    start, end
        Running arc length at its ends (A,); the end is past that of the curve where the arc goes over it.
    place
        Its middle (A, d).
    """

    site: Ints
    polygon: Ints
    curve: Ints
    start: Floats
    end: Floats
    place: Points

    @property
    def length(self) -> Floats:
        """Length of each arc (A,) in the embedding."""
        return np.asarray(self.end - self.start)

    def draw(self, sites: Sites, there: Mask, spacing: float) -> tuple[Sites, Mask]:
        """Return the sites (S, d) with those that belong to the curves on them, and which these are (S,).

        Parameters
        ----------
        sites
            Positions (S, d).
        there
            Which of them are on the curves already (S,); others come if they have a long arc.
        spacing
            Distance between sites.

        Notes
        -----
        A site goes to the place of its longest arc: Lloyd's algorithm on a curve.
        """
        order = np.lexsort((self.length, self.site))
        longest = order[changes(self.site[order][::-1])[::-1]]
        chosen = longest[there[self.site[longest]] | (self.length[longest] > LONG * spacing)]
        drawn, mask = np.array(sites), np.zeros(len(sites), dtype=bool)
        drawn[self.site[chosen]] = self.place[chosen]
        mask[self.site[chosen]] = True
        return drawn, mask


def arcs_of(curves: Curves, diagram: Diagram) -> Arcs:
    """Return the arcs that the cells of a diagram cut the curves on its surface into, in order of their starts."""
    polygon, side, share = _segments(curves, diagram)
    length = curves.start[side + 1] - curves.start[side]
    place = curves.start[side, None] + share * length[:, None]
    site, curve = diagram.site[polygon].astype(np.int64), curves.curve[side]
    first = np.flatnonzero(changes(site) | changes(curve))
    last = np.append(first[1:], len(site))[: len(first)] - 1
    site, curve, polygon = site[first], curve[first], polygon[first]
    start, end = place[first, 0], place[last, 1]
    # the first and the last arc of a closed curve are one where they have the same site
    head = np.flatnonzero(changes(curve))
    tail = np.append(head[1:], len(curve))[: len(head)] - 1
    joined = (head != tail) & (site[head] == site[tail]) & curves.closed[curve[head]]
    end[tail[joined]] += (end - start)[head[joined]]
    kept = np.ones(len(site), dtype=bool)
    kept[head[joined]] = False
    site, polygon, curve, start, end = site[kept], polygon[kept], curve[kept], start[kept], end[kept]
    place = curves.at(0.5 * (start + end), curve)
    return Arcs(site=site, polygon=polygon, curve=curve, start=start, end=end, place=place)


def nearest_to_sites(arcs: Arcs, curves: Curves, which: Ints, sites: Sites) -> EmbeddedPoints:
    """Return the point of each of these arcs (n,) that is closest to its site (n, d), within a share of the arc."""
    shares = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    places = arcs.start[which, None] + shares * arcs.length[which, None]
    points = curves.at(places.ravel(), np.repeat(arcs.curve[which], _SAMPLES)).reshape(
        len(which), _SAMPLES, sites.shape[1]
    )
    distance = np.linalg.norm(points - sites[arcs.site[which], None], axis=2)
    return np.asarray(points[np.arange(len(which)), np.argmin(distance, axis=1)])


def _segments(curves: Curves, diagram: Diagram) -> tuple[Ints, Ints, Floats]:
    """Return polygon (n,), side of the curves (n,) and share of the side (n, 2) of the pieces in their order."""
    edge = np.flatnonzero(diagram.label < 0)
    opposite = -1 - diagram.label[edge].astype(np.int64)
    side = curves.rank[diagram.facet[diagram.polygon_of[edge]], opposite]
    edge, opposite, side = edge[side >= 0], opposite[side >= 0], side[side >= 0]
    facet = diagram.facet[diagram.polygon_of[edge]]
    second = (opposite + 2) % 3  # the corner that a walk around the facet comes to
    against = diagram.faces[facet, second] != curves.head[side]
    head = np.where(against, (opposite + 1) % 3, second)
    share = np.stack([diagram.barycentric[end, head] for end in (edge, diagram.following[edge])], axis=1)
    share[against] = share[against, ::-1]
    order = np.lexsort((share[:, 1], share[:, 0], side))
    return diagram.polygon_of[edge[order]].astype(np.int64), side[order], share[order]


def changes(labels: Ints) -> Mask:
    """Return where a label (n,) is not that of the one before; the first counts as such."""
    return np.append(True, labels[1:] != labels[:-1])[: len(labels)]
