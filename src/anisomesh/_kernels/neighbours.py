"""Keeping neighbour lists sorted while the sites move (lists after Verlet 1967)."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def displacements(positions, reference, moved):
    """Write how far each site has moved from its reference; return the largest of these lengths."""
    farthest = 0.0
    for site in range(positions.shape[0]):
        d2 = 0.0
        for c in range(positions.shape[1]):
            t = positions[site, c] - reference[site, c]
            d2 += t * t
        moved[site] = np.sqrt(d2)
        farthest = max(farthest, moved[site])
    return farthest


@njit(cache=True, nogil=True)
def refresh_lists(which, positions, start, count, neighbours, distance2):
    """Recompute the squared distances of the lists of these sites and sort each list by them.

    Insertion sort: the lists are almost sorted from the last time. Ties keep the order of the site index, so
    the result does not depend on the history.
    """
    dimension = positions.shape[1]
    for site in which:
        first = start[site]
        for k in range(first, first + count[site]):
            other = neighbours[k]
            d2 = 0.0
            for c in range(dimension):
                t = positions[site, c] - positions[other, c]
                d2 += t * t
            m = k
            while m > first and (distance2[m - 1] > d2 or (distance2[m - 1] == d2 and neighbours[m - 1] > other)):
                distance2[m] = distance2[m - 1]
                neighbours[m] = neighbours[m - 1]
                m -= 1
            distance2[m] = d2
            neighbours[m] = other


@njit(cache=True, nogil=True)
def limit_radius(start, count, neighbours, distance, index, radius):
    """Lower the radius of each site to the distance of the nearest probe that its list does not hold.

    ``distance`` and ``index`` (S, k) are probes in order of distance, index -1 for none. If a list holds all
    probes, the distance of the last bounds that of the next one.
    """
    for site in range(radius.shape[0]):
        for p in range(index.shape[1]):
            other = index[site, p]
            if other < 0 or distance[site, p] > radius[site]:
                break
            if other == site:
                continue
            held = False
            for k in range(start[site], start[site] + count[site]):
                if neighbours[k] == other:
                    held = True
                    break
            if not held or p == index.shape[1] - 1:
                radius[site] = distance[site, p]
                break
