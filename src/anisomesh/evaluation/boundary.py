"""Distances between the boundaries of a remesh and its reference."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import igl
import numpy as np
import numpy.typing as npt

from anisomesh.features.detect import points_along
from anisomesh.mesh.surface import Surface

_BOUNDARY_SPACING = 1e-4  # between sample points, over the diagonal of the reference; below errors of interest
_MAX_BOUNDARY_SAMPLES = 1_000_000  # bounds the memory for long boundaries


@dataclass(frozen=True, kw_only=True)
class BoundaryDistance:
    """Distances between the boundaries of two surfaces a and b, in units of the surfaces.

    Attributes
    ----------
    mean_ab, mean_ba
        Mean distance, by length, from the boundary of a to the boundary of b, and from b to a.
    max_ab, max_ba
        Largest distance from boundary a to boundary b, and from b to a (lower bounds of the one-sided Hausdorff
        distances).
    """

    mean_ab: float
    mean_ba: float
    max_ab: float
    max_ba: float

    def as_dict(self) -> dict[str, Any]:
        """Return the values under their names, for JSON."""
        return asdict(self)


def boundary_distance(a: Surface, b: Surface) -> BoundaryDistance | None:
    """Return the distances between the boundaries of two surfaces, or None if one of them is closed.

    Distances go from points on one boundary, at most 1e-4 of the diagonal of ``a`` apart and with all its vertices, to
    the closest points on the segments of the other. The measure is defined here, not in the paper.
    """
    if not (a.on_boundary.any() and b.on_boundary.any()):
        return None
    ab, ba = _distances(a, b, a.diagonal), _distances(b, a, a.diagonal)
    return BoundaryDistance(
        mean_ab=float(ab.mean()), mean_ba=float(ba.mean()), max_ab=float(ab.max()), max_ba=float(ba.max())
    )


def _distances(a: Surface, b: Surface, diagonal: float) -> npt.NDArray[np.float64]:
    """Return the distances (n,) of points along the boundary of a from the boundary of b."""
    boundary, other = a.edge_face_count == 1, b.edges[b.edge_face_count == 1].astype(np.int64)
    spacing = max(_BOUNDARY_SPACING * diagonal, float(a.edge_lengths[boundary].sum()) / _MAX_BOUNDARY_SAMPLES)
    tree = igl.AABB()
    tree.init(b.points, other)
    queries = np.ascontiguousarray(points_along(a, boundary, spacing or 1.0))
    squared = tree.squared_distance(b.points, other, queries)[0]
    return np.asarray(np.sqrt(squared), dtype=np.float64)
