"""How well the edges of a mesh have the lengths that a metric asks for, and how many vertices such edges take."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Floats
from anisomesh.mesh.surface import Surface
from anisomesh.metric.field import MetricField
from anisomesh.metric.tensors import area_factors_of_tensors
from anisomesh.metric.transfer import PlacedMetric

_EQUILATERAL_AREA = 0.25 * np.sqrt(3.0)  # of a triangle with sides 1
_QUADRATURE = np.polynomial.legendre.leggauss(3)  # along edges
_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
_MAX_GROUPS = 10  # of edges, by the size asked for
_MIN_GROUP = 10  # edges, for a mean length that says something, if there are as many
_MAX_OFF = 0.25  # by which the mean length in a group may be off
_MAX_COUNT = 2**62  # so that it fits an integer; no memory holds as many vertices


@dataclass(frozen=True, kw_only=True)
class MetricExtent:
    """Area and length of the boundary of a surface in a metric, and its Euler characteristic."""

    area: float
    boundary: float
    euler: int

    @classmethod
    def of(cls, surface: Surface, field: MetricField) -> MetricExtent:
        """Return the extent of a surface in a metric field on it."""
        corners = field.tensors[surface.faces] if field.corner_tensors is None else field.corner_tensors
        normals = np.repeat(surface.face_normals, 3, axis=0)
        factors = area_factors_of_tensors(corners.reshape(-1, 3, 3), normals).reshape(-1, 3).mean(axis=1)
        rim = surface.edges[surface.edge_face_count == 1]
        along = surface.points[rim[:, 1]] - surface.points[rim[:, 0]]
        squared = np.einsum("ex,ekxy,ey->ek", along, field.tensors[rim], along)
        return cls(
            area=float(surface.face_areas @ factors),
            boundary=float(np.sqrt(squared).mean(axis=1).sum()) if len(rim) else 0.0,
            euler=surface.n_points - len(surface.edges) + surface.n_faces,
        )

    def count(self, length: float) -> int:
        """Return the number of vertices of equilateral triangles with sides of a length in the metric.

        By Euler's formula it is half the number of triangles and of boundary edges, plus the Euler characteristic.
        """
        triangles = self.area / (_EQUILATERAL_AREA * length**2)
        return int(min(round(0.5 * (triangles + self.boundary / length)) + self.euler, _MAX_COUNT))

    def length(self, count: int) -> float:
        """Return the sides of that many vertices in equilateral triangles, the inverse of :meth:`count`."""
        a, b, c = 0.5 * self.area / _EQUILATERAL_AREA, 0.5 * self.boundary, float(max(count - self.euler, 1))
        return float((b + np.sqrt(b**2 + 4.0 * a * c)) / (2.0 * c))


@dataclass(frozen=True, kw_only=True)
class Conformity:
    """How well the edges of a mesh have the length that a metric asks for.

    Attributes
    ----------
    asked
        The length asked for, None if only a number of vertices was.
    of_count
        The length at which equilateral triangles have as many vertices as the mesh.
    mean, median
        Mean and median length of the edges. Lengths are in model units where the metric is computed on the surface, and
        pure numbers where it is prescribed by tensors or sizes.
    quantiles
        The 5, 25, 50, 75 and 95 % quantiles of the lengths, over the length asked for, or else ``of_count``.
    share
        Share of the edges between 1 / sqrt(2) and sqrt(2) of it.
    off_share
        Share of the surface or of the edges, whichever is larger, where the mean length is more than 25 % off.
    off_factor
        The mean length over the one asked for, where that is farthest off; 1 without such a place.
    """

    asked: float | None
    of_count: float
    mean: float
    median: float
    quantiles: tuple[float, ...]
    share: float
    off_share: float
    off_factor: float

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as a dictionary that JSON can hold."""
        return asdict(self) | {"quantiles": dict(zip(map(str, _QUANTILES), self.quantiles, strict=True))}


def conformity(
    mesh: Surface, metric: PlacedMetric, extent: MetricExtent, *, asked: float | None = None, unit: float = 1.0
) -> Conformity:
    """Return how well the edges of a mesh have the length that a metric asks for.

    Parameters
    ----------
    mesh
        A mesh with edges, near the surface of the metric.
    metric
        The metric.
    extent
        Area and boundary of the surface in the metric.
    asked
        The length asked for, None for the one that fits the number of vertices.
    unit
        Factor of lengths in the metric, in results and in ``asked``.
    """
    lengths = unit * lengths_in_metric(mesh, metric)
    of_count = unit * extent.length(mesh.n_points)
    relative = lengths / (of_count if asked is None else asked)
    sizes = np.divide(mesh.edge_lengths, lengths, out=np.zeros_like(lengths), where=lengths > 0.0)
    off = [_off(relative, sizes, weights) for weights in (sizes**2, np.ones_like(sizes))]
    off_share, off_factor = max(off)
    return Conformity(
        asked=asked,
        of_count=of_count,
        mean=float(lengths.mean()),
        median=float(np.median(lengths)),
        quantiles=tuple(float(value) for value in np.quantile(relative, _QUANTILES)),
        share=float(np.mean((relative > np.sqrt(0.5)) & (relative < np.sqrt(2.0)))),
        off_share=off_share,
        off_factor=off_factor,
    )


def lengths_in_metric(mesh: Surface, metric: PlacedMetric) -> Floats:
    """Return the lengths (E,) of the edges of a mesh in a metric, integrated along them."""
    start, end = mesh.points[mesh.edges[:, 0]], mesh.points[mesh.edges[:, 1]]
    total: npt.NDArray[np.float64] = np.zeros(len(start))
    for place, weight in zip(*_QUADRATURE, strict=True):
        roots = metric.roots(start + 0.5 * (1.0 + place) * (end - start))
        total += 0.5 * weight * np.linalg.norm(np.einsum("eij,ej->ei", roots, end - start), axis=1)
    return total


def _off(relative: Floats, sizes: Floats, weights: Floats) -> tuple[float, float]:
    """Return the weight of the edges in groups of one size with a mean length off by more than 25 %, and the worst.

    The groups have equal weights, and groups of few edges count as good.
    """
    order = np.argsort(sizes, kind="stable")
    sums = np.cumsum(weights[order])
    count = min(max(len(order) // _MIN_GROUP, 1), _MAX_GROUPS)
    group = np.minimum((count * sums / sums[-1]).astype(np.int64), count - 1)
    share, worst = 0.0, 1.0
    for k in range(count):
        members = order[group == k]
        if len(members) < min(_MIN_GROUP, len(order)):
            continue
        mean = float(relative[members].mean())
        if abs(mean - 1.0) > _MAX_OFF:
            share += float(weights[members].sum() / sums[-1])
            worst = max(worst, mean, key=lambda factor: abs(np.log(factor)))
    return share, worst
