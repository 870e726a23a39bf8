"""The restricted Voronoi diagram on one facet: the lower envelope of planes over a triangle.

The squared distances of site i to the corners of a facet are ``W_i``. On the facet, with barycentric coordinates l,
``|y - x_i|^2 - |y - x_j|^2 = l . (W_i - W_j)``, so a cell restricted to the facet is a convex polygon in l, and the
dimension of the embedding occurs only in the computation of W. A polygon is clipped by the bisectors with the
neighbours in order of distance until the security radius (Levy and Bonneel, "Variational anisotropic surface meshing
with Voronoi parallel linear enumeration", 2012) proves that no further site can intersect it. The sites of its bisector
edges are visited next.

Polygon vertices carry a priori error bounds, so that most signs are decided in floating point and the others exactly
(modules polygon and predicates). A polygon edge has a label: -1 - c for the side of the facet opposite corner c,
otherwise the local slot of the site across the bisector. Edge k runs from vertex k to vertex k + 1, counter-clockwise.
"""

from typing import NamedTuple

import numpy as np

from .compiled import inlined, kernel
from .polygon import LABEL, bound_squares, classify, cut, start_with_facet
from .predicates import UNIT_ROUNDOFF

OK = 0
LIST_TOO_SHORT = -1  # a neighbour list ended before the security radius
BUFFER_TOO_SMALL = -2  # more polygons, vertices or candidate sites on a facet than the workspace can hold
NO_OWNER = -3  # the start site of a facet has no polygon on it
START_TOO_FAR = -4  # the list of the first site with a polygon is too short: another site may be nearer

_RADIUS_INFLATION = 1e-9  # relative, of the security radius: far above its rounding error


class Facets(NamedTuple):
    """The embedded surface as arrays over facets and points."""

    faces: np.ndarray  # (F, 3) int32
    points: np.ndarray  # (V, d)
    side2: np.ndarray  # (F, 3) squared lengths of the sides opposite the corners
    area: np.ndarray  # (F,) area in the embedding
    normal: np.ndarray  # (F, 3) unit normal of the facet in 3-D


class Sites(NamedTuple):
    """Sites and their neighbour lists, sorted by distances that may be out of date up to a bound."""

    positions: np.ndarray  # (S, d)
    start: np.ndarray  # (S,) first neighbour of each site
    length: np.ndarray  # (S,) number of its neighbours
    neighbours: np.ndarray  # (N,) int32
    distance: np.ndarray  # (N,) of a site to its neighbours when the list was last sorted
    stale: np.ndarray  # (S,) bound on the excess of the distances in a list
    complete: np.ndarray  # (S,) radius within which the list of a site has all other sites


class Workspace(NamedTuple):
    """Buffers of one thread."""

    counter: np.ndarray  # (2,) int64, number of facets clipped, and of slots in use on the current facet
    stamp: np.ndarray  # (S,) int64, facet count at which the site last got a slot
    slot: np.ndarray  # (S,) slot of the site, valid if stamped with the current facet count
    candidate: np.ndarray  # (C,) site of each slot
    table: np.ndarray  # (C, 3) squared distances to the corners of the facet
    queued: np.ndarray  # (C,) whether the slot is or was in the queue
    queue: np.ndarray  # (C,) slots whose polygons are to be computed
    polygon_slot: np.ndarray  # (C,) slot of every finished polygon
    polygon_start: np.ndarray  # (C + 1,) its first vertex
    label: np.ndarray  # (B,) label of the edge that starts at each vertex
    vertex: np.ndarray  # (B, 3) barycentric coordinates
    work: np.ndarray  # (2, M, 7) the polygon in progress, before and after a cut
    needed: np.ndarray  # (S,) radius that a neighbour list lacked, 0 where it was long enough


@inlined
def _fill_row(table, row, site, positions, points, a, b, c):
    """Write the squared distances of a site to the three corners."""
    wa = 0.0
    wb = 0.0
    wc = 0.0
    for k in range(positions.shape[1]):
        x = positions[site, k]
        ta = points[a, k] - x
        tb = points[b, k] - x
        tc = points[c, k] - x
        wa += ta * ta
        wb += tb * tb
        wc += tc * tc
    table[row, 0] = wa
    table[row, 1] = wb
    table[row, 2] = wc


@inlined
def _slot_of(site, facet, facets, sites, ws):
    """Return the slot of a site on the current facet, a new one if it has none; -1 if the workspace is full."""
    if ws.stamp[site] == ws.counter[0]:
        return ws.slot[site]
    j = ws.counter[1]
    if j >= ws.candidate.shape[0]:
        return -1
    ws.counter[1] += 1
    ws.stamp[site] = ws.counter[0]
    ws.slot[site] = j
    ws.candidate[j] = site
    ws.queued[j] = 0
    a, b, c = facets.faces[facet, 0], facets.faces[facet, 1], facets.faces[facet, 2]
    _fill_row(ws.table, j, site, sites.positions, facets.points, a, b, c)
    return j


@inlined
def _clip_cell(i, facet, facets, sites, ws):
    """Clip the facet by the bisectors of the site in slot i with its neighbours.

    Returns the vertex count or a negative status, the half of ``ws.work`` with the polygon, the radius within which the
    list of the site must be complete, and, if the count is 0, the slot of the site that cut off the last vertices.
    """
    site = ws.candidate[i]
    wa, wb, wc = ws.table[i, 0], ws.table[i, 1], ws.table[i, 2]
    sa, sb, sc = facets.side2[facet, 0], facets.side2[facet, 1], facets.side2[facet, 2]
    # Let W and L be the squares of the distance to the farthest corner and of the longest side. An error e <= 1 of the
    # coordinates moves a vertex by at most 2 e sqrt(L), so it changes its squared distance, which is at most W, by at
    # most 2 e (W + L) + 4 e^2 L.
    slack = 8.0 * (sites.positions.shape[1] + 4) * UNIT_ROUNDOFF * max(wa, wb, wc)
    spread = 2.0 * (max(wa, wb, wc) + slack + 3.0 * max(sa, sb, sc))
    start_with_facet(ws.work, wa, wb, wc, slack)
    radius2 = max(wa, wb, wc) + slack
    lag = sites.stale[site]
    n = 3
    source = 0
    for k in range(sites.start[site], sites.start[site] + sites.length[site]):
        nearest = sites.distance[k] - lag
        if nearest > 0.0 and nearest * nearest > 4.0 * radius2 * (1.0 + _RADIUS_INFLATION):
            break
        j = _slot_of(sites.neighbours[k], facet, facets, sites, ws)
        if j < 0:
            return BUFFER_TOO_SMALL, source, 0.0, -1
        fa, fb, fc = ws.table[j, 0] - wa, ws.table[j, 1] - wb, ws.table[j, 2] - wc
        if fa > 0.0 and fb > 0.0 and fc > 0.0:
            continue
        n_lost, first = classify(ws.work, ws.table, ws.candidate, source, n, i, j, fa, fb, fc)
        if n_lost == 0:
            continue
        if n_lost == n:
            return 0, source, 0.0, j
        if n + 2 > ws.work.shape[1]:
            return BUFFER_TOO_SMALL, source, 0.0, -1
        n = cut(ws.work, source, n, n_lost, first, j, abs(fa) + abs(fb) + abs(fc))
        source = 1 - source
        radius2 = bound_squares(ws.work, source, n - 2, n, wa, wb, wc, sa, sb, sc, slack, spread)
    return n, source, 2.0 * np.sqrt(radius2) * (1.0 + _RADIUS_INFLATION), -1


@kernel
def clip_facet(facet, owner, facets, sites, ws):
    """Write the polygons of all cells on a facet to the workspace.

    ``owner`` is a site likely to have a polygon on the facet. Returns the number of polygons or a negative status; with
    START_TOO_FAR, ``polygon_slot[0]`` is the slot of the site in question. All neighbour lists on the facet that are
    too short are marked in ``needed``.
    """
    ws.counter[0] += 1
    ws.counter[1] = 0
    ws.queue[0] = _slot_of(owner, facet, facets, sites, ws)
    ws.queued[0] = 1
    head = 0
    tail = 1
    n_polygons = 0
    n_vertices = 0
    short = False
    while head < tail:
        i = ws.queue[head]
        head += 1
        n, source, needed, rival = _clip_cell(i, facet, facets, sites, ws)
        if n < 0:
            return n
        if n == 0:
            # only start sites can have no polygon on the facet; the site that cut off the last vertices is next
            if n_polygons > 0 or ws.queued[rival]:
                return NO_OWNER
            ws.queued[rival] = 1
            ws.queue[tail] = rival
            tail += 1
            continue
        site = ws.candidate[i]
        if needed > sites.complete[site]:
            ws.needed[site] = max(ws.needed[site], needed)
            if n_polygons == 0:
                ws.polygon_slot[0] = i
                return START_TOO_FAR
            short = True
        if n_vertices + n > ws.label.shape[0]:
            return BUFFER_TOO_SMALL
        ws.polygon_slot[n_polygons] = i
        ws.polygon_start[n_polygons] = n_vertices
        n_polygons += 1
        for k in range(n):
            label = int(ws.work[source, k, LABEL])
            ws.label[n_vertices] = label
            for m in range(3):
                ws.vertex[n_vertices, m] = ws.work[source, k, m]
            n_vertices += 1
            if label >= 0 and not ws.queued[label]:
                ws.queued[label] = 1
                ws.queue[tail] = label
                tail += 1
    ws.polygon_start[n_polygons] = n_vertices
    return LIST_TOO_SHORT if short else n_polygons
