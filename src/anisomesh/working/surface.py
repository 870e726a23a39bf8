"""The working surface of a remesh: the input surface with triangles that resolve the sites and the metric.

The embedding is linear on every facet. On input such as CAD exports, facets can be larger than the cells of many sites,
so that the metric next to a crease would be averaged over the whole facet, and slivers carry it across flat faces.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, Floats, PointLabels, PointMask
from anisomesh.mesh.geometry import even_edge_length
from anisomesh.mesh.surface import Surface
from anisomesh.working.delaunay_refinement import Refinement, refine_slivers
from anisomesh.working.marked_surface import MarkedSurface
from anisomesh.working.short_edges import collapse_short_edges
from anisomesh.working.subdivision import Subdivision, edges_within, split_long_edges

_MAX_EDGE_PER_SITE_DISTANCE = 1.6  # longest edge over the distance between evenly spread sites; heuristic
_METRIC_VERTICES = 5_000  # vertices of an even mesh that resolves the metric; the learned one is trained on such meshes
_MAX_EDGE_PER_METRIC_EDGE = 2.0  # longest edge over the edge length of that even mesh; heuristic
_MAX_FACE_GROWTH = 8  # at most this many times the input's faces, or _MIN_FACE_LIMIT; bounds time and memory
_MIN_FACE_LIMIT = 60_000  # faces
_MAX_ASPECT = 4.0  # longest side over the height on it, above which a triangle is a sliver; heuristic
_MIN_SLIVER_LENGTH = 0.7  # longest side, over the bound on edges, up to which slivers stay; heuristic
_MAX_SHORT_LENGTH = 0.2  # of an edge that is collapsed, over the bound on edges; heuristic
_MAX_SURPLUS_LENGTH = 0.5  # the same for edges that the refinement of slivers has made too short; heuristic
_SURPLUS_FACTOR = 2.0  # of the tolerance for all changes with these; the sum of their bounds overestimates; heuristic
_COARSENING_SHARE = 0.5  # of the tolerance that collapses may use up; heuristic
_TOLERANCE = 0.1  # times squared distance of sites over the diagonal; heuristic, below the error to be expected

_TAGGED = 2  # label of tagged edges, and 1 of other ones that are not flipped


@dataclass(frozen=True, kw_only=True, eq=False)
class WorkingSurface:
    """A working surface, and where its points come from.

    Attributes
    ----------
    surface
        The surface; its first points are the points of ``coarse``, unchanged.
    tagged
        Which of its edges (E',) are parts of tagged edges.
    coarse, coarse_tagged
        The input without short edges, itself if it has none, and which of its edges (E'',) are parts of tagged edges.
    """

    surface: Surface
    tagged: EdgeMask
    coarse: Surface
    coarse_tagged: EdgeMask
    _kept: PointLabels
    _refinement: Refinement
    _trimmed: PointLabels
    _subdivision: Subdivision

    def interpolate(self, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Interpolate values (V, ...) at the points of the input linearly to all points (V', ...)."""
        return self._subdivision.interpolate(self._refinement.interpolate(values[self._kept])[self._trimmed])

    def on_coarse(self, mask: PointMask) -> PointMask:
        """Return a mask of points of the input (V,) as a mask of the points of ``coarse``."""
        return np.asarray(mask[self._kept])


def working_surface(
    surface: Surface,
    n_vertices: int,
    *,
    creases: EdgeMask,
    tagged: EdgeMask,
    spacings: Callable[[Surface], Floats] | None = None,
) -> WorkingSurface:
    """Return the surface without short edges, slivers and long edges, as far as the limit on its faces allows.

    Parameters
    ----------
    surface
        A manifold surface at bounding-box diagonal 1.
    n_vertices
        Number of sites for which it is made; the surface moves by no more than a fifth of the square of their distance.
    creases, tagged
        Edges (E,) that stay in place; tagged ones are found again in the result.
    spacings
        If sites are spread unevenly, the lengths of the edges (E,) of a surface over the distance of sites along them:
        they have the same bound as with evenly spread ones.
    """
    site_distance, metric_edge = (even_edge_length(surface.area, n) for n in (n_vertices, _METRIC_VERTICES))
    max_length = min(_MAX_EDGE_PER_SITE_DISTANCE * site_distance, _MAX_EDGE_PER_METRIC_EDGE * metric_edge)
    max_faces = max(_MAX_FACE_GROWTH * surface.n_faces, _MIN_FACE_LIMIT)
    tolerance = _TOLERANCE * site_distance**2
    coarsening = collapse_short_edges(
        MarkedSurface.unmoved(surface, np.where(tagged, _TAGGED, creases).astype(np.int32)),
        max_length=_MAX_SHORT_LENGTH * max_length,
        tolerance=_COARSENING_SHARE * tolerance,
    )
    refinement = refine_slivers(
        coarsening.marked,
        max_aspect=_MAX_ASPECT,
        min_length=_MIN_SLIVER_LENGTH * max_length,
        tolerance=tolerance,
        max_faces=max_faces,
    )
    trimmed = collapse_short_edges(
        refinement.marked,
        max_length=_MAX_SURPLUS_LENGTH * max_length,
        tolerance=_SURPLUS_FACTOR * tolerance,
        n_kept=coarsening.surface.n_points,
    )
    refined = trimmed.surface

    def lengths(split: Surface) -> Floats:
        if spacings is None:
            return split.edge_lengths
        return np.maximum(split.edge_lengths, max_length / _MAX_EDGE_PER_SITE_DISTANCE * spacings(split))

    subdivision = split_long_edges(refined, max_length, max_faces=max(max_faces, refined.n_faces), lengths=lengths)
    return WorkingSurface(
        surface=subdivision.surface,
        tagged=edges_within(subdivision, refined, trimmed.marked.labels == _TAGGED),
        coarse=coarsening.surface,
        coarse_tagged=coarsening.marked.labels == _TAGGED,
        _kept=coarsening.kept,
        _refinement=refinement,
        _trimmed=trimmed.kept,
        _subdivision=subdivision,
    )
