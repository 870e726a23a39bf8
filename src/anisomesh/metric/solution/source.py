"""The metric that adapts a mesh to a function given at its vertices, such as the solution of a simulation."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import PointScalars, PointTensors, real_array
from anisomesh._values import real_number
from anisomesh.errors import MetricError, OptionError
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.geometry import sums_at_points
from anisomesh.mesh.surface import Surface
from anisomesh.metric.field import MetricField
from anisomesh.metric.line_field import line_field_of_directions, one_ring_averages, projectors_of_line_field
from anisomesh.metric.patches import smooth_patches
from anisomesh.metric.solution.hessian import recovered_hessians
from anisomesh.metric.tangent import tangent_frames, unit_normals
from anisomesh.metric.transfer import field_near

_RINGS = 2  # of the neighbourhoods of the fit; creases shorter than that do not separate them
_SUM_ROUNDING = 1e-12  # second differences over the largest value, below which they are rounding: 1e-16 times sums
_SMALLEST = 1e-12  # eigenvalue of a Hessian, over the largest one; its logarithm is averaged
_SMOOTHING = 1  # one-ring averages of the logarithm of the metric: recovered derivatives are noisy; heuristic
_FLOOR_ROUNDS = 100  # of the bound on the size, which converges linearly with the factor 1 / max_size^2
_FLOOR_CHANGE = 1e-6  # relative change of that bound


@dataclass(frozen=True, eq=False)
class SolutionMetric:
    """The metric of the least interpolation error of a function known at the vertices, for a number of vertices.

    Parameters
    ----------
    values
        The function at the vertices of the input (V,), in any unit: a field of a solution.
    surface
        The mesh whose vertices have the values, if it is not the input but near it, such as an earlier result.
    norm
        The p of the L^p norm of the error, at least 1. 2 weighs errors as usual; larger values, up to infinity, put
        more of the vertices where the error is largest.
    max_stretch
        Bound on length over width of the triangles, at least 1.
    min_size, max_size
        Bounds on the width and the length of the triangles, over the edges of an even mesh with as many vertices; below
        and above 1.
    crease_angle
        Edges whose dihedral angle deviates from flat by more degrees than this are creases, 180 for none. Second
        derivatives are not recovered across them.

    Raises
    ------
    MetricError
        If the values are not one finite number per vertex.
    OptionError
        If a parameter is out of range.

    Notes
    -----
    With the recovered Hessian H in the tangent plane, M = (det |H|)^(-1 / (2 p + 2)) |H|. Only ratios matter: lengths
    in this metric have no unit, so it goes with a number of vertices and not with an edge length. The bounds are there
    because H is singular where the function is straight in a direction: |H| has eigenvalues of at least the larger one
    over ``max_stretch`` squared, and M of at least the one that makes edges as long as ``max_size`` says.

    References
    ----------
    Loseille, Alauzet, "Continuous mesh framework part I: well-posed continuous interpolation error", 2011 (equation of
    the optimal metric). Chen, Sun, Xu, "Optimal anisotropic meshes for minimizing interpolation errors in L^p-norm",
    2007.
    """

    values: npt.ArrayLike
    _: KW_ONLY
    surface: Surface | None = None
    norm: float = 2.0
    max_stretch: float = 20.0
    min_size: float = 0.02
    max_size: float = 5.0
    crease_angle: float = 40.0

    def __post_init__(self) -> None:
        if not real_number("norm", self.norm) >= 1.0:
            raise OptionError(f"norm = {self.norm}; expected the p of an L^p norm, at least 1, or infinity")
        if not 1.0 <= real_number("max_stretch", self.max_stretch) < np.inf:
            raise OptionError(f"max_stretch = {self.max_stretch}; expected a finite number of at least 1")
        if not 0.0 < real_number("min_size", self.min_size) < 1.0:
            raise OptionError(f"min_size = {self.min_size}; expected a number above 0 and below 1")
        if not 1.0 < real_number("max_size", self.max_size) < np.inf:
            raise OptionError(f"max_size = {self.max_size}; expected a finite number above 1")
        if not 0.0 <= real_number("crease_angle", self.crease_angle) <= 180.0:
            raise OptionError(f"crease_angle = {self.crease_angle}; expected 0 to 180 degrees")
        n_points = None if self.surface is None else self.surface.n_points
        object.__setattr__(self, "values", checked_values(self.values, n_points))

    def __call__(self, surface: Surface) -> MetricField:
        """Return the metric on a surface: the one whose points have the values, or one near it."""
        if self.surface is not None and surface is not self.surface:
            return field_near(ClosestPoints(self.surface), self(self.surface), surface, self.crease_angle)
        values = checked_values(self.values, surface.n_points)
        patches = smooth_patches(surface, self.crease_angle, _RINGS)
        hessians = recovered_hessians(patches.surface, values[patches.source])
        largest = float(np.abs(np.linalg.eigvalsh(hessians)).max(initial=0.0))
        if largest * surface.diagonal**2 <= _SUM_ROUNDING * float(np.abs(values).max(initial=0.0)) * _cells(
            surface
        ):
            remark = "the values have no second derivatives beyond rounding, so the mesh is not adapted to them"
            return MetricField(tensors=np.tile(np.eye(3), (surface.n_points, 1, 1)), remarks=(remark,))
        return patches.field(
            optimal_metric(
                patches.surface,
                hessians,
                norm=self.norm,
                max_stretch=self.max_stretch,
                min_size=self.min_size,
                max_size=self.max_size,
            )
        )


def checked_values(values: npt.ArrayLike, n_points: int | None = None) -> PointScalars:
    """Return values (V,) of a solution as float64 after validation.

    Raises
    ------
    MetricError
        If they are not one finite number for each of the points; names the first that is not finite.
    """
    array = real_array("values of the solution", values, (n_points,), MetricError)
    wrong = np.flatnonzero(~np.isfinite(array))
    if len(wrong):
        raise MetricError(
            f"values of the solution[{wrong[0]}] = {array[wrong[0]]} ({len(wrong):,} of {len(array):,} like this); "
            "expected a finite number at each vertex"
        )
    return array


def optimal_metric(
    surface: Surface,
    hessians: PointTensors,
    *,
    norm: float = 2.0,
    max_stretch: float = 20.0,
    min_size: float = 0.02,
    max_size: float = 5.0,
) -> PointTensors:
    """Return the L^p-optimal metric (V, 3, 3) of Hessians (V, 3, 3) in the tangent planes of the points of a surface.

    Parameters
    ----------
    surface, hessians
        The surface, and symmetric matrices of which at least one is not 0.
    norm, max_stretch, min_size, max_size
        As in :class:`SolutionMetric`.

    Notes
    -----
    The eigenvalue along the normal is the smaller tangent one. It scales as the Hessians to the power p / (p + 1).
    """
    normals = unit_normals(surface)
    frames = tangent_frames(normals)
    values, axes = np.linalg.eigh(np.einsum("vix,vxy,vjy->vij", frames, hessians, frames))
    magnitude = np.abs(values) / np.abs(values).max()
    steepest = np.take_along_axis(axes, magnitude.argmax(axis=1)[:, None, None], axis=2)[:, :, 0]
    direction = np.einsum("vi,vix->vx", steepest, frames)
    high = magnitude.max(axis=1)
    low = np.maximum(magnitude.min(axis=1), high / max_stretch**2)
    high, low = np.maximum(high, _SMALLEST), np.maximum(low, _SMALLEST)  # the bounds on sizes replace them
    mean, stretch = 0.5 * np.log(low * high), np.log(high / low)
    mean *= 1.0 - 1.0 / (norm + 1.0)
    field = line_field_of_directions(direction, stretch, frames)
    scalar_average, line_average = one_ring_averages(surface, normals, frames)
    for _ in range(_SMOOTHING):
        mean, field = scalar_average @ mean, line_average @ field
    low, high = np.exp(mean - 0.5 * np.abs(field)), np.exp(mean + 0.5 * np.abs(field))
    floor = _floor(surface, low, high, max_size)
    ceiling = floor * (max_size / min_size) ** 2
    low, high = np.clip(low, floor, ceiling), np.clip(high, floor, ceiling)
    along = projectors_of_line_field(field, frames)
    return np.asarray(low[:, None, None] * np.eye(3) + (high - low)[:, None, None] * along)


def _floor(surface: Surface, low: PointScalars, high: PointScalars, max_size: float) -> float:
    """Return the eigenvalue at which edges are as long as allowed, for a metric with these eigenvalues (V,).

    The edges of an even mesh have an eigenvalue c with as many vertices, c A = integral of the density sqrt(low high).
    """
    area = sums_at_points(surface.face_areas / 3.0, surface.faces, surface.n_points)
    floor = 0.0
    for _ in range(_FLOOR_ROUNDS):
        density = np.sqrt(np.maximum(low, floor) * np.maximum(high, floor))
        before, floor = floor, float(area @ density / area.sum()) / max_size**2
        if abs(floor - before) <= _FLOOR_CHANGE * floor:
            break
    return floor


def _cells(surface: Surface) -> float:
    """Return the squared diagonal over the squared mean edge length, by which second differences grow."""
    return float((surface.diagonal / surface.edge_lengths.mean()) ** 2)
