"""Preservation of the creases and corners of a surface by a remesh."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from anisomesh._arrays import EdgeMask
from anisomesh.errors import OptionError
from anisomesh.features.detect import corners, points_along, sharp_edges
from anisomesh.mesh.surface import Surface

FEATURE_TOLERANCE = 0.004  # length at bounding-box diagonal 1: the distance of the paper's F1

_SAMPLES_PER_TOLERANCE = 10  # points per length: distances between creases are off by less than 1 % of the tolerance
_MAX_CREASE_SAMPLES = 2_000_000  # bounds the memory for small tolerances
_MIN_RESULT_ANGLE = 0.5  # fraction of the crease angle: a chord of a curved crease has a smaller dihedral angle


@dataclass(frozen=True, kw_only=True)
class FeaturePreservation:
    """Creases and corners of a reference that a remesh preserves.

    Attributes
    ----------
    crease_length
        Total length of the creases of the reference, in its units.
    crease_covered
        Fraction of this length within the tolerance of a crease of the remesh; 1 if the reference has no creases.
    corners, corners_kept
        Number of corners of the reference, and of corners with a vertex of the remesh within the tolerance.
    """

    crease_length: float
    crease_covered: float
    corners: int
    corners_kept: int

    def as_dict(self) -> dict[str, Any]:
        """Return the values under their names, for JSON."""
        return asdict(self)


def feature_preservation(
    reference: Surface, result: Surface, *, crease_angle: float = 30.0, tolerance: float = FEATURE_TOLERANCE
) -> FeaturePreservation:
    """Return which part of the creases and corners of a reference a remesh preserves.

    Parameters
    ----------
    reference, result
        The surface and its remesh, in the same units.
    crease_angle
        Angle in degrees between the normals of two faces above which their edge is a crease of the reference. Half
        this angle makes a crease of the remesh, as a chord of a curved crease is less sharp than the crease; edges of
        the remesh with more than two faces are creases too.
    tolerance
        Largest distance, in units of the surfaces, at which a crease or corner counts as preserved.

    Raises
    ------
    OptionError
        If the tolerance is not positive.

    Notes
    -----
    See :func:`anisomesh.features.detect.corners` for corners. Distances between creases are taken between points on
    both, a tenth of the tolerance apart, so they are off by less than 1 % of the tolerance. The measure is defined
    here; the paper has none for features along their length.
    """
    if not (np.isfinite(tolerance) and tolerance > 0.0):
        raise OptionError(f"tolerance is {tolerance}; expected a positive length")
    sharp = sharp_edges(reference, crease_angle)
    at_corner = reference.points[corners(reference, sharp)]
    kept = cKDTree(result.points[np.unique(result.faces)]).query(at_corner)[0] <= tolerance
    return FeaturePreservation(
        crease_length=float(reference.edge_lengths[sharp].sum()),
        crease_covered=_covered(reference, result, sharp, _MIN_RESULT_ANGLE * crease_angle, tolerance),
        corners=len(at_corner),
        corners_kept=int(kept.sum()),
    )


def _covered(
    reference: Surface,
    result: Surface,
    sharp: EdgeMask,
    angle: float,
    tolerance: float,
) -> float:
    """Return the fraction of the length of the sharp edges within the tolerance of a crease of the result."""
    if not sharp.any():
        return 1.0
    spacing = max(tolerance / _SAMPLES_PER_TOLERANCE, float(reference.edge_lengths[sharp].sum()) / _MAX_CREASE_SAMPLES)
    creases = sharp_edges(result, angle) | (result.edge_face_count > 2)
    found = points_along(result, creases, spacing)
    if len(found) == 0:
        return 0.0
    # midpoint rule: every sharp edge in equal pieces, each tested at its midpoint and weighted by its length
    ends = reference.points[reference.edges[sharp]]
    length = reference.edge_lengths[sharp]
    count = np.maximum(np.ceil(length / spacing).astype(np.int64), 1)
    which = np.repeat(np.arange(len(count)), count)
    parameter = (np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[which]
    midpoints = (1.0 - parameter)[:, None] * ends[which, 0] + parameter[:, None] * ends[which, 1]
    near = cKDTree(found).query(midpoints)[0] <= tolerance
    weight = (length / count)[which]
    return float(weight[near].sum() / weight.sum()) if not near.all() else 1.0
