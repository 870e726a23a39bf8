"""Moving sites from where they matter least to where the dual is farthest from the surface."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from anisomesh._arrays import Sites
from anisomesh.cvt.features import Features
from anisomesh.delaunay.creases import creased_cells
from anisomesh.delaunay.dual import dual_mesh
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.voronoi.cells import cells_of
from anisomesh.voronoi.intervals import Mask
from anisomesh.voronoi.restricted import RestrictedVoronoi

_SHARE = 0.02  # of the sites, at most, that are exchanged
_WORTH = 4.0  # a point is missed if its squared distance is that many times the mean
_CREASE_SHARE = 0.2  # of the sites that are not on boundary or creases, at most, that go to creases at once
_POOL = 20  # candidates looked at per site exchanged


def exchange_sites(
    voronoi: RestrictedVoronoi,
    sites: Sites,
    surface: Surface,
    scale: float,
    sharpness: float,
    *,
    kept: npt.NDArray[np.bool_] | None = None,
) -> Sites:
    """Return as many sites (S, d), some of them moved to points of the surface that the dual misses.

    Parameters
    ----------
    voronoi
        The diagram over the embedded surface.
    sites
        Optimised positions (S, d).
    surface
        The surface in space, its faces in the order of ``voronoi``.
    scale
        The factor of the first three embedded coordinates.
    sharpness
        The factor s of the normal metric of the energy by which the least important sites are found.
    kept
        Sites that do not go (S,).

    Notes
    -----
    Descent of the energy moves sites within their neighbourhood; a corner or the end of a crease that no site has
    come near stays missed. New sites are points of the surface that are farthest from the dual, no two in one
    cell; the sites of lowest energy, no two of them neighbours, go.
    """
    diagram = voronoi.diagram(sites)
    cells = cells_of(diagram, surface.face_neighbours, voronoi.facets.area)
    dual = dual_mesh(diagram, cells, surface)
    if len(dual.faces) == 0:
        return sites
    squared = ClosestPoints(Surface(dual.points[:, :3] / scale, dual.faces)).squared_distances(surface.points)
    spacing = float(np.sqrt(voronoi.facets.area.sum() / len(sites)))
    n = max(1, int(_SHARE * len(sites)))
    new = _spaced(voronoi.points, np.argsort(-squared, kind="stable"), n, spacing)
    new = new[squared[new] > _WORTH * squared.mean()]
    order = np.argsort(voronoi.evaluate(sites, sharpness).cell_energy, kind="stable")
    if kept is not None:
        order = order[~kept[order]]
    old = _spaced(sites, order, len(new), 2.0 * spacing)
    result = np.array(sites)
    result[old] = voronoi.points[new[: len(old)]]
    return result


def bring_to_creases(
    voronoi: RestrictedVoronoi,
    sites: Sites,
    surface: Surface,
    features: Features,
    sharpness: float,
    on_boundary: Mask,
    on_crease: Mask,
) -> tuple[Sites, Mask]:
    """Return as many sites (S, d), some of them moved to where a cell has more of a crease than fits it, and a mask.

    Parameters
    ----------
    voronoi, sites, surface, sharpness
        As above.
    features
        Boundary and creases of the surface.
    on_boundary, on_crease
        Sites that are there already and stay (S,). Those that come to a crease are added to the second in the result.
    """
    diagram = voronoi.diagram(sites)
    cells = cells_of(diagram, surface.face_neighbours, voronoi.facets.area)
    rim, arcs = features.boundary.arcs(diagram), features.creases.arcs(diagram)
    missing = creased_cells(features.creases, arcs, rim, cells, sites).missing
    order = np.argsort(voronoi.evaluate(sites, sharpness).cell_energy, kind="stable")
    order = order[~(on_boundary | on_crease)[order]]
    n = min(len(missing), int(_CREASE_SHARE * len(order)))
    spacing = float(np.sqrt(voronoi.facets.area.sum() / len(sites)))
    gone = _spaced(sites, order, n, spacing)
    moved, there = np.array(sites), np.array(on_crease)
    moved[gone], there[gone] = missing[: len(gone)], True
    return moved, there


def _spaced(
    positions: npt.NDArray[np.float64], order: npt.NDArray[np.int64], n: int, distance: float
) -> npt.NDArray[np.int64]:
    """Return the first n of the positions (m, d), in an order of preference, that are so far apart."""
    pool = order[: _POOL * n]
    tree = cKDTree(positions[pool])
    blocked = np.zeros(len(pool), dtype=bool)
    chosen: list[int] = []
    for k in range(len(pool)):
        if len(chosen) == n:
            break
        if not blocked[k]:
            chosen.append(k)
            blocked[tree.query_ball_point(positions[pool[k]], distance)] = True
    return np.asarray(pool[np.array(chosen, dtype=np.int64)])
