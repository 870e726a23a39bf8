"""The measures of the paper, between point samples of two surfaces; equal surfaces have values above zero."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from scipy.spatial import cKDTree

from anisomesh._arrays import Floats
from anisomesh.errors import OptionError
from anisomesh.features.detect import sharp_edges
from anisomesh.mesh.sampling import points_on_edges, points_on_faces
from anisomesh.mesh.surface import Surface

DEFAULT_SAMPLES = 100_000  # points on each surface; NASM, section 4.1
CREASE_ANGLE = 30.0  # degrees between face normals; NASM, section 4.1

_F1_DISTANCE = 0.004  # threshold of F1 and EF1 at bounding-box diagonal 1; NASM, section 4.1
_WIDE_F1_DISTANCE = 0.005  # second threshold of EF1, at bounding-box diagonal 1; a common choice


@dataclass(frozen=True, kw_only=True)
class SampledMeasures:
    """Measures between point samples of two surfaces a and b; lengths in units of the surfaces.

    Attributes
    ----------
    chamfer
        CD: mean squared distance to the nearest sample of the other surface, sum of both directions, length^2.
    f1
        F1: harmonic mean of the fractions of samples of a and of b nearer than 0.004 to a sample of the other.
    normal_consistency
        NC: mean of ``|n . n'|`` over pairs of nearest samples, average of both directions.
    hausdorff
        HD: largest distance to the nearest sample of the other surface, maximum of both directions.
    edge_chamfer, edge_f1, edge_f1_wide
        ECD, EF1 and EF1 with 0.005 in place of 0.004: CD and F1 of samples of the creases. If neither surface has a
        crease: 0, 1 and 1. If only one has: None (not defined), 0 and 0.
    """

    chamfer: float
    f1: float
    normal_consistency: float
    hausdorff: float
    edge_chamfer: float | None
    edge_f1: float
    edge_f1_wide: float

    def as_dict(self) -> dict[str, float | None]:
        """Return the values under their names, for JSON."""
        return asdict(self)


def sampled_measures(
    a: Surface,
    b: Surface,
    *,
    samples: int = DEFAULT_SAMPLES,
    crease_angle: float = CREASE_ANGLE,
    seed: int | np.random.Generator = 0,
) -> SampledMeasures:
    """Return the measures of the paper between two surfaces.

    Parameters
    ----------
    a, b
        The surfaces, scaled so that the bounding-box diagonal of the reference is 1.
    samples
        Number of points on each surface, uniform by area, and on the creases of each, uniform by length.
    crease_angle
        Angle in degrees between the normals of two faces above which their edge is a crease.
    seed
        Seed or generator of the samples; equal seeds give equal results.

    Raises
    ------
    OptionError
        If ``samples`` is below 1.

    Notes
    -----
    Two independent samples of one surface of area A, N points each, have expected values CD = 2 A / (pi N), F1 = 1 -
    exp(-pi r^2 N / A) and HD of about sqrt(A log N / (pi N)). ``sampled_measures(a, a)`` measures this floor.

    References
    ----------
    NASM, section 4.1.
    """
    if samples < 1:
        raise OptionError(f"samples is {samples}; expected at least 1")
    rng = np.random.default_rng(seed)
    (points_a, face_a), (points_b, face_b) = (points_on_faces(surface, samples, rng) for surface in (a, b))
    normals_a, normals_b = a.face_normals[face_a], b.face_normals[face_b]
    ab, nearest_b = cKDTree(points_b).query(points_a, workers=-1)
    ba, nearest_a = cKDTree(points_a).query(points_b, workers=-1)
    agreement_a = np.abs(np.einsum("nx,nx->n", normals_a, normals_b[nearest_b])).mean()
    agreement_b = np.abs(np.einsum("nx,nx->n", normals_b, normals_a[nearest_a])).mean()
    edge_chamfer, edge_f1, edge_f1_wide = _crease_measures(a, b, samples, crease_angle, rng)
    return SampledMeasures(
        chamfer=_chamfer(ab, ba),
        f1=_f1(ab, ba, _F1_DISTANCE),
        normal_consistency=float(0.5 * (agreement_a + agreement_b)),
        hausdorff=float(max(ab.max(), ba.max())),
        edge_chamfer=edge_chamfer,
        edge_f1=edge_f1,
        edge_f1_wide=edge_f1_wide,
    )


def _crease_measures(
    a: Surface, b: Surface, samples: int, angle: float, rng: np.random.Generator
) -> tuple[float | None, float, float]:
    """Return CD, F1 and F1 at the wide distance of samples of the creases, by the rules of SampledMeasures."""
    points_a, points_b = (points_on_edges(surface, sharp_edges(surface, angle), samples, rng) for surface in (a, b))
    if len(points_a) == 0 and len(points_b) == 0:
        return 0.0, 1.0, 1.0
    if len(points_a) == 0 or len(points_b) == 0:
        return None, 0.0, 0.0
    ab = cKDTree(points_b).query(points_a, workers=-1)[0]
    ba = cKDTree(points_a).query(points_b, workers=-1)[0]
    return _chamfer(ab, ba), _f1(ab, ba, _F1_DISTANCE), _f1(ab, ba, _WIDE_F1_DISTANCE)


def _chamfer(ab: Floats, ba: Floats) -> float:
    """Return the chamfer distance of nearest distances of a (n,) and of b (m,)."""
    return float((ab**2).mean() + (ba**2).mean())


def _f1(ab: Floats, ba: Floats, distance: float) -> float:
    """Return the F1 score of nearest distances of a (n,) and of b (m,); 0 if all are at least the threshold."""
    recall, precision = float((ab < distance).mean()), float((ba < distance).mean())
    return 2.0 * precision * recall / (precision + recall) if precision + recall > 0.0 else 0.0
