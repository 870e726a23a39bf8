"""Samples of a surface to which a mesh is fitted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, Points, PointTensors
from anisomesh.mesh.surface import Surface
from anisomesh.metric.tensors import area_factors_of_tensors
from anisomesh.metric.transfer import PlacedMetric

_METRIC_INSET = 1e-3  # of the way from a crease to the barycentre of a face, where the metric is the one of that face
_CREASE_DENSITY = 3.0  # samples along creases on the length between samples of faces; heuristic
_MAX_SIDE_SHARE = 0.25  # of the samples, on each side of creases; heuristic
_CREASE_WIDTH = 1.4  # lengths between samples of faces: width of the strip that a crease stands for; heuristic

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class SurfaceSamples:
    """Points of a surface with the metric there and the area that they stand for.

    Attributes
    ----------
    points, normals
        Points and unit normals (S, 3).
    weights
        Areas (S,), in squared units of the surface; the ones on creases come on top of the area of the surface.
    roots
        Symmetric square roots of the metric (S, 3, 3).
    """

    points: Points
    normals: Floats
    weights: Floats
    roots: PointTensors

    def relative(self) -> SurfaceSamples:
        """Return the samples with weights times the square of the area factor of the metric, their sum the same.

        The factor is the area in the metric over the area.
        """
        factors = area_factors_of_tensors(self.roots @ self.roots, self.normals)
        weights = self.weights * (factors / factors.mean()) ** 2
        return replace(self, weights=weights * (self.weights.sum() / weights.sum()))

    @property
    def count(self) -> int:
        """Number of samples S."""
        return len(self.points)


def sample_surface(
    surface: Surface, count: int, *, creases: EdgeMask, metric: PlacedMetric, rng: np.random.Generator
) -> SurfaceSamples:
    """Return samples of faces, stratified by area, and of both sides of creases, stratified by length.

    Parameters
    ----------
    surface
        A surface with an area.
    count
        Number of samples on faces; at most half as many are added on creases.
    creases
        Which edges (E,) are creases.
    metric
        The metric, on a surface near this one.
    rng
        Generator of the random places.

    Notes
    -----
    A crease is sampled on both sides, with the normals of both, because samples of the faces alone hardly see how far a
    chord cuts it off.
    """
    face = _stratified(surface.face_areas, count, rng)
    root, second = np.sqrt(rng.random(count)), rng.random(count)
    weights = np.stack([1.0 - root, root * (1.0 - second), root * second], axis=1)
    area = np.full(count, surface.area / count)
    edges = np.flatnonzero(creases & (surface.edge_lengths > 0.0))
    if len(edges):
        length, spacing = float(surface.edge_lengths[edges].sum()), float(np.sqrt(surface.area / count))
        n = int(min(_MAX_SIDE_SHARE * count, _CREASE_DENSITY * length / spacing)) + 1
        edge = np.tile(edges[_stratified(surface.edge_lengths[edges], n, rng)], 2)
        side = surface.edge_faces[edge, np.repeat([0, 1], n)]
        of_start, of_end = (surface.faces[side] == end[:, None] for end in surface.edges[edge].T)
        fraction = np.tile(rng.random((n, 1)), (2, 1))
        weights = np.concatenate([weights, (1.0 - fraction) * of_start + fraction * of_end])
        face = np.concatenate([face, side])
        area = np.concatenate([area, np.full(2 * n, _CREASE_WIDTH * spacing * length / (2 * n))])
    return SurfaceSamples(
        points=np.einsum("nc,ncx->nx", weights, surface.points[surface.faces[face]]),
        normals=surface.face_normals[face],
        weights=area,
        roots=metric.roots_on(surface, face, weights + _METRIC_INSET * (1.0 / 3.0 - weights)),
    )


def _stratified(sizes: Floats, count: int, rng: np.random.Generator) -> Ints:
    """Return elements (count,), in order, each about as often as its size (n,) says."""
    sums = np.cumsum(sizes)
    places = (np.arange(count) + rng.random(count)) * (sums[-1] / count)
    return np.asarray(np.minimum(np.searchsorted(sums, places, side="right"), len(sizes) - 1), dtype=np.int64)
