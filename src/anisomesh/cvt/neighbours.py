"""Neighbour lists of moving sites that are provably complete."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from anisomesh._arrays import Sites
from anisomesh._kernels import clip
from anisomesh._kernels.neighbours import displacements, refresh_lists

_BASE_NEIGHBOURS = 24
_WORN = 0.5  # a list whose complete radius has shrunk below this share is worn
_WORN_SITES = 0.1  # all lists are rebuilt when more than this share of them is worn
_SPARE = 1.3  # lists that prove too short are made this much longer than needed
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
        self._tree: cKDTree | None = None

    def table(self, sites: Sites, threads: int) -> clip.Sites:
        """Return sorted lists for these positions (S, d)."""
        self._tree = None
        if len(sites) != self.n_sites:
            self.n_sites = len(sites)
            self._counts = np.full(self.n_sites, min(_BASE_NEIGHBOURS, self.n_sites - 1))
            self._rebuild(sites, threads)
        complete = self._complete(sites)
        worn = np.mean(complete < _WORN * self._radius) > _WORN_SITES
        if worn or len(self._references) > _MAX_EPOCHS:
            self._counts = np.maximum(self._counts // 2, min(_BASE_NEIGHBOURS, self.n_sites - 1))
            self._rebuild(sites, threads)
            complete = self._radius.copy()
        self._refresh(sites, np.arange(self.n_sites), threads)
        return clip.Sites(sites, self._start, self._neighbours, self._distance2, complete)

    def grow(self, sites: Sites, needed: npt.NDArray[np.float64], threads: int) -> clip.Sites:
        """Return the table with new lists for the sites whose needed radius (S,) is not 0.

        The positions must be those of the last call of ``table``.
        """
        short = np.flatnonzero(needed)
        old_start, old_counts = self._start, self._counts.copy()
        found: list[tuple[npt.NDArray[np.intp], npt.NDArray[np.int32]]] = []
        todo = short
        while len(todo):
            for count in np.unique(self._counts[todo]):
                group = todo[self._counts[todo] == count]
                lists, self._radius[group] = self._query(sites, group, int(count), threads)
                found.append((group, lists))
            todo = todo[self._radius[todo] < _SPARE * needed[todo]]
            self._counts[todo] = np.minimum(2 * self._counts[todo], self.n_sites - 1)
        self._start = np.concatenate([[0], np.cumsum(self._counts)])
        kept = np.ones(self.n_sites, dtype=bool)
        kept[short] = False
        into, out_of = np.repeat(kept, self._counts), np.repeat(kept, old_counts)
        neighbours, distance2 = np.empty(self._start[-1], dtype=np.int32), np.zeros(self._start[-1])
        neighbours[into], distance2[into] = self._neighbours[out_of], self._distance2[out_of]
        self._neighbours, self._distance2 = neighbours, distance2
        for group, lists in found:
            final = self._counts[group] == lists.shape[1]
            neighbours[self._start[group[final]][:, None] + np.arange(lists.shape[1])] = lists[final]
        if not np.array_equal(sites, self._references[-1]):
            self._references.append(np.array(sites))
        self._epoch[short] = len(self._references) - 1
        self._refresh(sites, short, threads)
        return clip.Sites(sites, self._start, neighbours, distance2, self._complete(sites))

    def nearest(self, queries: npt.NDArray[np.float64], sites: Sites, threads: int) -> npt.NDArray[np.int32]:
        """Return the site nearest to each point (n, d); ``sites`` as in the last call of ``table``."""
        return np.asarray(self._tree_of(sites).query(queries, workers=threads)[1], dtype=np.int32)

    def _rebuild(self, sites: Sites, threads: int) -> None:
        self._references = [np.array(sites)]
        self._epoch = np.zeros(self.n_sites, dtype=np.int32)
        self._radius = np.empty(self.n_sites)
        self._start = np.concatenate([[0], np.cumsum(self._counts)])
        self._neighbours = np.empty(self._start[-1], dtype=np.int32)
        self._distance2 = np.zeros(self._start[-1])
        for count in np.unique(self._counts):
            group = np.flatnonzero(self._counts == count)
            lists, self._radius[group] = self._query(sites, group, int(count), threads)
            self._neighbours[self._start[group][:, None] + np.arange(count)] = lists

    def _complete(self, sites: Sites) -> npt.NDArray[np.float64]:
        """Return the radius within which each list holds all sites (S,)."""
        complete = self._radius.copy()
        moved = np.empty(self.n_sites)
        for epoch, reference in enumerate(self._references):
            farthest = displacements(sites, reference, moved)
            members = slice(None) if len(self._references) == 1 else self._epoch == epoch
            complete[members] -= moved[members] + farthest
        return complete

    def _refresh(self, sites: Sites, which: npt.NDArray[np.intp], threads: int) -> None:
        arrays = (sites, self._start, self._neighbours, self._distance2)
        shares = np.array_split(which, min(threads, 1 + len(which) // 1000))
        if len(shares) == 1:
            refresh_lists(which, *arrays)
            return
        with ThreadPoolExecutor(len(shares)) as pool:
            list(pool.map(lambda share: refresh_lists(share, *arrays), shares))

    def _tree_of(self, sites: Sites) -> cKDTree:
        if self._tree is None:
            self._tree = cKDTree(sites)
        return self._tree

    def _query(
        self, sites: Sites, group: npt.NDArray[np.intp], count: int, threads: int
    ) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.float64]]:
        """Return the nearest ``count`` other sites (n, count) of a group and the radius they fill."""
        if count == 0:
            return np.zeros((len(group), 0), dtype=np.int32), np.full(len(group), np.inf)
        distance, index = self._tree_of(sites).query(sites[group], count + 1, workers=threads)
        others = index != group[:, None]
        others[others.all(axis=1), -1] = False
        radius = distance[:, -1] if count < self.n_sites - 1 else np.full(len(group), np.inf)
        return index[others].reshape(len(group), count).astype(np.int32), np.array(radius)
