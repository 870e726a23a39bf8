"""Neighbour lists of moving sites, kept almost sorted (Verlet, "Computer experiments on classical fluids", 1967)."""

import numpy as np

from .compiled import inlined, kernel


@kernel
def displacements(positions, reference, moved):
    """Write the distance of each site from its reference position; return the largest distance."""
    farthest = 0.0
    for site in range(positions.shape[0]):
        d2 = 0.0
        for c in range(positions.shape[1]):
            t = positions[site, c] - reference[site, c]
            d2 += t * t
        moved[site] = np.sqrt(d2)
        farthest = max(farthest, moved[site])
    return farthest


@inlined
def _refresh(site, positions, start, count, neighbours, distance):
    """Recompute the distances of a list and sort it.

    Insertion sort, as the list is almost sorted. Equal distances are sorted by site index, so that the result does not
    depend on the history.
    """
    first = start[site]
    for k in range(first, first + count[site]):
        other = neighbours[k]
        d2 = 0.0
        for c in range(positions.shape[1]):
            t = positions[site, c] - positions[other, c]
            d2 += t * t
        d = np.sqrt(d2)
        m = k
        while m > first and (distance[m - 1] > d or (distance[m - 1] == d and neighbours[m - 1] > other)):
            distance[m] = distance[m - 1]
            neighbours[m] = neighbours[m - 1]
            m -= 1
        distance[m] = d
        neighbours[m] = other


@kernel
def refresh_lists(which, positions, start, count, neighbours, distance, stale):
    """Recompute and sort the lists of some sites (n,)."""
    for site in which:
        _refresh(site, positions, start, count, neighbours, distance)
        stale[site] = 0.0


@kernel
def age_lists(which, steps, limit, positions, start, count, neighbours, distance, stale):
    """Add to ``stale`` (S,) the bound on the change of the distances in each list by steps of known lengths (S,).

    Lists whose bound exceeds the limit (S,) are recomputed.
    """
    for site in which:
        farthest = 0.0
        for k in range(start[site], start[site] + count[site]):
            farthest = max(farthest, steps[neighbours[k]])
        stale[site] += steps[site] + farthest
        if stale[site] > limit[site]:
            _refresh(site, positions, start, count, neighbours, distance)
            stale[site] = 0.0


@kernel
def limit_radius(start, count, neighbours, distance, index, radius):
    """Lower the radius of each site to the distance of the nearest probe that is missing in its list.

    ``distance`` and ``index`` (S, k) are the k nearest sites in order of distance, index -1 for none. If a list has all
    of them, the distance of the last is a bound for the next.
    """
    for site in range(radius.shape[0]):
        for p in range(index.shape[1]):
            other = index[site, p]
            if other < 0 or distance[site, p] > radius[site]:
                break
            if other == site:
                continue
            listed = False
            for k in range(start[site], start[site] + count[site]):
                if neighbours[k] == other:
                    listed = True
                    break
            if not listed or p == index.shape[1] - 1:
                radius[site] = distance[site, p]
                break


@kernel
def walk(queries, owner, positions, start, count, neighbours):
    """Move the owner of each query (n, d) to the closest neighbour until none is closer; the larger index wins ties."""
    dimension = positions.shape[1]
    for q in range(len(queries)):
        nearest = owner[q]
        lowest = np.inf
        before = np.int64(-1)
        while before != nearest:
            before = nearest
            for k in range(start[before] - 1, start[before] + count[before]):
                other = neighbours[k] if k >= start[before] else before
                d2 = 0.0
                for c in range(dimension):
                    t = queries[q, c] - positions[other, c]
                    d2 += t * t
                if d2 < lowest or (d2 == lowest and other > nearest):
                    lowest = d2
                    nearest = other
        owner[q] = nearest
