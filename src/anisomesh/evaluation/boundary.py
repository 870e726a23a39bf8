"""How far the boundary curves of a remesh are from those of its reference."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import igl
import numpy as np
import numpy.typing as npt

from anisomesh.features.detect import points_along
from anisomesh.mesh.surface import Surface

_FINENESS = 1e-4  # of the diagonal of the reference between sample points
_MOST_POINTS = 1_000_000


@dataclass(frozen=True, kw_only=True)
class BoundaryDistance:
    """Distances between the boundary curves of two surfaces, in their units.

    Attributes
    ----------
    mean_ab, mean_ba
        Mean distance of the curves of the first from those of the second, by length, and the other way.
    max_ab, max_ba
        The same for the largest distance.
    """

    mean_ab: float
    mean_ba: float
    max_ab: float
    max_ba: float

    def as_dict(self) -> dict[str, Any]:
        """Return the values under their names, for JSON."""
        return asdict(self)


def boundary_distance(a: Surface, b: Surface) -> BoundaryDistance | None:
    """Return the distances between the boundary curves, None where one of the surfaces is closed.

    The distance is taken exactly from points at 1e-4 of the diagonal of ``a`` along the one boundary, with all its
    vertices, to the segments of the other.
    """
    if not (a.on_boundary.any() and b.on_boundary.any()):
        return None
    ab, ba = _distances(a, b, a.diagonal), _distances(b, a, a.diagonal)
    return BoundaryDistance(
        mean_ab=float(ab.mean()), mean_ba=float(ba.mean()), max_ab=float(ab.max()), max_ba=float(ba.max())
    )


def _distances(a: Surface, b: Surface, diagonal: float) -> npt.NDArray[np.float64]:
    rim, other = a.edge_face_count == 1, b.edges[b.edge_face_count == 1].astype(np.int64)
    spacing = max(_FINENESS * diagonal, float(a.edge_lengths[rim].sum()) / _MOST_POINTS)
    tree = igl.AABB()
    tree.init(b.points, other)
    queries = np.ascontiguousarray(points_along(a, rim, spacing or 1.0))
    squared = tree.squared_distance(b.points, other, queries)[0]
    return np.asarray(np.sqrt(squared), dtype=np.float64)
