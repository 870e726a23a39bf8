"""Sites on the creases of the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from anisomesh._arrays import EmbeddedPoints, Sites
from anisomesh.features.creases import CreaseCurves, crease_curves
from anisomesh.features.detect import corners
from anisomesh.features.polylines import Ints
from anisomesh.mesh.surface import Surface
from anisomesh.voronoi.diagram import Diagram
from anisomesh.voronoi.intervals import Arcs, Mask, arcs_of, changes
from anisomesh.voronoi.restricted import RestrictedVoronoi

_SHORT_END = 0.1  # distances between sites: a loose end of a crease up to here is none
_MIN_NETWORK, _MIN_PIECE, _LOOSE = 2.0, 0.5, 2.5  # the same that a network has, each of its curves, each loose end
_MOST = 1.2  # of the distances between as many sites in a row: creases longer than that in all are too many


@dataclass(frozen=True, eq=False)
class CreaseArcs(Arcs):
    """Arcs of creases.

    Attributes
    ----------
    corners
        Points of the surface that are corners at start and end of each arc (A, 2), -1 for none.
    """

    corners: Ints

    def owners(self) -> tuple[Ints, Ints]:
        """Return an arc at each corner (n,), and the corner (n,)."""
        arc, end = np.nonzero(self.corners >= 0)
        point, first = np.unique(self.corners[arc, end], return_index=True)
        return arc[first], point


class Creases:
    """The creases of an embedded surface, for cells of about one size.

    Parameters
    ----------
    voronoi
        The diagram over the embedded surface.
    surface
        The surface in space, its faces in the order of ``voronoi``.
    n_sites
        Number of sites that the surface is divided among.
    edges
        Which edges of the surface (E,) are on a crease.
    always
        Which of these are followed in any case (E,); of the others those that the sites can follow.
    """

    def __init__(self, voronoi: RestrictedVoronoi, surface: Surface, n_sites: int, edges: Mask, always: Mask) -> None:
        self.always = always
        self.spacing = float(np.sqrt(2.0 * voronoi.facets.area.sum() / (np.sqrt(3.0) * n_sites)))
        self.curves: CreaseCurves = resolved(voronoi.points, surface, edges, always, self.spacing, _MOST * n_sites)

    def arcs(self, diagram: Diagram) -> CreaseArcs:
        """Return the arcs of a diagram over the surface, of each crease in order of their starts."""
        arcs = arcs_of(self.curves, diagram)
        ends = self.curves.ends[arcs.curve]
        first = changes(arcs.curve)
        last = np.append(first[1:], True)[: len(first)]
        at_end = np.stack([first, last], axis=1)
        return CreaseArcs(**vars(arcs), corners=np.where(at_end, ends, -1))

    def draw(self, diagram: Diagram, on_crease: Mask) -> tuple[Sites, Mask]:
        """Return the sites (S, d) with those of cells at a crease on it, and which these are (S,).

        Parameters
        ----------
        diagram
            The diagram of the sites.
        on_crease
            Which of them are there already (S,). Others go there if they have a corner or a long arc.

        Notes
        -----
        A site goes to the nearest corner in its cell, or else to the middle of its longest arc.
        """
        arcs = self.arcs(diagram)
        drawn, mask = arcs.draw(diagram.sites, on_crease, self.spacing)
        arc, point = arcs.owners()
        site = arcs.site[arc]
        distance = np.linalg.norm(self.curves.positions[point] - diagram.sites[site], axis=1)
        order = np.argsort(-distance, kind="stable")
        drawn[site[order]] = self.curves.positions[point[order]]  # of several the last, the nearest, stays
        mask[site] = True
        return drawn, mask


def resolved(
    positions: EmbeddedPoints, surface: Surface, edges: Mask, always: Mask, spacing: float, most: float
) -> CreaseCurves:
    """Return those creases of a surface that sites at a spacing can follow.

    Parameters
    ----------
    positions
        The embedded points (V, d).
    surface
        The surface in space.
    edges
        Which of its edges (E,) are on a crease.
    always
        Which of these are kept in any case (E,).
    spacing
        Distance between sites.
    most
        Length of all creases together, in spacings.

    Notes
    -----
    The creases of a rough scan are many short curves with loose ends, those of a machine part long ones that meet.
    Short loose ends go, then networks of creases that are short for their number of curves and loose ends, then the
    shortest networks, until the others are no longer than ``most``.
    """
    left = np.array(edges)
    while True:
        curves = crease_curves(positions, surface, left, corners(surface, left))
        if curves.n_curves == 0:
            return curves
        length = np.diff(curves.limits, axis=1)[:, 0] / spacing
        ends = curves.ends
        valence = np.bincount(ends[ends >= 0], minlength=surface.n_points)
        loose = (ends >= 0) & (valence[ends] == 1) & ~surface.on_boundary[ends]
        short = loose.any(axis=1) & (length < _SHORT_END)
        before = left.sum()
        left[curves.edge[short[curves.curve]]] = False
        left |= always
        if left.sum() == before:
            break
    graph = coo_array((np.ones(len(curves.point)), (curves.point, curves.head)), shape=(surface.n_points,) * 2)
    network = connected_components(graph, directed=False)[1][curves.point[curves.first[:-1]]]
    total = np.bincount(network, length)
    loose_ends = np.bincount(network, loose.sum(axis=1))
    wanted = total >= np.maximum(_MIN_NETWORK + _LOOSE * loose_ends, _MIN_PIECE * np.bincount(network))
    order = np.argsort(-total, kind="stable")
    kept = np.zeros(len(total), dtype=bool)
    kept[order] = (np.cumsum((total * wanted)[order]) <= most) & wanted[order]
    left[curves.edge[~kept[network[curves.curve]]]] = False
    left |= always
    return crease_curves(positions, surface, left, corners(surface, left))
