"""Principal curvatures and directions at the points of a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Edges, Faces, PointMask, PointScalars, PointVectors
from anisomesh._kernels.rings import mean_ring_lengths
from anisomesh.errors import OptionError
from anisomesh.mesh.geometry import unit
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import connected_components, edges_of
from anisomesh.metric.tangent import tangent_frames, unit_normals

MAX_FLAT_CURVATURE = 1e-3  # curvature times bounding-box diagonal; heuristic, a thousandth of the lower limit
DEFAULT_RADIUS = 5  # rings of edges over which curvature is fitted, as libigl has it

_MIN_FIT_HEIGHT = 1e-6  # height over longest side of the faces that libigl may see; heuristic
_MIN_SAFE_NORMAL = 1e-5  # mean unit normal of a ring: libigl ends the process at 0; far above rounding, 1e-16
_MIN_RELIABLE_NORMAL = 0.1  # mean unit normal of a ring below which its fit is arbitrary; heuristic
_MIN_TANGENT_PART = 0.1  # length of a fitted unit direction in the tangent plane, sine of the angle; heuristic

PointPairs = npt.NDArray[np.float64]
"""Two values at each point (V, 2)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PrincipalCurvatures:
    """Principal curvatures and directions at the points.

    Attributes
    ----------
    values
        Signed curvatures (V, 2) in 1/length, smaller magnitude first; positive for a sphere with outward normals.
    directions
        Unit tangent vectors (V, 2, 3) in the same order; their signs are arbitrary.
    trusted
        False (V,) where the neighbourhood is too small or too degenerate for a fit.
    """

    values: npt.NDArray[np.float64]
    directions: npt.NDArray[np.float64]
    trusted: PointMask


def principal_curvatures(surface: Surface, *, radius: int = DEFAULT_RADIUS) -> PrincipalCurvatures:
    """Return the principal curvatures of quadrics fitted to neighbourhoods of the points.

    Parameters
    ----------
    surface
        Any triangle mesh; it need not be manifold, and points without faces are allowed.
    radius
        Size of the neighbourhood in rings of edges, at least 2.

    Raises
    ------
    OptionError
        If the radius is below 2.

    Notes
    -----
    libigl fits a quadric over the ``radius``-ring, in a frame along the sum of the normals there; the error falls
    with the square of the edge length. If the sum vanishes or is not a number, libigl reads out of bounds and can end
    the process, so it is given neither needle-like faces nor components in which the normals of some ring cancel (a
    cube of 8 points, parts without consistent orientation). Where fewer than six points are in the ring, or the
    normals nearly cancel, the shape operator is integrated from the normal curvatures of the edges at the point
    (Taubin), and ``trusted`` is False. Points without faces have curvature 0. On flat parts the fit has no direction;
    the point is trusted if Taubin's estimate is flat as well. Directions are projected to the tangent plane of the
    point normal. About 0.1 s for 6,000 points.

    References
    ----------
    NASM, section 3.1. Panozzo, Puppo, Rocca, "Efficient multi-scale curvature and crease estimation", 2010.
    Taubin, "Estimating the tensor of curvature of a surface from a polyhedral approximation", ICCV 1995.
    """
    if radius < 2:
        raise OptionError(f"radius of the curvature fit is {radius}; expected at least 2 rings of edges")
    normals = unit_normals(surface)
    values, steepest = _quadric_curvatures(surface, radius, normals)
    fitted: PointMask = np.asarray(np.isfinite(values).all(axis=1) & surface.point_normals.any(axis=1))
    directed: PointMask = np.asarray(fitted & steepest.any(axis=1))
    trusted = directed
    if not directed.all():
        rough_values, rough_steepest = _taubin_curvatures(surface, normals)
        flat = np.abs(rough_values[:, 1]) * surface.diagonal < MAX_FLAT_CURVATURE
        trusted = np.asarray(directed | (fitted & flat))
        values = np.where(directed[:, None], values, rough_values)
        steepest = np.where(directed[:, None], steepest, rough_steepest)
    return PrincipalCurvatures(
        values=values, directions=np.stack([np.cross(normals, steepest), steepest], axis=1), trusted=trusted
    )


def mean_ring_normals(normals: PointVectors, edges: Edges, radius: int) -> PointScalars:
    """Return the length of the mean of unit normals (V, 3) over the ``radius``-ring of each point (V,)."""
    size = len(normals)
    start, end = np.concatenate([edges, edges[:, ::-1]]).T
    first = np.concatenate([[0], np.cumsum(np.bincount(start, minlength=size))])
    seen, ring = np.full(size, -1, dtype=np.int32), np.empty(size, dtype=np.int32)
    result = np.empty(size)
    neighbours = end[np.argsort(start, kind="stable")]
    mean_ring_lengths(np.array(normals, order="C"), first, neighbours, radius, seen, ring, result)
    return result


def _quadric_curvatures(surface: Surface, radius: int, normals: PointVectors) -> tuple[PointPairs, PointVectors]:
    """Return curvatures sorted by magnitude (NaN without a fit) and the direction of the larger (zero without one)."""
    values = np.full((surface.n_points, 2), np.nan)
    steepest = np.zeros((surface.n_points, 3))
    faces, unreliable = _faces_to_fit(surface, radius)
    if len(faces):
        used, local = np.unique(faces, return_inverse=True)
        along_1, along_2, k1, k2, starved = igl.principal_curvature(
            surface.points[used], local.reshape(-1, 3).astype(np.int64), radius, True
        )
        second = np.abs(k2) > np.abs(k1)
        values[used] = np.where(second[:, None], np.stack([k1, k2], axis=1), np.stack([k2, k1], axis=1))
        steepest[used] = np.where(second[:, None], along_2, along_1)
        values[used[np.asarray(starved, dtype=np.int64)]] = np.nan
        values[unreliable] = np.nan
    steepest = steepest - np.einsum("vx,vx->v", steepest, normals)[:, None] * normals
    directed = np.isfinite(values).all(axis=1) & (np.linalg.norm(steepest, axis=1) > _MIN_TANGENT_PART)
    return values, unit(np.where(directed[:, None], steepest, 0.0))


def _faces_to_fit(surface: Surface, radius: int) -> tuple[Faces, PointMask]:
    """Return the faces on which libigl is safe, and the points (V,) at which its fit is arbitrary."""
    unreliable = np.zeros(surface.n_points, dtype=np.bool_)
    longest = surface.edge_lengths[surface.face_edges].max(axis=1)
    faces = surface.faces[2.0 * surface.face_areas > _MIN_FIT_HEIGHT * longest**2]
    if len(faces) == 0:
        return faces, unreliable
    used, local = np.unique(faces, return_inverse=True)
    local = local.reshape(-1, 3).astype(np.int32)
    normals = igl.per_vertex_normals(surface.points[used], local.astype(np.int64))
    length = mean_ring_normals(normals, edges_of(local)[0], radius)
    unreliable[used] = ~(length > _MIN_RELIABLE_NORMAL)
    unsafe = ~(length > _MIN_SAFE_NORMAL)
    if unsafe.any():
        _, component = connected_components(local, len(used))
        faces = faces[~np.isin(component, component[unsafe[local].any(axis=1)])]
    return faces, unreliable


def _taubin_curvatures(surface: Surface, normals: PointVectors) -> tuple[PointPairs, PointVectors]:
    """Return curvatures sorted by magnitude and the direction of the larger, of Taubin's one-ring estimate."""
    frames = tangent_frames(normals)
    centre = surface.faces[:, [0, 0, 1, 1, 2, 2]].ravel()
    other = surface.faces[:, [1, 2, 2, 0, 0, 1]].ravel()
    weight = np.repeat(surface.face_areas, 6)
    chord = surface.points[other] - surface.points[centre]
    squared = np.einsum("ex,ex->e", chord, chord)
    height = np.einsum("ex,ex->e", chord, normals[centre])
    bend = np.divide(-2.0 * height, squared, out=np.zeros_like(squared), where=squared > 0)
    direction = unit(np.einsum("ekx,ex->ek", frames[centre], chord))
    total = np.bincount(centre, weight, minlength=surface.n_points)
    mean = np.zeros((surface.n_points, 2, 2))
    for row, column in ((0, 0), (0, 1), (1, 0), (1, 1)):
        term = weight * bend * direction[:, row] * direction[:, column]
        mean[:, row, column] = np.bincount(centre, term, minlength=surface.n_points)
    mean = np.divide(mean, total[:, None, None], out=np.zeros_like(mean), where=total[:, None, None] > 0)
    eigenvalues, vectors = np.linalg.eigh(mean)
    values = 3.0 * eigenvalues - eigenvalues[:, ::-1]
    order = np.argsort(np.abs(values), axis=1, kind="stable")
    larger = np.take_along_axis(vectors, order[:, None, 1:], axis=2)[:, :, 0]
    return np.take_along_axis(values, order, axis=1), np.einsum("vk,vkx->vx", larger, frames)
