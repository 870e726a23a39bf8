"""The paper's measures: distances between point samples of two surfaces, which have a floor above zero."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from scipy.spatial import cKDTree

from anisomesh._arrays import Floats
from anisomesh.errors import OptionError
from anisomesh.features.detect import sharp_edges
from anisomesh.mesh.sampling import points_on_edges, points_on_faces
from anisomesh.mesh.surface import Surface

DEFAULT_SAMPLES = 100_000
F1_DISTANCE = 0.004  # of the paper, at bounding-box diagonal 1
WIDE_F1_DISTANCE = 0.005
CREASE_ANGLE = 30.0  # degrees


@dataclass(frozen=True, kw_only=True)
class SampledMeasures:
    """Measures between samples of two surfaces a and b; lengths in units of the surfaces.

    Attributes
    ----------
    chamfer
        CD: mean squared distance to the nearest sample of the other surface, sum of both directions.
    f1
        F1: harmonic mean of the shares of samples nearer than 0.004 to the other's samples.
    normal_consistency
        NC: mean of ``|n . n'|`` over nearest samples, average of both directions.
    hausdorff
        HD: largest distance to the nearest sample of the other surface, either way.
    edge_chamfer, edge_f1, edge_f1_wide
        ECD, EF1 and EF1 at 0.005: the same for samples of the creases. If neither surface has a crease they are 0, 1
        and 1; if only one has, EF1 is 0 and ECD is not defined (None).
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
    """Return the paper's measures between two surfaces.

    Parameters
    ----------
    a, b
        The surfaces, in units in which the bounding-box diagonal of the reference is 1.
    samples
        Number of points on each surface, uniform by area, and on the creases of each, uniform by length.
    crease_angle
        Creases are edges whose faces differ by more than this many degrees.
    seed
        Seed or generator of the samples; the same seed gives the same result.

    Raises
    ------
    OptionError
        If there is no sample.

    Notes
    -----
    Two independent samples of the same surface of area A, N points each, have CD = 2 A / (pi N), F1 = 1 - exp(-pi r^2
    N / A) and HD of about sqrt(A log N / (pi N)): no result can be better. ``sampled_measures(a, a)`` gives this floor.

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
    edge_chamfer, edge_f1, edge_f1_wide = _of_creases(a, b, samples, crease_angle, rng)
    return SampledMeasures(
        chamfer=_chamfer(ab, ba),
        f1=_f1(ab, ba, F1_DISTANCE),
        normal_consistency=float(0.5 * (agreement_a + agreement_b)),
        hausdorff=float(max(ab.max(), ba.max())),
        edge_chamfer=edge_chamfer,
        edge_f1=edge_f1,
        edge_f1_wide=edge_f1_wide,
    )


def _of_creases(
    a: Surface, b: Surface, samples: int, angle: float, rng: np.random.Generator
) -> tuple[float | None, float, float]:
    points_a, points_b = (points_on_edges(surface, sharp_edges(surface, angle), samples, rng) for surface in (a, b))
    if len(points_a) == 0 and len(points_b) == 0:
        return 0.0, 1.0, 1.0
    if len(points_a) == 0 or len(points_b) == 0:
        return None, 0.0, 0.0
    ab = cKDTree(points_b).query(points_a, workers=-1)[0]
    ba = cKDTree(points_a).query(points_b, workers=-1)[0]
    return _chamfer(ab, ba), _f1(ab, ba, F1_DISTANCE), _f1(ab, ba, WIDE_F1_DISTANCE)


def _chamfer(ab: Floats, ba: Floats) -> float:
    return float((ab**2).mean() + (ba**2).mean())


def _f1(ab: Floats, ba: Floats, distance: float) -> float:
    recall, precision = float((ab < distance).mean()), float((ba < distance).mean())
    return 2.0 * precision * recall / (precision + recall) if precision + recall > 0.0 else 0.0
