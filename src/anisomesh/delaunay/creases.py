"""Cells that belong to creases: where their vertices go, and which edges follow the crease."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from anisomesh._arrays import EmbeddedPoints
from anisomesh._groups import first_of_each
from anisomesh.features.network import FeatureNetwork
from anisomesh.features.polylines import Ints
from anisomesh.voronoi.cells import CellComplex, cell_complex
from anisomesh.voronoi.diagram import Diagram
from anisomesh.voronoi.intervals import (
    LONG_INTERVAL,
    SAME_PLACE,
    CellIntervals,
    CreaseIntervals,
    Mask,
    boundary_intervals,
    crease_intervals,
    nearest_to_sites,
    starts_run,
)

MIN_SITE_DISTANCE = 0.1  # site spacings between a new site and all others; the share from which a site is on a crease
_ON_CREASE_DISTANCE = 0.1  # site spacings: a site so near to a crease belongs to it; heuristic
_MIN_SAGITTA = 1e-3  # of its chord, from which on an interval is curved; heuristic


@dataclass(frozen=True, eq=False)
class CreaseCells:
    """The n cell components that belong to a crease, and where their vertices go.

    Attributes
    ----------
    cell
        Component (n,).
    place
        The crease corner in it, or the middle of its longest interval; at the boundary the place there (n, d).
    chord
        From the start to the end of its longest interval (n, d).
    curved
        Whether that interval is curved (n,); never for required edges that are not creases of the faces.
    corner
        Whether the component is at a corner or at the boundary (n,).
    missing
        Places that need a cell of their own (m, d): further corners, then further long intervals from the longest on,
        but none near a site: each new site would otherwise pull the next one along the crease beside it.
    links
        Components that follow each other on a crease and belong to it (l, 2).
    paths
        Paths of components along a crease of which only the first and the last belong to it.
    """

    cell: Ints
    place: EmbeddedPoints
    chord: EmbeddedPoints
    curved: Mask
    corner: Mask
    missing: EmbeddedPoints
    links: Ints
    paths: list[list[int]]


def missing_on_creases(features: FeatureNetwork, diagram: Diagram) -> EmbeddedPoints:
    """Return the places on creases that lack a site (m, d), most important first."""
    cells = cell_complex(diagram)
    return crease_cells(features, cells, boundary_intervals(features, diagram)).missing


def crease_cells(features: FeatureNetwork, cells: CellComplex, boundary: CellIntervals) -> CreaseCells:
    """Return the cell components that belong to a crease.

    Parameters
    ----------
    features
        The feature network of the surface.
    cells
        The cells of a diagram on it.
    boundary
        The intervals of the boundary in these cells.

    Notes
    -----
    A component belongs to the crease of which it has the longest interval, if that is long or the site is near it; a
    component with a corner belongs to all intervals that end there. Edges of the dual follow a crease from one
    component that belongs to it to the next, unless a component that does not belong to it is in between. Where a
    crease is a part of the boundary all components there belong to it.
    """
    creases, sites = features.creases, cells.diagram.sites
    intervals = crease_intervals(features, cells.diagram)
    component = cells.of_polygon[intervals.polygon].astype(np.int64)
    nearest = nearest_to_sites(intervals, creases, np.arange(len(component)), sites)
    at_boundary = np.zeros(cells.n_components, dtype=bool)
    at_boundary[cells.of_polygon[boundary.polygon]] = True
    own, corner, place = _anchors(features, cells, intervals, boundary, nearest)
    belongs = ((intervals.corners == corner[component][:, None]) & (intervals.corners >= 0)).any(axis=1)
    belongs |= own[component] == np.arange(len(component))
    belongs |= _along_boundary(features, intervals, cells) & at_boundary[component]
    runs = _runs(creases.closed, intervals, belongs)
    links = component[np.array([[run[0], run[-1]] for run in runs], dtype=np.int64).reshape(-1, 2)]
    gaps = [run for run in runs if len(run) > 2]
    interval, point = intervals.corner_owners()
    further = point[(corner[component[interval]] != point) & ~at_boundary[component[interval]]]
    on_intervals = nearest[_long_gaps(intervals, gaps, features.spacing)]
    apart = cKDTree(sites).query(on_intervals)[0] > MIN_SITE_DISTANCE * features.spacing
    cell = np.flatnonzero((own >= 0) | (corner >= 0))
    start, end = (creases.at(at[own[cell]], intervals.polyline[own[cell]]) for at in (intervals.start, intervals.end))
    return CreaseCells(
        cell=cell,
        place=place[cell],
        chord=end - start,
        curved=_curved(features, intervals, own[cell], end - start) & (own[cell] >= 0),
        corner=(corner[cell] >= 0) | at_boundary[cell],
        missing=np.concatenate([creases.positions[further], on_intervals[apart]]),
        links=links[links[:, 0] != links[:, 1]],
        paths=[component[gap].tolist() for gap in gaps],
    )


def _anchors(
    features: FeatureNetwork,
    cells: CellComplex,
    intervals: CreaseIntervals,
    boundary: CellIntervals,
    nearest: EmbeddedPoints,
) -> tuple[Ints, Ints, EmbeddedPoints]:
    """Return the interval of each component (C,), or else its corner (C,), -1 for none, and its vertex place (C, d).

    ``nearest`` are the points of the intervals closest to their sites (A, d). At the boundary the place there counts,
    and the component keeps its corner only if the corner is at that place.
    """
    positions, sites, spacing = features.creases.positions, cells.diagram.sites, features.spacing
    own, corner = np.full((2, cells.n_components), -1, dtype=np.int64)
    place = np.zeros((cells.n_components, positions.shape[1]))
    near = np.linalg.norm(nearest - sites[intervals.site], axis=1) < _ON_CREASE_DISTANCE * spacing
    order = np.argsort(intervals.length, kind="stable")[::-1]
    order = order[((intervals.length > LONG_INTERVAL * spacing) | near)[order]]
    owner, longest = first_of_each(cells.of_polygon[intervals.polygon], order)
    own[owner], place[owner] = longest, intervals.place[longest]
    interval, point = intervals.corner_owners()
    distance = np.linalg.norm(positions[point] - sites[intervals.site[interval]], axis=1)
    order = np.argsort(-distance, kind="stable")[::-1]
    owner, closest = first_of_each(cells.of_polygon[intervals.polygon[interval]], order)
    corner[owner], place[owner] = point[closest], positions[point[closest]]
    order = np.argsort(boundary.length, kind="stable")[::-1]
    at_boundary, longest = first_of_each(cells.of_polygon[boundary.polygon], order)
    place[at_boundary] = boundary.place[longest]
    away = np.linalg.norm(place - positions[corner], axis=1) > SAME_PLACE * spacing
    own[corner >= 0] = -1
    own[at_boundary] = -1
    corner[away] = -1
    return own, corner, place


def _along_boundary(features: FeatureNetwork, intervals: CreaseIntervals, cells: CellComplex) -> Mask:
    """Return which intervals (A,) are on edges of the boundary, as the ones of a border that locked faces left."""
    creases, surface = features.creases, cells.diagram.embedded.surface
    segment = creases.segment_at(0.5 * (intervals.start + intervals.end), intervals.polyline)
    return np.asarray(surface.edge_face_count[creases.edge[segment]] == 1)


def _curved(features: FeatureNetwork, intervals: CreaseIntervals, which: Ints, chord: EmbeddedPoints) -> Mask:
    """Return which of these intervals (n,) deviate from their chords (n, d) in space, on creases of the faces."""
    creases = features.creases
    start = creases.at(intervals.start[which], intervals.polyline[which])
    off = np.linalg.norm(np.cross(intervals.place[which, :3] - start[:, :3], chord[:, :3]), axis=1)
    middle = 0.5 * (intervals.start[which] + intervals.end[which])
    segment = creases.segment_at(middle, intervals.polyline[which])
    long_enough = off > _MIN_SAGITTA * (chord[:, :3] ** 2).sum(axis=1)
    return np.asarray(long_enough & ~features.required[creases.edge[segment]])


def _runs(closed: Mask, intervals: CreaseIntervals, belongs: Mask) -> list[list[int]]:
    """Return runs of intervals along a crease of which only the first and the last belong to it."""
    found = []
    first = [*np.flatnonzero(starts_run(intervals.polyline)).tolist(), len(intervals.polyline)]
    for begin, end in pairwise(first):
        on = (begin + np.flatnonzero(belongs[begin:end])).tolist()
        found += [list(range(a, b + 1)) for a, b in pairwise(on)]
        if closed[intervals.polyline[begin]] and len(on) > 1:
            found.append([*range(on[-1], end), *range(begin, on[0] + 1)])
    return found


def _long_gaps(intervals: CreaseIntervals, gaps: list[list[int]], spacing: float) -> Ints:
    """Return the longest inner interval of each gap that is long in all, the longest first (n,)."""
    inner = [np.array(gap[1:-1]) for gap in gaps]
    wide = [k[np.argmax(intervals.length[k])] for k in inner if intervals.length[k].sum() > LONG_INTERVAL * spacing]
    return np.array(sorted(wide, key=lambda k: -intervals.length[k]), dtype=np.int64)
