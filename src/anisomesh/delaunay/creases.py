"""The dual at creases: vertices of cells on them, and edges along them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from anisomesh._arrays import EmbeddedPoints, Faces, Points, Sites
from anisomesh.cvt.creases import CreaseArcs, Creases
from anisomesh.features.polylines import Ints
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.voronoi.cells import Cells
from anisomesh.voronoi.intervals import LONG, Arcs, Mask, changes, nearest_to_sites

_NEAR = 0.1  # of the distance between sites: a site so near to a crease belongs to it
_BEND = 1e-3  # of its chord that the middle of a curved arc is off it, at least
APART = 0.1  # distances between sites that a new one on an arc is from others, at least
_SAME = 1e-6  # of the distance between sites: a place so near to a corner is the corner


@dataclass(frozen=True, eq=False)
class CreasedCells:
    """Cells that belong to a crease, n of them, and where their vertices go.

    Attributes
    ----------
    cell
        The component (n,).
    place
        The corner in it, or the middle of its longest arc, or, at the boundary, the place there (n, d).
    chord
        From the start to the end of its longest arc (n, d).
    bent
        Whether that arc is no straight line (n,); those that the user names and the faces do not show are not.
    corner
        Whether it is a corner or at the boundary (n,).
    missing
        Places that need a cell of their own (m, d): further corners, then further long arcs from the longest on, but
        none where a site is near: sites one beside the other would follow a crease at the pace of their distance.
    links
        Components that follow each other on a crease and belong to it (l, 2).
    bridges
        Paths of components along a crease of which the first and the last belong to it and those between do not.
    """

    cell: Ints
    place: EmbeddedPoints
    chord: EmbeddedPoints
    bent: Mask
    corner: Mask
    missing: EmbeddedPoints
    links: Ints
    bridges: list[list[int]]


def creased_cells(creases: Creases, arcs: CreaseArcs, rim: Arcs, cells: Cells, sites: Sites) -> CreasedCells:
    """Return the cells at a crease.

    Parameters
    ----------
    creases
        The creases of the surface.
    arcs, rim
        What the cells cut creases and boundary into.
    cells
        The components of the cells.
    sites
        Their sites (S, d).

    Notes
    -----
    A cell belongs to the crease that it has the longest arc of, if that is long or the site is near it; one with a
    corner belongs to all arcs that end there. An edge of the dual follows a crease from one cell that belongs to it to
    the next, unless a cell that does not belong to it is between them.
    """
    positions, spacing = creases.curves.positions, creases.spacing
    component = cells.of_polygon[arcs.polygon].astype(np.int64)
    nearest = nearest_to_sites(arcs, creases.curves, np.arange(len(component)), sites)
    at_rim = np.zeros(len(cells.site), dtype=bool)
    at_rim[cells.of_polygon[rim.polygon]] = True
    own, corner, place = _anchors(creases, arcs, rim, cells, sites, nearest)
    belongs = ((arcs.corners == corner[component][:, None]) & (arcs.corners >= 0)).any(axis=1)
    belongs |= own[component] == np.arange(len(component))
    runs = _runs(creases, arcs, belongs)
    links = component[np.array([[run[0], run[-1]] for run in runs], dtype=np.int64).reshape(-1, 2)]
    gaps = [run for run in runs if len(run) > 2]
    arc, point = arcs.owners()
    further = point[(corner[component[arc]] != point) & ~at_rim[component[arc]]]
    inner = [np.array(gap[1:-1]) for gap in gaps]
    wide = [k[np.argmax(arcs.length[k])] for k in inner if arcs.length[k].sum() > LONG * spacing]
    wide.sort(key=lambda k: -arcs.length[k])
    on_arcs = nearest[np.array(wide, dtype=np.int64)]
    apart = cKDTree(sites).query(on_arcs)[0] > APART * spacing
    cell = np.flatnonzero((own >= 0) | (corner >= 0))
    start, end = (creases.curves.at(at[own[cell]], arcs.curve[own[cell]]) for at in (arcs.start, arcs.end))
    return CreasedCells(
        cell=cell,
        place=place[cell],
        chord=end - start,
        bent=_bent(creases, arcs, own[cell], end - start) & (own[cell] >= 0),
        corner=(corner[cell] >= 0) | at_rim[cell],
        missing=np.concatenate([positions[further], on_arcs[apart]]),
        links=links[links[:, 0] != links[:, 1]],
        bridges=[component[gap].tolist() for gap in gaps],
    )


def _anchors(
    creases: Creases, arcs: CreaseArcs, rim: Arcs, cells: Cells, sites: Sites, nearest: EmbeddedPoints
) -> tuple[Ints, Ints, EmbeddedPoints]:
    """Return for each cell its arc (C,), or else its corner (C,), -1 for none, and the place of its vertex (C, d).

    ``nearest`` are the points of the arcs closest to their sites (A, d).
    """
    positions, spacing = creases.curves.positions, creases.spacing
    component = cells.of_polygon[arcs.polygon]
    own, corner = np.full((2, len(cells.site)), -1, dtype=np.int64)
    place = np.zeros((len(cells.site), positions.shape[1]))
    near = np.linalg.norm(nearest - sites[arcs.site], axis=1) < _NEAR * spacing
    order = np.argsort(arcs.length, kind="stable")
    order = order[((arcs.length > LONG * spacing) | near)[order]]
    own[component[order]] = order  # of several the last, the longest, stays; so below
    place[component[order]] = arcs.place[order]
    arc, point = arcs.owners()
    order = np.argsort(-np.linalg.norm(positions[point] - sites[arcs.site[arc]], axis=1), kind="stable")
    corner[component[arc[order]]] = point[order]
    place[corner >= 0] = positions[corner[corner >= 0]]
    rim_cell = cells.of_polygon[rim.polygon]
    order = np.argsort(rim.length, kind="stable")
    place[rim_cell[order]] = rim.place[order]
    away = np.linalg.norm(place - positions[corner], axis=1) > _SAME * spacing
    own[corner >= 0] = -1
    own[rim_cell] = -1
    corner[away] = -1
    return own, corner, place


def _bent(creases: Creases, arcs: CreaseArcs, which: Ints, chord: EmbeddedPoints) -> Mask:
    """Return which of these arcs (n,) are clearly off their chords (n, d) in space, on creases that the faces show."""
    curves = creases.curves
    start = curves.at(arcs.start[which], arcs.curve[which])
    off = np.linalg.norm(np.cross(arcs.place[which, :3] - start[:, :3], chord[:, :3]), axis=1)
    side = curves.side_at(0.5 * (arcs.start[which] + arcs.end[which]), arcs.curve[which])
    return np.asarray((off > _BEND * (chord[:, :3] ** 2).sum(axis=1)) & ~creases.always[curves.edge[side]])


def _runs(creases: Creases, arcs: CreaseArcs, belongs: Mask) -> list[list[int]]:
    """Return runs of arcs along a crease of which the first and the last belong to it and those between do not."""
    found = []
    first = [*np.flatnonzero(changes(arcs.curve)).tolist(), len(arcs.curve)]
    for begin, end in pairwise(first):
        on = (begin + np.flatnonzero(belongs[begin:end])).tolist()
        found += [list(range(a, b + 1)) for a, b in pairwise(on)]
        if creases.curves.closed[arcs.curve[begin]] and len(on) > 1:
            found.append([*range(on[-1], end), *range(begin, on[0] + 1)])
    return found


def join_along_creases(points: Points, faces: Faces, bridges: list[list[int]], reference: ClosestPoints) -> Faces:
    """Return the faces (F, 3) after flips that give an edge from the first to the last point of each bridge.

    Parameters
    ----------
    points, faces
        An oriented manifold mesh (V, 3), (F, 3).
    bridges
        Paths of points.
    reference
        The surface that the mesh stands for.

    Notes
    -----
    Points between the ends are cut off the path one by one. Of the two fans of triangles around such a point between
    those next to it the one goes whose place a triangle of the three takes that faces as the surface does. Where one
    of the points cannot be cut off the triangles stay as they are.
    """
    mesh = _Triangles(faces)
    for bridge in bridges:
        path, done = list(bridge), []
        while len(path) > 2:
            for k in range(1, len(path) - 1):
                cut = mesh.cut_off(path[k - 1], path[k], path[k + 1], points, reference)
                if cut is not None:
                    done.append(cut)
                    del path[k]
                    break
            else:
                for old, new in reversed(done):
                    mesh.exchange(new, old)
                break
    return mesh.faces()


Triangle = tuple[int, int, int]
Exchange = tuple[list[Triangle], list[Triangle]]


class _Triangles:
    """Oriented triangles, found by their directed edges."""

    def __init__(self, faces: Faces) -> None:
        self._across: dict[tuple[int, int], int] = {}
        self.exchange([], [(a, b, c) for a, b, c in faces.tolist()])

    def exchange(self, old: list[Triangle], new: list[Triangle]) -> None:
        """Put triangles in the place of others."""
        for a, b, c in old:
            del self._across[a, b], self._across[b, c], self._across[c, a]
        for a, b, c in new:
            self._across[a, b], self._across[b, c], self._across[c, a] = c, a, b

    def cut_off(
        self, before: int, middle: int, after: int, points: Points, reference: ClosestPoints
    ) -> Exchange | None:
        """Join two neighbours of a point; return the triangles before and after, None if that cannot be."""
        if before == after:
            return None
        if self._joined(before, after):
            return [], []
        for first, last in ((before, after), (after, before)):
            fan = self._fan(middle, first, last)
            if fan is None or any(self._joined(first, point) for point in fan[2:]):
                continue
            spokes = list(pairwise(fan))
            old = [(middle, a, b) for a, b in spokes]
            new = [(middle, first, last), *((first, a, b) for a, b in spokes[1:])]
            if reference.clearly_facing(points[np.array(new)]).all():
                self.exchange(old, new)
                return old, new
        return None

    def faces(self) -> Faces:
        """Return the triangles (F, 3)."""
        return np.array([(a, b, c) for (a, b), c in self._across.items() if a < b and a < c], dtype=np.int32)

    def _joined(self, a: int, b: int) -> bool:
        return (a, b) in self._across or (b, a) in self._across

    def _fan(self, centre: int, first: int, last: int) -> list[int] | None:
        """Return the neighbours of a point from one to another, counter-clockwise; None where the boundary is."""
        result = [first]
        while result[-1] != last:
            following = self._across.get((centre, result[-1]))
            if following is None or following == first:
                return None
            result.append(following)
        return result
