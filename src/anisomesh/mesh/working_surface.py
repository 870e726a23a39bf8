"""The working surface of a remesh: the same surface, with edges short enough for the sites and for the metric."""

from __future__ import annotations

import numpy as np

from anisomesh.mesh.subdivision import Subdivision, split_long_edges
from anisomesh.mesh.surface import Surface

FINE_POINTS = 5_000  # the working surface has edges no longer than two of an even mesh of so many points
EDGE_FACTOR = 1.6  # and no longer than this many distances between sites
MAX_GROWTH = 8  # splitting makes at most so many times the faces, or MAX_SPLIT_FACES
MAX_SPLIT_FACES = 60_000


def working_surface(surface: Surface, n_vertices: int) -> Subdivision:
    """Return a surface with edges fine enough for so many sites, or as fine as the bound on its faces allows.

    Notes
    -----
    The embedding is linear on every facet, so facets must resolve both the distance between sites and, on
    sparse input such as CAD, the change of the metric next to a crease.
    """
    sites, fine = (_even_edge(surface.area, n) for n in (n_vertices, FINE_POINTS))
    longest = min(EDGE_FACTOR * sites, 2.0 * fine)
    return split_long_edges(surface, longest, max_faces=max(MAX_GROWTH * surface.n_faces, MAX_SPLIT_FACES))


def _even_edge(area: float, n: int) -> float:
    """Return the edge length of n vertices spread evenly in equilateral triangles over an area."""
    return float(np.sqrt(2.0 * area / (np.sqrt(3.0) * n)))
