"""Distances between two surfaces, from sampled points of each to the closest point of the other.

The search for a vertex count and the pictures use them as well as the evaluation.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from anisomesh._arrays import Floats, Indices, Points
from anisomesh.errors import OptionError
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.sampling import points_on_faces
from anisomesh.mesh.surface import Surface

_N_CLIMBS, _N_MOVES = 256, 12  # samples that are followed to a maximum, and moves tried in each step
_CLIMB_STEPS = 0.2 * 0.5 ** np.arange(8)  # in barycentric coordinates
_MIDPOINTS = 0.5 * (1.0 - np.eye(3))  # of the sides opposite the corners


@dataclass(frozen=True, kw_only=True)
class SurfaceDistance:
    """Distances between surfaces a and b in model units; ``ab`` is from points of a to the surface b.

    Attributes
    ----------
    max_ab, max_ba
        Largest sampled distance, a lower bound of the one-sided Hausdorff distance.
    mean_square_ab, mean_square_ba
        Squared distance averaged over the area, in model units squared.
    """

    max_ab: float
    max_ba: float
    mean_square_ab: float
    mean_square_ba: float

    @property
    def rms_ab(self) -> float:
        """Root mean squared distance from a to b."""
        return float(np.sqrt(self.mean_square_ab))

    @property
    def rms_ba(self) -> float:
        """Root mean squared distance from b to a."""
        return float(np.sqrt(self.mean_square_ba))

    @property
    def hausdorff(self) -> float:
        """Symmetric Hausdorff distance, the larger of the two maxima."""
        return max(self.max_ab, self.max_ba)

    @property
    def rms(self) -> float:
        """Root of the mean of the two mean squared distances."""
        return float(np.sqrt(0.5 * (self.mean_square_ab + self.mean_square_ba)))

    def as_dict(self) -> dict[str, Any]:
        """Return a dictionary of all fields and derived values, for JSON."""
        derived = {name: getattr(self, name) for name in ("rms_ab", "rms_ba", "rms", "hausdorff")}
        return {**asdict(self), **derived}


def surface_distance(
    a: Surface, b: Surface, samples: int = 100_000, seed: int | np.random.Generator = 0
) -> SurfaceDistance:
    """Measure the distances between two surfaces in both directions.

    Parameters
    ----------
    a, b
        The surfaces, in the same units.
    samples
        Number of points sampled uniformly by area on each surface.
    seed
        Seed or generator of the samples; equal seeds give equal results.

    Raises
    ------
    OptionError
        If ``samples`` is less than 1.

    Notes
    -----
    Distances are point-to-surface, so the distance of a surface to itself is zero, unlike in sample-to-sample
    measures. The mean squares are over the samples; the maxima also include all vertices and edge midpoints, where
    chords usually deviate most. Takes about 1 s at 100,000 samples for surfaces of 10,000 faces.
    """
    if samples < 1:
        raise OptionError(f"samples is {samples}; expected at least 1")
    rng = np.random.default_rng(seed)
    max_ab, mean_ab = _one_sided(a, b, samples, rng)
    max_ba, mean_ba = _one_sided(b, a, samples, rng)
    return SurfaceDistance(max_ab=max_ab, max_ba=max_ba, mean_square_ab=mean_ab, mean_square_ba=mean_ba)


def hausdorff_distance(a: Surface, b: Surface, samples: int = 50_000, seed: int = 0) -> float:
    """Return the symmetric Hausdorff distance between two surfaces, from below but nearly exact, in their units.

    The largest of the distances at vertices, edge midpoints and ``samples`` points of each surface are followed to the
    maxima near them by a random search within their faces. The parameters are the ones of :func:`surface_distance`.
    """
    rng = np.random.default_rng(seed)
    return max(_farthest(a, b, samples, rng), _farthest(b, a, samples, rng))


def _farthest(a: Surface, b: Surface, samples: int, rng: np.random.Generator) -> float:
    """Return the largest distance from a to b."""
    closest = ClosestPoints(b)
    corner = np.unique(a.faces, return_index=True)[1]
    side = np.unique(a.face_edges, return_index=True)[1]
    face = np.concatenate([corner // 3, side // 3, np.sort(rng.integers(0, a.n_faces, samples))])
    random = rng.dirichlet(np.ones(3), samples)
    weights = np.concatenate([np.eye(3)[corner % 3], _MIDPOINTS[side % 3], random])

    def squares(face: Indices, weights: Floats) -> Floats:
        return closest.squared_distances(np.einsum("nc,ncx->nx", weights, a.points[a.faces[face]]))

    found = squares(face, weights)
    largest = np.argsort(found)[-_N_CLIMBS:]
    face, weights, found = face[largest], weights[largest], found[largest]
    rows = np.arange(len(face))
    for step in _CLIMB_STEPS:
        moved = np.maximum(weights[:, None] + step * rng.normal(size=(len(face), _N_MOVES, 3)), 0.0)
        outside = moved.sum(axis=2) <= 0.0
        moved[outside] = np.broadcast_to(weights[:, None], moved.shape)[outside]
        moved /= moved.sum(axis=2, keepdims=True)
        tried = squares(np.repeat(face, _N_MOVES), moved.reshape(-1, 3)).reshape(-1, _N_MOVES)
        best = tried.argmax(axis=1)
        better = tried[rows, best] > found
        weights[better], found[better] = moved[rows, best][better], tried[rows, best][better]
    return float(np.sqrt(found.max()))


def squared_distances(points: Points, surface: Surface) -> Floats:
    """Return the squared distance (n,) of each point (n, 3) to a surface, in model units squared."""
    return ClosestPoints(surface).squared_distances(points)


def _one_sided(a: Surface, b: Surface, samples: int, rng: np.random.Generator) -> tuple[float, float]:
    """Return the maximum and the mean square of the distances from a to b."""
    vertices = a.points[np.unique(a.faces)]
    midpoints = a.points[a.edges].mean(axis=1)
    queries = np.concatenate([points_on_faces(a, samples, rng)[0], vertices, midpoints])
    squared = squared_distances(queries, b)
    return float(np.sqrt(squared.max())), float(squared[:samples].mean())
