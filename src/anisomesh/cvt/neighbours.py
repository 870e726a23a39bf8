"""Neighbour lists of moving sites that are provably complete."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from anisomesh._arrays import Sites
from anisomesh._kernels import clip
from anisomesh._kernels.neighbours import refresh_lists

_BASE_NEIGHBOURS = 24
_WORN = 0.5  # a list whose complete radius has shrunk below this share is worn
_WORN_SITES = 0.1  # all lists are rebuilt when more than this share of them is worn
_MAX_EPOCHS = 6


class NeighbourLists:
    """The nearest sites of every site, kept from call to call while the sites move.

    Notes
    -----
    A list built at reference positions holds every site within the distance of its last entry. Once the site
    has moved by a and no site by more than b it is still complete within that distance less a + b (Verlet
    1967), so most calls need no search: distances are recomputed and the list, almost sorted, is sorted
    again. A list that proves too short is sought anew, and longer, in a k-d tree; each such time is an epoch
    with reference positions of its own.
    """

    def __init__(self) -> None:
        self.n_sites = 0
        self._references: list[npt.NDArray[np.float64]] = []

    def table(self, sites: Sites, threads: int) -> clip.Sites:
        """Return sorted lists for these positions (S, d)."""
        if len(sites) != self.n_sites or len(self._references) > _MAX_EPOCHS:
            self._rebuild(sites, threads)
        complete = self._complete(sites)
        if np.mean(complete < _WORN * self._radius) > _WORN_SITES:
            self._rebuild(sites, threads)
            complete = self._radius
        self._refresh(sites, threads)
        return clip.Sites(
            positions=sites,
            start=self._start,
            neighbours=self._neighbours,
            distance2=self._distance2,
            complete=complete,
        )

    def grow(self, sites: Sites, short: npt.NDArray[np.int32], threads: int) -> clip.Sites:
        """Return the table with new lists for the sites named: as long as before if worn, else longer."""
        old_counts = np.diff(self._start)
        worn = self._complete(sites)[short] < 0.8 * self._radius[short]
        wanted = np.minimum(np.where(worn, 1, 2) * old_counts[short], self.n_sites - 1)
        if not np.array_equal(sites, self._references[-1]):
            self._references.append(np.array(sites))
        tree = cKDTree(sites)
        counts = old_counts.copy()
        counts[short] = wanted
        start = np.concatenate([[0], np.cumsum(counts)])
        kept = np.ones(self.n_sites, dtype=bool)
        kept[short] = False
        neighbours = np.empty(start[-1], dtype=np.int32)
        neighbours[np.repeat(kept, counts)] = self._neighbours[np.repeat(kept, old_counts)]
        for count in np.unique(wanted):
            group = short[wanted == count]
            found, self._radius[group] = _query(tree, sites, group, int(count), threads)
            neighbours[start[group][:, None] + np.arange(count)] = found
        self._epoch[short] = len(self._references) - 1
        self._start, self._neighbours, self._distance2 = start, neighbours, np.zeros(len(neighbours))
        self._refresh(sites, threads)
        return clip.Sites(sites, self._start, self._neighbours, self._distance2, self._complete(sites))

    def _rebuild(self, sites: Sites, threads: int) -> None:
        self.n_sites = len(sites)
        self._references = [np.array(sites)]
        self._epoch = np.zeros(self.n_sites, dtype=np.int32)
        count = min(_BASE_NEIGHBOURS, self.n_sites - 1)
        found, self._radius = _query(cKDTree(sites), sites, np.arange(self.n_sites), count, threads)
        self._start = np.arange(self.n_sites + 1, dtype=np.int64) * count
        self._neighbours = np.ascontiguousarray(found.ravel())
        self._distance2 = np.zeros(len(self._neighbours))

    def _complete(self, sites: Sites) -> npt.NDArray[np.float64]:
        """Return the radius within which each list holds all sites (S,)."""
        complete = self._radius.copy()
        for epoch, reference in enumerate(self._references):
            moved = np.linalg.norm(sites - reference, axis=1)
            members = self._epoch == epoch
            complete[members] -= moved[members] + moved.max()
        return complete

    def _refresh(self, sites: Sites, threads: int) -> None:
        bounds = np.linspace(0, len(sites), min(threads, 1 + len(sites) // 1000) + 1).astype(np.int64)
        arrays = (sites, self._start, self._neighbours, self._distance2)
        if len(bounds) == 2:
            refresh_lists(0, len(sites), *arrays)
            return
        with ThreadPoolExecutor(len(bounds) - 1) as pool:
            list(pool.map(lambda pair: refresh_lists(*pair, *arrays), zip(bounds[:-1], bounds[1:], strict=True)))


def _query(
    tree: cKDTree, sites: Sites, group: npt.NDArray[np.integer], count: int, threads: int
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.float64]]:
    """Return the nearest ``count`` other sites (n, count) of a group and the radius they fill."""
    if count == 0:
        return np.zeros((len(group), 0), dtype=np.int32), np.full(len(group), np.inf)
    distance, index = tree.query(sites[group], count + 1, workers=threads)
    others = index != group[:, None]
    others[others.all(axis=1), -1] = False
    radius = distance[:, -1] if count < len(sites) - 1 else np.full(len(group), np.inf)
    return index[others].reshape(len(group), count).astype(np.int32), np.array(radius)
