"""Shortest noncontractible loops in non-disk cells, and points on them that cut the cells open as new sites."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from anisomesh._arrays import EmbeddedPoints
from anisomesh.voronoi.cells import CellComplex

Indices = npt.NDArray[np.int64]

_MAX_DETOUR = (
    1.5  # ratio of a loop through the site to the tightest loop around the same hole, up to which it is cut; heuristic
)


@dataclass(frozen=True, eq=False)
class _Patches:
    """The polygons (n) of some cells, and the sides of facets that two of them share (m).

    Attributes
    ----------
    cell
        Cell of each polygon (n,), counted from 0.
    centre
        A point of each polygon (n, d).
    pair
        The two polygons at each side (m, 2).
    gate
        The middle of each side (m, d).
    length
        Of the way from centre to centre through the gate (m,).
    ends
        The points of the surface at the ends of each side (m, 2), -1 for an end on the boundary of the cell.
    """

    cell: Indices
    centre: EmbeddedPoints
    pair: Indices
    gate: EmbeddedPoints
    length: npt.NDArray[np.float64]
    ends: Indices


@dataclass(frozen=True, eq=False)
class _Loop:
    """A closed path on the surface: corners (k, d), the first one again at the end."""

    corners: EmbeddedPoints

    @property
    def steps(self) -> npt.NDArray[np.float64]:
        return np.asarray(np.linalg.norm(np.diff(self.corners, axis=0), axis=1))

    def at(self, *shares: float) -> EmbeddedPoints:
        """Return the points at these shares of the length (n, d)."""
        along = np.concatenate([[0.0], np.cumsum(self.steps)])
        wanted = np.array(shares) * along[-1]
        return np.stack([np.interp(wanted, along, coordinate) for coordinate in self.corners.T], axis=1)


def points_on_noncontractible_loops(cells: CellComplex) -> EmbeddedPoints:
    """Return points (n, d) on a noncontractible loop in each non-disk cell, to become sites.

    Notes
    -----
    A cell around a tube, a hole or a cone has a noncontractible loop through its site. Two points divide the shortest
    one in three with the site, so that three cells meet all around. Where the hole is far from the site this loop leads
    there and back; then three points are placed on the tightest loop around the hole. The farthest points of a cell
    would do neither in a long cell: their own cells close around the tube again, and around a cone they approach its
    apex without end. A cell that is a whole closed component has no such loop.

    The sides of facets that a tree of shortest paths does not cross, with hanging ends pruned, are the cut locus of its
    root, and a loop that crosses it once is noncontractible.

    References
    ----------
    Erickson, Whittlesey, "Greedy optimal homotopy and homology generators", SODA 2005.
    """
    diagram = cells.diagram
    chosen = np.flatnonzero(cells.euler != 1)
    patches = _patches(cells, chosen)
    starts = diagram.sites[cells.site[chosen]].copy()
    loops = _shortest_loops(patches, _nearest(patches, starts))
    for number, loop in loops.items():
        starts[number] = loop.at(0.5)[0]
    tight = _shortest_loops(patches, _nearest(patches, starts))
    points = [np.empty((0, diagram.points.shape[1]))]
    for number, loop in loops.items():
        if loop.steps.sum() <= _MAX_DETOUR * tight[number].steps.sum():
            points.append(loop.at(1 / 3, 2 / 3))
        else:
            points.append(tight[number].at(0.0, 1 / 3, 2 / 3))
    return np.concatenate(points)


def _patches(cells: CellComplex, chosen: Indices) -> _Patches:
    """Return the polygons of these components and the sides that they share."""
    diagram, surface = cells.diagram, cells.embedded.surface
    rank = np.full(cells.n_components, -1, dtype=np.int64)
    rank[chosen] = np.arange(len(chosen))
    cell = rank[cells.of_polygon]
    kept = cell >= 0
    number = np.cumsum(kept) - 1
    inside = np.flatnonzero(kept[diagram.polygon_of])
    of = number[diagram.polygon_of[inside]]
    place = diagram.at(diagram.facet[diagram.polygon_of[inside]], diagram.barycentric[inside])
    count = np.bincount(of)
    centre = np.stack([np.bincount(of, coordinate) / count for coordinate in place.T], axis=1)

    edge: npt.NDArray[Any] = inside[diagram.label[inside] < 0]
    facet = diagram.facet[diagram.polygon_of[edge]]
    across = surface.face_neighbours[facet, -1 - diagram.label[edge]]
    once = across > facet
    edge, facet, across = edge[once], facet[once], across[once]
    polygon, following = diagram.polygon_of[edge], diagram.following[edge]
    pair = number[np.stack([polygon, diagram.polygon_index(across, diagram.site[polygon])], axis=1)]
    gate = diagram.at(facet, 0.5 * (diagram.barycentric[edge] + diagram.barycentric[following]))
    length = np.linalg.norm(centre[pair] - gate[:, None], axis=2).sum(axis=1)
    ends = np.stack([diagram.point_at(end) for end in (edge, following)], axis=1)
    ends[(ends >= 0) & surface.on_boundary[ends]] = -1
    return _Patches(cell=cell[kept], centre=centre, pair=pair, gate=gate, length=length, ends=ends)


def _nearest(patches: _Patches, points: EmbeddedPoints) -> Indices:
    """Return the polygon of each cell whose centre is nearest to the point of the cell (n cells, d)."""
    distance = np.linalg.norm(patches.centre - points[patches.cell], axis=1)
    order = np.lexsort((distance, patches.cell))
    return order[np.searchsorted(patches.cell[order], np.arange(len(points)))]


def _shortest_loops(patches: _Patches, roots: Indices) -> dict[int, _Loop]:
    """Return by cell the shortest loop through a root polygon in each cell (n,), where there is one."""
    n = len(patches.cell)
    weight = np.maximum(patches.length, np.finfo(np.float64).tiny)
    graph = coo_array((weight, (patches.pair[:, 0], patches.pair[:, 1])), shape=(n, n)).tocsr()
    distance, before, _ = dijkstra(graph, directed=False, indices=roots, min_only=True, return_predecessors=True)
    here, there = patches.pair.T
    pairs, sides = np.unique(patches.pair, axis=0, return_index=True)  # two polygons can share more than one side
    crossed = np.zeros(len(weight), dtype=bool)
    crossed[sides] = (before[pairs[:, 1]] == pairs[:, 0]) | (before[pairs[:, 0]] == pairs[:, 1])
    cut = _cut_locus(patches.ends, crossed)
    order = cut[np.lexsort(((distance[here] + weight + distance[there])[cut], patches.cell[here[cut]]))]
    names, first = np.unique(patches.cell[here[order]], return_index=True)
    gates = {frozenset(pair): patches.gate[side] for pair, side in zip(pairs.tolist(), sides.tolist(), strict=True)}
    loops = {}
    for name, side in zip(names.tolist(), order[first].tolist(), strict=True):
        out, back = (_way_from_root(patches.centre, before, gates, end) for end in patches.pair[side].tolist())
        loops[name] = _Loop(np.array([*out, patches.gate[side], *back[::-1]]))
    return loops


def _way_from_root(
    centre: EmbeddedPoints, before: npt.NDArray[np.int32], gates: dict[frozenset[int], EmbeddedPoints], polygon: int
) -> list[EmbeddedPoints]:
    """Return the corners of the path through the tree to a polygon."""
    way = [centre[polygon]]
    while (parent := int(before[polygon])) >= 0:
        way += [gates[frozenset((parent, polygon))], centre[parent]]
        polygon = parent
    return way[::-1]


def _cut_locus(ends: Indices, crossed: npt.NDArray[np.bool_]) -> Indices:
    """Return the sides (n,) not crossed by a tree that are left when sides with a hanging end are pruned.

    An end on the boundary of a cell never hangs; an end at a point of the surface hangs if no other side ends there.
    """
    left = np.flatnonzero(~crossed)
    while len(left):
        inner = ends[left] >= 0
        count = np.bincount(ends[left][inner], minlength=ends.max(initial=0) + 1)
        hanging = (inner & (count[ends[left]] == 1)).any(axis=1)
        if not hanging.any():
            break
        left = left[~hanging]
    return left
