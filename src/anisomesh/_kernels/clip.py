"""The restricted Voronoi diagram on one facet: the lower envelope of planes over a triangle.

Squared distances from site i to the corners of a facet form ``W_i``; on the facet, with barycentric
coordinates l, ``|y - x_i|^2 - |y - x_j|^2 = l . (W_i - W_j)``, so a cell restricted to the facet is a convex
polygon in l and the dimension of the embedding enters only in the table W. A polygon is clipped by the
bisectors with the neighbours in order of distance until the security radius (Levy and Bonneel 2012) proves
that no further site can reach it; the sites behind its bisector edges are visited next.

Polygon vertices carry an a-priori error bound, so that most signs are decided in floating point and the rest
exactly (see predicates). A polygon edge carries a label: -1 - c for the side of the facet opposite corner c,
otherwise the local slot of the site behind the bisector. Edge k runs from vertex k to vertex k + 1, counter-
clockwise in the facet.
"""

from typing import NamedTuple

import numpy as np

from .compiled import inlined, kernel
from .predicates import corner_side, edge_side, interior_side

OK = 0
LIST_TOO_SHORT = -1  # a neighbour list ended before the security radius
BUFFER_TOO_SMALL = -2  # more polygons, vertices or candidate sites on a facet than the workspace holds
NO_OWNER = -3  # the start site of a facet has no part of it
START_TOO_FAR = -4  # the list of the first site with a part is too short: perhaps another site is nearer

_UNIT_ROUNDOFF = 1.1102230246251565e-16
_SLOP = 1e-9  # relative inflation of the security radius, far above its rounding error


class Facets(NamedTuple):
    """The embedded surface: arrays over facets and points."""

    faces: np.ndarray  # (F, 3) int32
    points: np.ndarray  # (V, d)
    side2: np.ndarray  # (F, 3) squared length of the side opposite each corner
    area: np.ndarray  # (F,) area in the embedding
    normal: np.ndarray  # (F, 3) unit normal of the facet in 3-D


class Sites(NamedTuple):
    """Sites and their neighbour lists, sorted by a distance that may be out of date by a bound."""

    positions: np.ndarray  # (S, d)
    start: np.ndarray  # (S,) first neighbour of each site
    length: np.ndarray  # (S,) number of its neighbours
    neighbours: np.ndarray  # (N,) int32
    distance: np.ndarray  # (N,) of a site to its neighbours, when the list was last sorted
    stale: np.ndarray  # (S,) by how much the distances in a list may be too large
    complete: np.ndarray  # (S,) radius within which the list of a site holds every other site


class Workspace(NamedTuple):
    """Buffers of one thread."""

    clock: np.ndarray  # (2,) int64, counts the facets clipped, and the slots given on this one
    stamp: np.ndarray  # (S,) int64, when this site was last given a slot
    slot: np.ndarray  # (S,)
    candidate: np.ndarray  # (C,) site of each slot
    table: np.ndarray  # (C, 3) squared distances to the corners of the facet
    queued: np.ndarray  # (C,) whether the polygon of the slot is done or waits
    queue: np.ndarray  # (C,)
    polygon_slot: np.ndarray  # (C,) slot of every finished polygon
    polygon_start: np.ndarray  # (C + 1,) its first vertex
    label: np.ndarray  # (B,) label of the edge that leaves each vertex
    vertex: np.ndarray  # (B, 3) barycentric coordinates
    work: np.ndarray  # (2, M, 7) the polygon being clipped, before and after a cut
    needed: np.ndarray  # (S,) radius that a neighbour list should have had, 0 where it was long enough


# columns of Workspace.work after the three barycentric coordinates
_ERROR = 3  # bound on the error of the coordinates
_SQUARE = 4  # squared distance to the site
_LABEL = 5  # label of the edge that leaves the vertex
_VALUE = 6  # form of the clipping bisector


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


@kernel
def _exact_side(table, candidate, i, before, after, j):
    """Return the exact side (1 or -1) of the vertex between two labelled edges of cell i against site j."""
    site = candidate
    w = table
    if before < 0 and after < 0:
        return corner_side(w[i], w[j], site[i], site[j], 5 + before + after)
    if before < 0 or after < 0:
        side = -1 - min(before, after)
        k = max(before, after)
        return edge_side(w[i], w[k], w[j], site[i], site[k], site[j], (side + 1) % 3, (side + 2) % 3)
    return interior_side(w[i], w[before], w[after], w[j], site[i], site[before], site[after], site[j])


@inlined
def _intersect(work, source, p, q, m, size):
    """Write the point of the edge p q where the form vanishes, and a bound on its error, as vertex m.

    With t the true and t' the computed parameter, both in [0, 1], and beta the error of the two values,
    |t - t'| <= 3 beta / (|value_p - value_q| - 2 beta): the new point is as good as its two parents plus that
    share of their distance, and never worse than the whole distance.
    """
    parents = max(work[source, p, _ERROR], work[source, q, _ERROR])
    beta = (parents + 8.0 * _UNIT_ROUNDOFF) * size
    gap = work[source, p, _VALUE] - work[source, q, _VALUE]
    t = min(max(work[source, p, _VALUE] / gap, 0.0), 1.0) if gap != 0.0 else 0.5
    spread = abs(gap) - 2.0 * beta
    share = min(1.0, 3.0 * beta / spread) if spread > 0.0 else 1.0
    length = 0.0
    for c in range(3):
        step = work[source, q, c] - work[source, p, c]
        work[1 - source, m, c] = work[source, p, c] + t * step
        length = max(length, abs(step))
    work[1 - source, m, _ERROR] = parents + share * (length + 2.0 * parents) + 4.0 * _UNIT_ROUNDOFF


@inlined
def _classify(work, table, candidate, source, n, i, j, fa, fb, fc):
    """Decide which vertices site j takes; return their number and the first of them in cyclic order."""
    size = abs(fa) + abs(fb) + abs(fc)
    first = 0
    n_lost = 0
    before = False
    zero = False
    for k in range(n):
        v = work[source, k, 0] * fa + work[source, k, 1] * fb + work[source, k, 2] * fc
        work[source, k, _VALUE] = v
        if abs(v) > (work[source, k, _ERROR] + 8.0 * _UNIT_ROUNDOFF) * size:
            lost = v < 0.0
        else:
            label_before = int(work[source, k - 1 if k > 0 else n - 1, _LABEL])
            lost = _exact_side(table, candidate, i, label_before, int(work[source, k, _LABEL]), j) < 0
        if k == 0:
            zero = lost
        elif lost and not before:
            first = k
        if lost:
            n_lost += 1
        before = lost
    if zero and not before:
        first = 0
    return n_lost, first


@inlined
def _cut(work, source, n, n_lost, first, j, size):
    """Write the polygon without its lost vertices into the other buffer; return its vertex count."""
    target = 1 - source
    entry = first - 1 if first > 0 else n - 1
    last = first + n_lost - 1
    if last >= n:
        last -= n
    leave = last + 1 if last + 1 < n else 0
    k = leave
    kept = n - n_lost
    for m in range(kept):
        for c in range(_VALUE):
            work[target, m, c] = work[source, k, c]
        k = k + 1 if k + 1 < n else 0
    _intersect(work, source, entry, first, kept, size)
    work[target, kept, _LABEL] = j
    _intersect(work, source, leave, last, kept + 1, size)
    work[target, kept + 1, _LABEL] = work[source, last, _LABEL]
    return kept + 2


@inlined
def _measure(work, source, first, n, wa, wb, wc, sa, sb, sc, slack, spread):
    """Bound the squared distances of the vertices from ``first`` on; return the largest bound of all.

    ``slack`` is for the rounding of the squares, ``spread`` times its error for the place of the vertex.
    """
    for m in range(first, n):
        la = work[source, m, 0]
        lb = work[source, m, 1]
        lc = work[source, m, 2]
        square = la * wa + lb * wb + lc * wc - (lb * lc * sa + lc * la * sb + la * lb * sc)
        work[source, m, _SQUARE] = square + slack + spread * work[source, m, _ERROR]
    largest = 0.0
    for m in range(n):
        largest = max(largest, work[source, m, _SQUARE])
    return largest


@inlined
def _whole_facet(work, wa, wb, wc, slack):
    """Start the polygon as the whole facet."""
    for k in range(3):
        for c in range(4):
            work[0, k, c] = 1.0 if c == k else 0.0
        work[0, k, _LABEL] = -1 - (k + 2) % 3
    work[0, 0, _SQUARE] = wa + slack
    work[0, 1, _SQUARE] = wb + slack
    work[0, 2, _SQUARE] = wc + slack


@inlined
def _slot_of(site, facet, facets, sites, ws):
    """Return the slot of a site on the facet that is being clipped, a new one if need be; -1 if there is no room."""
    if ws.stamp[site] == ws.clock[0]:
        return ws.slot[site]
    j = ws.clock[1]
    if j >= ws.candidate.shape[0]:
        return -1
    ws.clock[1] += 1
    ws.stamp[site] = ws.clock[0]
    ws.slot[site] = j
    ws.candidate[j] = site
    ws.queued[j] = 0
    a, b, c = facets.faces[facet, 0], facets.faces[facet, 1], facets.faces[facet, 2]
    _fill_row(ws.table, j, site, sites.positions, facets.points, a, b, c)
    return j


@inlined
def _clip_cell(i, facet, facets, sites, ws):
    """Clip the facet by the bisectors of the site in slot i with its neighbours.

    Returns the vertex count or a negative status, the half of ``ws.work`` that holds the polygon, the radius within
    which the list of the site had to be complete, and the slot of the site that took all where the count is 0.
    """
    site = ws.candidate[i]
    wa, wb, wc = ws.table[i, 0], ws.table[i, 1], ws.table[i, 2]
    sa, sb, sc = facets.side2[facet, 0], facets.side2[facet, 1], facets.side2[facet, 2]
    # W and L being squares of the distance to the farthest corner and of the longest side, an error e <= 1
    # of the coordinates moves a vertex by at most 2 e sqrt(L), and its squared distance, which is at most W,
    # by at most 2 e (W + L) + 4 e^2 L
    slack = 8.0 * (sites.positions.shape[1] + 4) * _UNIT_ROUNDOFF * max(wa, wb, wc)
    spread = 2.0 * (max(wa, wb, wc) + slack + 3.0 * max(sa, sb, sc))
    _whole_facet(ws.work, wa, wb, wc, slack)
    radius2 = max(wa, wb, wc) + slack
    lag = sites.stale[site]
    n = 3
    source = 0
    for k in range(sites.start[site], sites.start[site] + sites.length[site]):
        least = sites.distance[k] - lag
        if least > 0.0 and least * least > 4.0 * radius2 * (1.0 + _SLOP):
            break
        j = _slot_of(sites.neighbours[k], facet, facets, sites, ws)
        if j < 0:
            return BUFFER_TOO_SMALL, source, 0.0, -1
        fa, fb, fc = ws.table[j, 0] - wa, ws.table[j, 1] - wb, ws.table[j, 2] - wc
        if fa > 0.0 and fb > 0.0 and fc > 0.0:
            continue
        n_lost, first = _classify(ws.work, ws.table, ws.candidate, source, n, i, j, fa, fb, fc)
        if n_lost == 0:
            continue
        if n_lost == n:
            return 0, source, 0.0, j
        if n + 2 > ws.work.shape[1]:
            return BUFFER_TOO_SMALL, source, 0.0, -1
        n = _cut(ws.work, source, n, n_lost, first, j, abs(fa) + abs(fb) + abs(fc))
        source = 1 - source
        radius2 = _measure(ws.work, source, n - 2, n, wa, wb, wc, sa, sb, sc, slack, spread)
    return n, source, 2.0 * np.sqrt(radius2) * (1.0 + _SLOP), -1


@kernel
def clip_facet(facet, owner, facets, sites, ws):
    """Write the polygons of all cells on a facet into the workspace.

    ``owner`` is a site likely to own a part of the facet. Returns the number of polygons or a negative status, with
    START_TOO_FAR the slot of the site in question as that of the first polygon. Lists that are too short are noted in
    the workspace, all those on the facet at once.
    """
    ws.clock[0] += 1
    ws.clock[1] = 0
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
            # only the first sites can have no part of the facet; whatever took the last of it is tried next
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
            label = int(ws.work[source, k, _LABEL])
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
