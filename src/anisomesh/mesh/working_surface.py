"""The working surface of a remesh: the input surface, subdivided until its facets resolve the sites and the metric.

The embedding is linear on every facet. On coarse input such as CAD, whose facets can be larger than the cells of many
sites, the metric next to a crease would otherwise be averaged over the whole facet.
"""

from __future__ import annotations

import numpy as np

from anisomesh.mesh.subdivision import Subdivision, split_long_edges
from anisomesh.mesh.surface import Surface

_MAX_EDGE_PER_SITE_DISTANCE = 1.6  # longest edge over the distance between evenly spread sites; heuristic
_METRIC_VERTICES = 5_000  # vertices of an even mesh that resolves the metric; the learned one is trained on such meshes
_MAX_EDGE_PER_METRIC_EDGE = 2.0  # longest edge over the edge length of that even mesh; heuristic
_MAX_FACE_GROWTH = 8  # at most this many times the input's faces, or _MIN_FACE_LIMIT; bounds time and memory
_MIN_FACE_LIMIT = 60_000  # faces


def working_surface(surface: Surface, n_vertices: int) -> Subdivision:
    """Subdivide a surface for remeshing with ``n_vertices`` sites, as far as the limit on its faces allows."""
    site_distance, metric_edge = (_even_edge_length(surface.area, n) for n in (n_vertices, _METRIC_VERTICES))
    max_length = min(_MAX_EDGE_PER_SITE_DISTANCE * site_distance, _MAX_EDGE_PER_METRIC_EDGE * metric_edge)
    return split_long_edges(surface, max_length, max_faces=max(_MAX_FACE_GROWTH * surface.n_faces, _MIN_FACE_LIMIT))


def _even_edge_length(area: float, n_vertices: int) -> float:
    """Return the edge length of a mesh of equilateral triangles with this area and number of vertices."""
    return float(np.sqrt(2.0 * area / (np.sqrt(3.0) * n_vertices)))
