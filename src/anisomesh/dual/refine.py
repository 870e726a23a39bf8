"""Refinement of the sites until the dual is a valid mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh._arrays import FaceIndices, Sites
from anisomesh.cvt.diagram import Diagram
from anisomesh.cvt.optimise import minimise
from anisomesh.cvt.voronoi import RestrictedVoronoi
from anisomesh.dual.cells import Cells, cells_of
from anisomesh.dual.defects import Defects, find_defects, insertion_points
from anisomesh.dual.triangulate import Dual, dual_mesh

_SPACING = 0.02  # of the mean site distance: no site is inserted nearer to another


@dataclass(frozen=True, kw_only=True)
class Refined:
    """A dual, the sites and the diagram it comes from, and what the refinement did.

    ``inserted`` counts the sites added, ``defects`` tells what is left.
    """

    sites: Sites
    diagram: Diagram
    cells: Cells
    dual: Dual
    inserted: int
    rounds: int
    defects: Defects


def refine(
    voronoi: RestrictedVoronoi,
    sites: Sites,
    face_neighbours: FaceIndices,
    *,
    sharpness: float,
    max_rounds: int = 12,
    iterations: int = 4,
) -> Refined:
    """Insert sites where the dual has a defect, re-optimise, repeat.

    Parameters
    ----------
    voronoi
        The diagram over the embedded surface.
    sites
        Optimised positions (S, d).
    face_neighbours
        Face across each side (F, 3) of the faces of ``voronoi``.
    sharpness
        The factor s of the normal metric.
    max_rounds
        Bound on the number of rounds.
    iterations
        Optimiser iterations after each insertion.

    Notes
    -----
    A triangle turned against the surface, a tangled triangle and a cell that is no disk each ask for a site at
    a vertex of the diagram, the centre of a ball without sites. No site is put nearer than a fixed distance to
    another, so the number of insertions is bounded; the rounds are bounded besides, and what is left is
    returned. In the limit of dense sites every cell is a disk and the dual is homeomorphic to the surface
    (closed ball property, Edelsbrunner and Shah 1997).
    """
    spacing = _SPACING * float(np.sqrt(voronoi.facets.area.sum() / len(sites)))
    n_start = len(sites)
    for round_ in range(max_rounds + 1):
        diagram = voronoi.diagram(sites)
        cells = cells_of(diagram, face_neighbours, voronoi.facets.area)
        dual = dual_mesh(diagram, cells)
        defects = find_defects(diagram, cells, dual, voronoi.facets.normal)
        if defects.n == 0 or round_ == max_rounds:
            break
        new = insertion_points(diagram, cells, dual, defects, spacing)
        if len(new) == 0:
            break
        sites = minimise(
            voronoi, np.concatenate([sites, new]), sharpness=sharpness, max_iterations=iterations
        ).sites
    return Refined(
        sites=sites,
        diagram=diagram,
        cells=cells,
        dual=dual,
        inserted=len(sites) - n_start,
        rounds=round_,
        defects=defects,
    )
