"""Second derivatives of a function that is given at the points of a mesh."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import sparse

from anisomesh._arrays import PointScalars, PointTensors
from anisomesh.mesh.surface import Surface
from anisomesh.metric.tangent import tangent_frames, unit_normals

_MIN_NEIGHBOURS = 9  # points besides the centre; six coefficients need five, and rings of strips are ill-conditioned
_MAX_RINGS = 6  # that a neighbourhood with few points grows to; heuristic
_CUTOFF = 1e-6  # of eigenvalues of normal equations over the largest, below which a coefficient is left at 0
_MIN_WIDTH = 1e-6  # of a neighbourhood over its length, below which it is a line
_BLOCK = 8_192  # points at once, to bound the memory of their rings

Arcs = tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]


def recovered_hessians(surface: Surface, values: PointScalars) -> PointTensors:
    """Return the Hessians of a function along a surface, recovered from its values at the points.

    Parameters
    ----------
    surface
        Any triangle mesh. Neighbourhoods do not reach across its boundary: cut it open along creases.
    values
        The function at the points (V,).

    Returns
    -------
    hessians
        Symmetric matrices (V, 3, 3) with x^t H x the second derivative along the geodesic in the tangent direction x,
        and H n = 0 for the normal n, in units of the values over squared length. 0 at points without faces.

    Notes
    -----
    A quadratic polynomial is fitted to the values at the points within two rings of edges, or more where these are few,
    in coordinates of the tangent plane at the centre. The plane touches the surface, so the second derivatives of the
    function in these coordinates are its covariant ones. Quadratic polynomials are recovered exactly on flat parts, up
    to the boundary; elsewhere the error falls in proportion to the edge length or faster. The coordinates are scaled
    to unit variance, so stretched triangles do no harm: the fit is the same in any affine frame. Coefficients that the
    points do not determine are 0.

    References
    ----------
    Vallet, Manole, Dompierre, Dufour, Guibault, "Numerical comparison of some Hessian recovery techniques", 2007
    (quadratic fits are the most accurate there).
    """
    frames = tangent_frames(unit_normals(surface))
    hessians: npt.NDArray[np.float64] = np.zeros((surface.n_points, 2, 2))
    step = _one_ring(surface)
    for first in range(0, surface.n_points, _BLOCK):
        centres = np.arange(first, min(first + _BLOCK, surface.n_points))
        arcs = _neighbourhoods(step, centres)
        offsets = surface.points[arcs[1]] - surface.points[centres][arcs[0]]
        places = np.einsum("akx,ax->ak", frames[centres][arcs[0]], offsets)
        heights = values[arcs[1]] - values[centres][arcs[0]]
        hessians[centres] = _fitted_hessians(arcs[0], places, heights, len(centres))
    return np.asarray(np.einsum("vij,vix,vjy->vxy", hessians, frames, frames))


def _one_ring(surface: Surface) -> sparse.csr_matrix:
    """Return which points are joined by an edge, or equal, as a matrix (V, V)."""
    rows, columns = np.concatenate([surface.edges, surface.edges[:, ::-1]]).T
    shape = (surface.n_points, surface.n_points)
    step = sparse.csr_matrix((np.ones(len(rows), dtype=np.bool_), (rows, columns)), shape=shape)
    return sparse.csr_matrix(step + sparse.identity(surface.n_points, dtype=np.bool_, format="csr"))


def _neighbourhoods(step: sparse.csr_matrix, centres: npt.NDArray[np.intp]) -> Arcs:
    """Return the arcs (A,) from centres, by their position, to the points in their neighbourhoods, sorted by centre."""
    ring = step[centres] @ step
    for _ in range(2, _MAX_RINGS):
        few = np.flatnonzero(np.diff(ring.indptr) <= _MIN_NEIGHBOURS)
        if len(few) == 0:
            break
        chosen = (np.ones(len(few), dtype=np.bool_), (few, few))
        ring = sparse.csr_matrix(ring + sparse.csr_matrix(chosen, shape=(len(centres),) * 2) @ ring @ step)
    return np.repeat(np.arange(len(centres)), np.diff(ring.indptr)), ring.indices.astype(np.intp)


def _fitted_hessians(
    centre: npt.NDArray[np.intp], places: npt.NDArray[np.float64], heights: npt.NDArray[np.float64], n_centres: int
) -> npt.NDArray[np.float64]:
    """Return the Hessians (n, 2, 2) of quadratics fitted to heights (A,) at places (A, 2) around each centre (A,)."""
    starts = np.searchsorted(centre, np.arange(n_centres))
    counts = np.diff(np.append(starts, len(centre)))

    def mean(terms: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        total = np.add.reduceat(terms, starts, axis=0)
        return np.asarray(total / counts.reshape(-1, *(1,) * (terms.ndim - 1)))

    variances, axes = np.linalg.eigh(mean(places[:, :, None] * places[:, None, :]))
    widths = np.sqrt(np.maximum(variances, 0.0))
    scales = np.divide(1.0, widths, out=np.zeros_like(widths), where=widths > _MIN_WIDTH * widths[:, 1:])
    to_unit = scales[:, :, None] * axes.transpose(0, 2, 1)
    x, y = np.einsum("aij,aj->ia", to_unit[centre], places)
    monomials = np.stack([np.ones_like(x), x, y, 0.5 * x**2, x * y, 0.5 * y**2], axis=1)
    normal = mean(monomials[:, :, None] * monomials[:, None, :])

    def fitted(terms: int, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        inverse = np.linalg.pinv(normal[:, :terms, :terms], rcond=_CUTOFF, hermitian=True)
        return np.asarray(np.einsum("vij,vj->vi", inverse, mean(monomials[:, :terms] * values[:, None])))

    rest = heights - np.einsum("ai,ai->a", monomials[:, :3], fitted(3, heights)[centre])  # what does not need to bend
    xx, xy, yy = fitted(6, rest)[:, 3:].T
    hessian = np.stack([xx, xy, xy, yy], axis=1).reshape(-1, 2, 2)
    return np.asarray(to_unit.transpose(0, 2, 1) @ hessian @ to_unit)
