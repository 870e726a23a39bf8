"""How much of the creases and corners of a surface a remesh has kept."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from anisomesh.errors import OptionError
from anisomesh.features.detect import corners, points_along, sharp_edges
from anisomesh.mesh.surface import Surface

DEFAULT_TOLERANCE = 0.004
_FINENESS = 10  # points on creases per tolerance
_MOST_POINTS = 2_000_000  # in all, for tiny tolerances


@dataclass(frozen=True, kw_only=True)
class FeaturePreservation:
    """Creases and corners of a reference that a remesh has.

    Attributes
    ----------
    crease_length
        Total length of the creases of the reference, in its units.
    crease_covered
        Share of that length within the tolerance of a bent edge of the remesh; 1 if there are no creases.
    corners, corners_kept
        Corners of the reference, and how many have a vertex of the remesh within the tolerance.
    """

    crease_length: float
    crease_covered: float
    corners: int
    corners_kept: int

    def as_dict(self) -> dict[str, Any]:
        """Return the values under their names, for JSON."""
        return asdict(self)


def feature_preservation(
    reference: Surface, result: Surface, *, crease_angle: float = 30.0, tolerance: float = DEFAULT_TOLERANCE
) -> FeaturePreservation:
    """Return how much of the creases and corners of a reference a remesh has.

    Parameters
    ----------
    reference, result
        The surface and its remesh, in the same units.
    crease_angle
        Creases of the reference are edges whose faces differ by more than this many degrees. Edges of the remesh count
        as bent from half of it on: a chord of a curved crease is less sharp than the crease.
    tolerance
        Distance up to which a crease or corner counts as kept, in the units of the surfaces.

    Raises
    ------
    OptionError
        If the tolerance is not positive.

    Notes
    -----
    Corners are points where creases end, meet in numbers other than two, or turn by more than 45 degrees. The distance
    between creases is taken between points on both at a tenth of the tolerance, so it is off by less than 1 %.
    """
    if not (np.isfinite(tolerance) and tolerance > 0.0):
        raise OptionError(f"tolerance is {tolerance}; expected a positive length")
    sharp = sharp_edges(reference, crease_angle)
    at_corner = reference.points[corners(reference, sharp)]
    kept = cKDTree(result.points[np.unique(result.faces)]).query(at_corner)[0] <= tolerance
    return FeaturePreservation(
        crease_length=float(reference.edge_lengths[sharp].sum()),
        crease_covered=_covered(reference, result, sharp, 0.5 * crease_angle, tolerance),
        corners=len(at_corner),
        corners_kept=int(kept.sum()),
    )


def _covered(
    reference: Surface,
    result: Surface,
    sharp: np.ndarray[tuple[int], np.dtype[np.bool_]],
    angle: float,
    tolerance: float,
) -> float:
    """Return the share of the length of the sharp edges that is near a bent edge of the result."""
    if not sharp.any():
        return 1.0
    spacing = max(tolerance / _FINENESS, float(reference.edge_lengths[sharp].sum()) / _MOST_POINTS)
    bent = points_along(result, sharp_edges(result, angle), spacing)
    if len(bent) == 0:
        return 0.0
    # every sharp edge in equal pieces, each judged at its middle and weighted by its length
    ends = reference.points[reference.edges[sharp]]
    length = reference.edge_lengths[sharp]
    count = np.maximum(np.ceil(length / spacing).astype(np.int64), 1)
    which = np.repeat(np.arange(len(count)), count)
    share = (np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[which]
    middles = (1.0 - share)[:, None] * ends[which, 0] + share[:, None] * ends[which, 1]
    near = cKDTree(bent).query(middles)[0] <= tolerance
    weight = (length / count)[which]
    return float(weight[near].sum() / weight.sum()) if not near.all() else 1.0
