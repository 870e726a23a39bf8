"""The direct embedding: extra coordinates that carry the metric, found by local and global steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh._arrays import CornerTensors, EmbeddedPoints, PointScalars, PointTensors
from anisomesh._kernels.local_step import local_step
from anisomesh.embedding.base import Embedding, EmbeddingStatus, stretch_statistics
from anisomesh.embedding.gradient import FaceGradient, FaceTensors, eigen_2x2, face_gradient, face_tensors
from anisomesh.embedding.poisson import poisson_solver
from anisomesh.errors import OptionError
from anisomesh.mesh.geometry import sums_at_points
from anisomesh.mesh.surface import Surface

_POSITION_WEIGHT = 0.01  # of the coordinates in the start, relative to unit normals; matters on flat parts only
_INVARIANT_WEIGHT = 0.2  # of the invariant columns of the start; chosen on training meshes
_MAX_INCREASE = 1.01  # ratio of residuals of two steps, above which it has grown by rounding; heuristic
_MAX_EXTENT = 1e4  # diagonals times the largest root of the metric that coordinates may reach; far above any geodesic
_MIN_ROOT_EIGENVALUE = 1e-12  # of T_f - c^2 I, over the largest of T_f: smaller ones are rounding errors, set to 0


@dataclass(frozen=True)
class Start:
    """What the extra coordinates of an embedding start with.

    Parameters
    ----------
    dimensions
        Number of extra coordinates, at least 3.
    unfolded
        Whether they start with the surface itself in place of normals and sizes.

    Notes
    -----
    Where sizes vary a lot, the usual start folds the surface: the sizes are the same on both sides of a layer of small
    triangles, so the volume factor has its ridge there, and the two sides come to lie on each other, though each of
    them has the right lengths. Cells would then reach from one side to the other. Started from the surface itself it
    stays unfolded, with a larger residual where sizes vary in two directions.
    """

    dimensions: int = 5
    unfolded: bool = False

    def coordinates(self, surface: Surface, tensors: PointTensors, gradient: FaceGradient) -> EmbeddedPoints:
        """Return the start (V, dimensions) of the extra coordinates."""
        if self.unfolded:
            return np.pad(surface.points, ((0, 0), (0, self.dimensions - 3)))
        return initial_coordinates(surface, tensors, gradient, self.dimensions)


DEFAULT_START = Start()


def embed(
    surface: Surface,
    tensors: PointTensors,
    *,
    corner_tensors: CornerTensors | None = None,
    start: Start = DEFAULT_START,
    max_iterations: int = 10,
    tolerance: float = 1e-3,
) -> Embedding:
    """Embed a surface so that straight lengths in the embedding are lengths in the metric.

    Parameters
    ----------
    surface
        The surface at bounding-box diagonal 1; boundaries, several components and degenerate faces are allowed.
    tensors
        Symmetric positive definite metric (V, 3, 3).
    corner_tensors
        The metric at the corners of the faces (F, 3, 3, 3) if it jumps between faces.
    start
        Number of extra coordinates, and what they start with.
    max_iterations
        Largest number of local/global steps.
    tolerance
        Relative decrease of the residual by a step below which the iteration stops.

    Returns
    -------
    embedding
        Points (V, 3 + start.dimensions) and their agreement with the metric.

    Raises
    ------
    OptionError
        If ``start.dimensions`` is below 3, ``max_iterations`` below 1, or ``tolerance`` negative.

    Notes
    -----
    The embedding is [c xyz, Y]. In the plane of a face the metric T_f is the mean of the tensors at the corners. c^2 is
    the smallest eigenvalue of all faces (1 for the curvature metric; the supplement has 0.9 of it, which gives Y more
    to carry without benefit), and Y carries T_f - c^2 I = S_f^2. From a start with the normals, a local step rotates
    the target gradient S_f to the current one, R_f = polar factor of (grad Y S_f), and a global step finds the Y with
    gradient closest to R_f S_f. Neither increases the residual. The start makes the result rotate with the surface.
    Three steps reach most of the agreement; regular triangles (the plain CVT) gain up to the default of ten.

    References
    ----------
    NASM, supplement A. Zhong, Wang, Levy, Hua, Guo, "Computing a high-dimensional Euclidean embedding from an
    arbitrary smooth Riemannian metric", 2018. Sorkine, Alexa, "As-rigid-as-possible surface modeling", 2007.
    """
    if start.dimensions < 3:
        raise OptionError(f"the embedding has {start.dimensions} extra dimensions; expected at least 3 for its start")
    if max_iterations < 1 or tolerance < 0.0:
        raise OptionError(
            f"max_iterations is {max_iterations} and tolerance {tolerance}; expected at least 1 step and 0 or more"
        )
    gradient = face_gradient(surface)
    metric = face_tensors(surface, tensors if corner_tensors is None else corner_tensors, gradient.frames)
    scale, root = _split(metric, gradient)
    if not root.any():
        extra, residual, iterations = np.zeros((surface.n_points, start.dimensions)), 0.0, 0
        status = EmbeddingStatus.EXACT
    else:
        first = start.coordinates(surface, tensors, gradient)
        extra, residual, iterations = _local_global(surface, gradient, root, first, max_iterations, tolerance)
        limited = iterations == max_iterations
        status = EmbeddingStatus.ITERATION_LIMIT if limited else EmbeddingStatus.CONVERGED
    points = np.concatenate([scale * surface.points, extra], axis=1)
    return Embedding(
        points=points,
        scale=scale,
        residual=residual,
        iterations=iterations,
        status=status,
        stretch=stretch_statistics(gradient, metric, points),
    )


def initial_coordinates(
    surface: Surface, tensors: PointTensors, gradient: FaceGradient, dimensions: int
) -> EmbeddedPoints:
    """Return the start (V, dimensions) of the extra coordinates.

    Notes
    -----
    Columns 0 to 2 rotate with the surface: the point normals, plus a small multiple of the coordinates, which decides
    on flat parts, where normals are constant. Columns 3 and 4 are invariant: the arcsinh of the mean curvature times
    the root of the area, and the logarithm of the volume factor of the metric. Zero columns would stay zero. On
    training meshes these two lower the stretch error after five steps by roughly 10 % (curvature metric) and 25 %
    (approximation).
    """
    size = np.sqrt(surface.area) or 1.0
    start = np.zeros((surface.n_points, dimensions))
    start[:, :3] = surface.point_normals + _POSITION_WEIGHT / size * surface.points
    invariants = [np.arcsinh(size * normal_divergence(surface, gradient)), 0.5 * np.linalg.slogdet(tensors)[1]]
    for column, values in zip(range(3, dimensions), invariants, strict=False):
        start[:, column] = _INVARIANT_WEIGHT * values
    return start


def normal_divergence(surface: Surface, gradient: FaceGradient) -> PointScalars:
    """Return the divergence of the normals (V,), twice the mean curvature, as area-weighted mean at the points."""
    components = (gradient.operator @ surface.point_normals).reshape(surface.n_faces, 2, 3)
    divergence = gradient.areas * np.einsum("fkx,fkx->f", components, gradient.frames)
    total = sums_at_points(divergence, surface.faces, surface.n_points)
    areas = sums_at_points(gradient.areas, surface.faces, surface.n_points)
    return np.divide(total, areas, out=np.zeros_like(total), where=areas > 0.0)


def _split(metric: FaceTensors, gradient: FaceGradient) -> tuple[float, FaceTensors]:
    """Return the factor c of the coordinates and the roots S_f (F, 2, 2) of the metric left to extra coordinates."""
    eigenvalues, vectors = eigen_2x2(metric)
    if not gradient.regular.any():
        return 1.0, np.zeros_like(metric)
    floor = float(eigenvalues[gradient.regular, 1].min())
    rest = np.where(gradient.regular[:, None], eigenvalues - floor, 0.0)
    rest[rest < _MIN_ROOT_EIGENVALUE * eigenvalues[:, :1]] = 0.0
    root = (vectors * np.sqrt(rest)[:, None, :]) @ vectors.transpose(0, 2, 1)
    return float(np.sqrt(floor)), root


def _local_global(
    surface: Surface,
    gradient: FaceGradient,
    root: FaceTensors,
    start: EmbeddedPoints,
    max_iterations: int,
    tolerance: float,
) -> tuple[EmbeddedPoints, float, int]:
    """Return the extra coordinates (V, k), the relative residual and the number of global solves."""
    integrate = poisson_solver(surface, gradient)
    norm = float(np.einsum("f,fij,fij->", gradient.areas, root, root))
    target = np.empty((surface.n_faces, 2, start.shape[1]))
    largest = _MAX_EXTENT * surface.diagonal * float(np.abs(root).max())
    extra, residual, before = start, np.inf, start
    for iteration in range(max_iterations + 1):
        jacobian = (gradient.operator @ extra).reshape(target.shape)
        previous = residual
        residual = float(np.sqrt(local_step(jacobian, root, gradient.frames, gradient.areas, target) / norm))
        far = iteration > 0 and not np.abs(extra).max() <= largest
        if far or not residual <= _MAX_INCREASE * previous:  # on needles the global step may fail by rounding
            return before, previous, iteration
        if iteration == max_iterations or (iteration > 1 and residual > (1.0 - tolerance) * previous):
            break
        before, extra = extra, integrate(target)
    return extra, residual, iteration
