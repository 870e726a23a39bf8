"""A surface without edges that are too short to matter: collapses within a tolerance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh._arrays import PointLabels
from anisomesh._kernels import collapse as kernels
from anisomesh._kernels.stars import Stars
from anisomesh.mesh.surface import Surface
from anisomesh.working.marked_surface import MarkedSurface

_SLIVER_FACTOR = 3.0  # of the length of edges that are collapsed, in slivers; heuristic
_SHARES = 0.5 ** np.arange(6, -1, -1)  # of the largest lengths, pass by pass: short edges first
_PASSES = 3  # over all faces for each of these; few collapses are left after two
_ROOM = 4_096  # faces around a point; a point with more, as in the middle of a fan, stays


@dataclass(frozen=True, kw_only=True, eq=False)
class Coarsening:
    """A surface with fewer points.

    Attributes
    ----------
    marked
        The surface. An edge has the label of the one that it has come from, the larger one of two.
    kept
        The point of the parent that each of its points is (V',).
    """

    marked: MarkedSurface
    kept: PointLabels

    @property
    def surface(self) -> Surface:
        """The surface itself."""
        return self.marked.surface


def collapse_short_edges(start: MarkedSurface, *, max_length: float, tolerance: float, n_kept: int = 0) -> Coarsening:
    """Collapse short edges of a surface, the shortest first.

    Parameters
    ----------
    start
        An oriented manifold surface. Marked edges form creases: a point on one only goes along it, and stays where it
        ends, meets others, changes its label or turns by more than 45 degrees. Boundaries are creases.
    max_length
        Edges up to this length may be collapsed, in model units; three times as long ones of slivers, triangles whose
        longest side is more than four times their height.
    tolerance
        Bound on the deviation of faces, including their present one, in model units.
    n_kept
        Number of points, from the first on, that are not removed.

    Returns
    -------
    Coarsening
        With the surface itself if nothing was collapsed.

    Notes
    -----
    Half-edge collapses: no new positions, so values at the points stay what they are. A collapse is made if it fulfils
    the link condition, no normal around it turns by more than 14 degrees, no triangle gets thin, and the surface has
    moved by no more than the tolerance in all. The distance that it moves is measured at the point that goes and at the
    middles of the new edges, and added to what the faces there have moved before.

    References
    ----------
    Dey, Edelsbrunner, Guha, Nekhayev, "Topology preserving edge contraction", 1999.
    """
    surface = start.surface
    own = np.arange(surface.n_points, dtype=np.int32)
    unchanged = Coarsening(marked=start, kept=own)
    if not (surface.edge_lengths <= _SLIVER_FACTOR * max_length).any():
        return unchanged
    mesh = start.triangulation(surface.n_faces)
    faces, corners, other_faces, other_corners = np.zeros((4, _ROOM), dtype=np.int32)
    stars = Stars(faces, corners, other_faces, other_corners, np.zeros(surface.n_points, dtype=np.uint8))
    total = 0
    for share in _SHARES:
        for _ in range(_PASSES):
            squares = (share * max_length) ** 2, (share * _SLIVER_FACTOR * max_length) ** 2
            count = kernels.collapse_short_edges(mesh, stars, n_kept, *squares, tolerance)
            total += count
            if count == 0:
                break
    if total == 0:
        return unchanged
    alive = mesh.faces[:, 0] >= 0
    kept, position = np.unique(mesh.faces[alive], return_inverse=True)
    result = Surface(surface.points[kept], position.reshape(-1, 3).astype(np.int32))
    return Coarsening(marked=MarkedSurface.of(result, mesh, alive), kept=kept.astype(np.int32))
