"""The intervals into which the cells of a diagram cut the feature polylines of its surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EmbeddedPoints, Points, Sites
from anisomesh._groups import first_of_each
from anisomesh.features.network import FeatureNetwork
from anisomesh.features.polylines import FeaturePolylines, Floats, Ints
from anisomesh.voronoi.diagram import Diagram

LONG_INTERVAL = 0.4  # site spacings; a cell with a longer interval of a feature belongs to it; heuristic
SAME_PLACE = 1e-6  # site spacings; places so near to each other are one: well above rounding, far below an edge
_INTERVAL_SAMPLES = 32  # points of an interval among which the closest to a site is sought

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class CellIntervals:
    """A intervals of polylines, each in one cell, in their order along the polylines.

    Attributes
    ----------
    site
        Site of each interval (A,).
    polygon
        A polygon of the diagram at each interval (A,).
    polyline
        Polyline of each interval (A,).
    start, end
        Arc length at its ends (A,); the end of an interval over the seam of a closed polyline exceeds the polyline's.
    place
        Where a site on the interval goes (A, d): the middle.
    """

    site: Ints
    polygon: Ints
    polyline: Ints
    start: Floats
    end: Floats
    place: Points

    @property
    def length(self) -> Floats:
        """Length of each interval (A,) in the embedding."""
        return np.asarray(self.end - self.start)


@dataclass(frozen=True, eq=False)
class BoundaryIntervals(CellIntervals):
    """Intervals of the boundary and the corners in them.

    Attributes
    ----------
    place
        The sharpest corner in the interval, or else its middle (A, d).
    corner
        That corner as a number among the corners of the boundary (A,), -1 for none.
    crowded_corners
        Corners that share their interval with a sharper one and are not at its site (n, d).
    """

    corner: Ints
    crowded_corners: Points


@dataclass(frozen=True, eq=False)
class CreaseIntervals(CellIntervals):
    """Intervals of creases.

    Attributes
    ----------
    corners
        Points of the surface that are corners at the start and end of each interval (A, 2), -1 for none.
    """

    corners: Ints

    def corner_owners(self) -> tuple[Ints, Ints]:
        """Return an interval at each corner (n,), and the corner (n,)."""
        interval, end = np.nonzero(self.corners >= 0)
        point, first = np.unique(self.corners[interval, end], return_index=True)
        return interval[first], point


def cell_intervals(polylines: FeaturePolylines, diagram: Diagram) -> CellIntervals:
    """Return the intervals into which the cells of a diagram cut polylines on its surface."""
    polygon, segment, share = _pieces(polylines, diagram)
    length = polylines.start[segment + 1] - polylines.start[segment]
    place = polylines.start[segment, None] + share * length[:, None]
    site, polyline = diagram.site[polygon].astype(np.int64), polylines.polyline[segment]
    first = np.flatnonzero(starts_run(site) | starts_run(polyline))
    last = np.append(first[1:], len(site))[: len(first)] - 1
    site, polyline, polygon = site[first], polyline[first], polygon[first]
    start, end = place[first, 0], place[last, 1]
    # the first and the last interval of a closed polyline are one if they have the same site
    head = np.flatnonzero(starts_run(polyline))
    tail = np.append(head[1:], len(polyline))[: len(head)] - 1
    joined = (head != tail) & (site[head] == site[tail]) & polylines.closed[polyline[head]]
    end[tail[joined]] += (end - start)[head[joined]]
    kept = np.ones(len(site), dtype=bool)
    kept[head[joined]] = False
    site, polygon, polyline, start, end = site[kept], polygon[kept], polyline[kept], start[kept], end[kept]
    place = polylines.at(0.5 * (start + end), polyline)
    return CellIntervals(site=site, polygon=polygon, polyline=polyline, start=start, end=end, place=place)


def boundary_intervals(features: FeatureNetwork, diagram: Diagram) -> BoundaryIntervals:
    """Return the intervals of the boundary loops, with the corners in them."""
    loops, corner_segments = features.boundary, features.boundary_corners
    intervals = cell_intervals(loops, diagram)
    of_corner = _intervals_at(loops, corner_segments, intervals)
    corner = np.full(len(intervals.site), -1, dtype=np.int64)
    owner, sharpest = first_of_each(of_corner, np.argsort(features.boundary_turns, kind="stable")[::-1])
    corner[owner] = sharpest
    crowded = np.flatnonzero(np.bincount(of_corner, minlength=len(intervals.site))[of_corner] > 1)
    at_corner = loops.positions[loops.tail[corner_segments]]
    away = np.linalg.norm(at_corner[crowded] - diagram.sites[intervals.site[of_corner[crowded]]], axis=1)
    place = intervals.place.copy()
    place[corner >= 0] = at_corner[corner[corner >= 0]]
    crowded_corners = at_corner[crowded[away > SAME_PLACE * features.spacing]]
    return BoundaryIntervals(**(vars(intervals) | {"place": place}), corner=corner, crowded_corners=crowded_corners)


def crease_intervals(features: FeatureNetwork, diagram: Diagram) -> CreaseIntervals:
    """Return the intervals of the creases, with the corners at their ends."""
    intervals = cell_intervals(features.creases, diagram)
    first = starts_run(intervals.polyline)
    last = np.append(first[1:], True)[: len(first)]
    at_end = np.stack([first, last], axis=1)
    corners = np.where(at_end, features.creases.ends[intervals.polyline], -1)
    return CreaseIntervals(**vars(intervals), corners=corners)


def nearest_to_sites(
    intervals: CellIntervals, polylines: FeaturePolylines, which: Ints, sites: Sites
) -> EmbeddedPoints:
    """Return the points (n, d) of some intervals (n,) that are closest to their sites, to 1/32 of the interval."""
    shares = (np.arange(_INTERVAL_SAMPLES) + 0.5) / _INTERVAL_SAMPLES
    places = intervals.start[which, None] + shares * intervals.length[which, None]
    points = polylines.at(places.ravel(), np.repeat(intervals.polyline[which], _INTERVAL_SAMPLES))
    points = points.reshape(len(which), _INTERVAL_SAMPLES, sites.shape[1])
    distance = np.linalg.norm(points - sites[intervals.site[which], None], axis=2)
    return np.asarray(points[np.arange(len(which)), np.argmin(distance, axis=1)])


def starts_run(labels: Ints) -> Mask:
    """Return where labels (n,) differ from the label before; the first one counts as different."""
    return np.append(True, labels[1:] != labels[:-1])[: len(labels)]


def _intervals_at(polylines: FeaturePolylines, segments: Ints, intervals: CellIntervals) -> Ints:
    """Return the interval that holds the start of each of these segments (n,)."""
    polyline = polylines.polyline[segments]
    last = np.searchsorted(intervals.polyline, polyline, side="right") - 1  # it may go over the end of the polyline
    before = np.searchsorted(intervals.start, polylines.start[segments], side="right") - 1
    return np.where((before >= 0) & (intervals.polyline[before] == polyline), before, last)


def _pieces(polylines: FeaturePolylines, diagram: Diagram) -> tuple[Ints, Ints, Floats]:
    """Return polygon (n,), segment (n,) and shares of the segment (n, 2) of the pieces of segments, in their order."""
    edge = np.flatnonzero(diagram.label < 0)
    opposite = -1 - diagram.label[edge].astype(np.int64)
    segment = polylines.segment_of_side[diagram.facet[diagram.polygon_of[edge]], opposite]
    edge, opposite, segment = edge[segment >= 0], opposite[segment >= 0], segment[segment >= 0]
    facet = diagram.facet[diagram.polygon_of[edge]]
    second = (opposite + 2) % 3  # the corner that a walk around the facet comes to
    against = diagram.faces[facet, second] != polylines.head[segment]
    head = np.where(against, (opposite + 1) % 3, second)
    share = np.stack([diagram.barycentric[end, head] for end in (edge, diagram.following[edge])], axis=1)
    share[against] = share[against, ::-1]
    order = np.lexsort((share[:, 1], share[:, 0], segment))
    return diagram.polygon_of[edge[order]].astype(np.int64), segment[order], share[order]
