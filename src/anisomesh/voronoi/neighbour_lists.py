"""Neighbour lists of moving sites that are provably complete."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from anisomesh._arrays import Sites
from anisomesh._kernels import clip
from anisomesh._kernels.neighbours import age_lists, displacements, limit_radius, refresh_lists, walk
from anisomesh.execution.threads import Workers, blocks
from anisomesh.voronoi.blocks import Blocks

# performance only: no value changes a result beyond rounding (benchmarks/speed.py)
_BASE_NEIGHBOURS = 32  # entries of a new list
_MAX_ANCHOR_DISTANCE = 0.45  # median list radii: when a site is this far from its anchor, sites are anchored anew,
_REANCHOR_DISTANCE = 0.1  # namely the ones farther from their anchors than this
_MAX_REANCHORED = 0.05  # share of all sites; if more are to be anchored anew, all lists are rebuilt
_GROWTH_MARGIN = 1.3  # ratio of the new radius of a list that proved too short to the radius needed
_MAX_WASTE = 2  # ratio of the memory of all lists to the memory in use, from which on they are rebuilt
_MAX_KEPT_LENGTH = 96  # entries to which a rebuild shortens longer lists
_MIN_SITES_FOR_THREADS = 2_000  # fewer are done before another thread has started
_MAX_AGE = 0.02  # list radii by which the distances in a list may be out of date
_PROBES = 4  # newly anchored sites that are looked for near every other site

Floats = npt.NDArray[np.float64]
Rows = npt.NDArray[np.intp]


class NeighbourLists:
    """The nearest sites of every site, kept from call to call while the sites move.

    Notes
    -----
    Every site i has an anchor a_i, an earlier position, and a radius r_i; its list contains every site whose anchor is
    within r_i of a_i. Hence it contains every site that is *now* within r_i - |x_i - a_i| - max_j |x_j - a_j|, where j
    runs over the sites in nearby blocks; sites in other blocks are too far to matter. So most calls need no search. The
    distances in a list, and its order, may be out of date by a bound that sums the steps since they were computed; when
    it exceeds a share of the radius they are recomputed, and the almost sorted list is sorted. A site that has moved
    far gets a new anchor and a new list; other sites that have it in their lists keep their radius, the rest get a
    smaller one. A list that proves too short is replaced by a longer one, found among the anchors.

    References
    ----------
    Verlet, "Computer experiments on classical fluids", Physical Review 1967.
    """

    def __init__(self, workers: Workers) -> None:
        self.n_sites = 0
        self._workers = workers
        self._sites: Floats  # the positions in the last call of table
        self._anchors: Floats
        self._moved: Floats
        self._radius: Floats
        self._filled: Floats  # the radius when the list was last searched for
        self._distance: Floats
        self._stale: Floats  # by how much the distances in each list may have changed
        self._counts: npt.NDArray[np.int64]
        self._start: npt.NDArray[np.int64]
        self._neighbours: npt.NDArray[np.int32]
        self._typical = 0.0
        self._blocks: Blocks
        self._reach: Floats | None = None  # largest radius in each block, when the near blocks were found
        self._near: npt.NDArray[np.bool_]
        self._used = 0  # entries of the lists that are taken
        self._tree: cKDTree  # of the anchors
        self._current: cKDTree | None = None  # of the positions in the last call of table

    def table(self, sites: Sites, *, exact: bool = False) -> clip.Sites:
        """Return lists for these positions (S, d), with ``exact`` in the order of the distances to the last bit."""
        self._current = None
        if len(sites) != self.n_sites:
            self._rebuild(sites)
        self._moved = np.empty(self.n_sites)
        if displacements(sites, self._anchors, self._moved) > _MAX_ANCHOR_DISTANCE * self._typical:
            restless = self._blocks.largest(self._moved) > _MAX_ANCHOR_DISTANCE * self._typical
            movers = np.flatnonzero(restless[self._blocks.of] & (self._moved > _REANCHOR_DISTANCE * self._typical))
            crowded = self._used > _MAX_WASTE * self._counts.sum()
            if crowded or len(movers) > _MAX_REANCHORED * self.n_sites:
                self._rebuild(sites)
            else:
                self._anchor(sites, movers)
            displacements(sites, self._anchors, self._moved)
        self._age(sites)
        if exact:
            self._refresh(sites, np.flatnonzero(self._stale))
        return self._as_table(sites)

    def grow(self, sites: Sites, needed: Floats) -> clip.Sites:
        """Return the table with longer lists for the sites whose needed radius (S,) is not 0.

        The positions must be the positions of the last call of ``table``.
        """
        short = np.flatnonzero(needed)
        wanted = _GROWTH_MARGIN * needed[short] + self._worn()[short]
        limited = self._radius[short] < self._filled[short]  # a search as long as the last may do
        counts = np.minimum(np.where(limited, 1, 2) * self._counts[short], self.n_sites - 1)
        while len(short):
            for count in np.unique(counts).tolist():
                self._append(short[counts == count], count)
            if self._reach is not None and (self._radius[short] > self._reach[self._blocks.of[short]]).any():
                self._reach = None
            unmet = self._radius[short] < wanted
            self._refresh(sites, short[~unmet])
            short, wanted = short[unmet], wanted[unmet]
            counts = np.minimum(2 * counts[unmet], self.n_sites - 1)
        return self._as_table(sites)

    def near(self, queries: Floats, sites: Sites) -> npt.NDArray[np.int32]:
        """Return for each point (n, d) a site close to it, most often the nearest.

        From the site with the nearest anchor on, a walk to ever nearer sites in the lists.
        """
        found = np.asarray(self._tree.query(queries)[1], dtype=np.int32)
        walk(queries, found, sites, self._start, self._counts, self._neighbours)
        return found

    def nearest(self, queries: Floats, sites: Sites) -> npt.NDArray[np.int32]:
        """Return the nearest site, of several the last, to each point (n, d); ``sites`` as in the last ``table``."""
        if self._current is None:
            self._current = cKDTree(sites)
        found = np.asarray(self._current.query(queries, workers=self._workers.threads)[1], dtype=np.int32)
        walk(queries, found, sites, self._start, self._counts, self._neighbours)  # the tree returns any of several
        return found

    def _as_table(self, sites: Sites) -> clip.Sites:
        complete = self._radius - self._worn()
        return clip.Sites(sites, self._start, self._counts, self._neighbours, self._distance, self._stale, complete)

    def _worn(self) -> Floats:
        """Return by how much the radius within which each list is complete has shrunk since the anchors (S,)."""
        margin = self._typical if np.isfinite(self._typical) else 0.0
        if self._reach is None:
            self._reach = largest = self._blocks.largest(self._radius)
            self._near = self._blocks.near(self._anchors, np.nextafter(largest + margin, np.inf))
        moved = self._blocks.largest(self._moved)
        # sites in blocks that are not near are farther than the radius by the margin
        around = np.maximum(np.where(self._near, moved, 0.0).max(axis=1), moved.max() - margin)
        return np.asarray(self._moved + around[self._blocks.of])

    def _rebuild(self, sites: Sites) -> None:
        base = min(_BASE_NEIGHBOURS, len(sites) - 1)
        if len(sites) != self.n_sites:
            self.n_sites = len(sites)
            self._counts = np.full(self.n_sites, base)
        self._anchors, self._sites = np.array(sites), sites
        self._tree = cKDTree(self._anchors)
        self._blocks = Blocks(self._anchors)
        self._reach = None
        self._radius, self._filled = np.empty(self.n_sites), np.empty(self.n_sites)
        self._start = np.zeros(self.n_sites, dtype=np.int64)
        counts = np.clip(self._counts, base, _MAX_KEPT_LENGTH)
        self._used = 0
        self._neighbours = np.zeros(2 * counts.sum(), dtype=np.int32)
        self._distance = np.zeros(2 * counts.sum())
        self._stale = np.full(self.n_sites, np.inf)
        for count in np.unique(counts).tolist():
            self._append(np.flatnonzero(counts == count), count)
        self._typical = float(np.median(self._radius))

    def _append(self, group: Rows, count: int) -> None:
        """Give these sites lists of a length, behind all others; their old ones are left unused until a rebuild."""
        first, self._used = self._used, self._used + count * len(group)
        if self._used > len(self._neighbours):
            room = np.zeros(self._used, dtype=np.int32)
            self._neighbours = np.concatenate([self._neighbours, room])
            self._distance = np.concatenate([self._distance, room.astype(np.float64)])
        self._start[group] = first + count * np.arange(len(group))
        self._counts[group] = count
        self._neighbours[first : self._used] = self._search(group, count).ravel()
        self._distance[first : self._used] = 0.0
        self._stale[group] = np.inf

    def _anchor(self, sites: Sites, movers: Rows) -> None:
        """Anchor these sites where they are now."""
        self._anchors[movers] = sites[movers]
        self._reach = None
        self._tree = cKDTree(self._anchors)
        moved_tree = cKDTree(self._anchors[movers])
        probes = min(_PROBES, len(movers))
        distance, index = moved_tree.query(
            self._anchors,
            range(1, probes + 1),
            distance_upper_bound=float(self._radius.max()),
            workers=self._workers.threads,
        )
        index = np.append(movers, -1)[np.minimum(index, len(movers))]
        limit_radius(self._start, self._counts, self._neighbours, distance, index, self._radius)
        for count in np.unique(self._counts[movers]):
            group = movers[self._counts[movers] == count]
            places = self._start[group][:, None] + np.arange(count)
            self._neighbours[places] = self._search(group, int(count))
        self._stale[movers] = np.inf

    def _search(self, group: Rows, count: int) -> npt.NDArray[np.int32]:
        """Return the ``count`` other sites with the nearest anchors (n, count) and set the radius they fill."""
        if count == 0:
            self._radius[group] = self._filled[group] = np.inf
            return np.zeros((len(group), 0), dtype=np.int32)
        workers = self._workers.threads if len(group) > _MIN_SITES_FOR_THREADS else 1
        distance, index = self._tree.query(self._anchors[group], count + 1, workers=workers)
        others = index != group[:, None]
        others[others.all(axis=1), -1] = False
        self._radius[group] = distance[:, -1] if count < self.n_sites - 1 else np.inf
        self._filled[group] = self._radius[group]
        return np.asarray(index[others].reshape(len(group), count), dtype=np.int32)

    def _age(self, sites: Sites) -> None:
        """Let the distances age by the step from the positions of the last call; renew those that are too old."""
        steps = np.empty(self.n_sites)
        displacements(sites, self._sites, steps)
        self._sites = np.array(sites)
        limit = np.where(np.isfinite(self._radius), _MAX_AGE * self._radius, 0.0)
        lists = (self._start, self._counts, self._neighbours, self._distance, self._stale)
        self._share(np.arange(self.n_sites), lambda part: age_lists(part, steps, limit, sites, *lists))

    def _refresh(self, sites: Sites, which: Rows) -> None:
        lists = (self._start, self._counts, self._neighbours, self._distance, self._stale)
        self._share(which, lambda part: refresh_lists(part, sites, *lists))

    def _share(self, which: Rows, work: Callable[[Rows], None]) -> None:
        """Let the workers do the work on these sites."""
        if len(which) > _MIN_SITES_FOR_THREADS:
            self._workers.map(lambda _, part: work(part), blocks(which, -(-len(which) // self._workers.threads)))
        else:
            work(which)
