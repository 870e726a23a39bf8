"""The Poisson problem of the global step: one sparse factorisation, many right-hand sides."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse import linalg

from anisomesh.embedding.gradient import FaceGradient
from anisomesh.embedding.ordering import nested_dissection
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import connected_components

Columns = npt.NDArray[np.float64]
"""Right-hand sides or solutions as columns (n, k)."""
Solve = Callable[[Columns], Columns]


def factorise(matrix: sparse.csc_matrix, order: npt.NDArray[np.int64]) -> Solve:
    """Return a function that solves ``matrix @ x = b`` for columns b (V, k).

    Parameters
    ----------
    matrix
        Symmetric positive definite (V, V), so pivoting is not needed.
    order
        Elimination order (V,), see :func:`~anisomesh.embedding.ordering.nested_dissection`.
    """
    factor = linalg.splu(
        matrix[order][:, order].tocsc(), permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )

    def solve(right: Columns) -> Columns:
        solution = np.empty_like(right)
        solution[order] = factor.solve(right[order])
        return solution

    return solve


def poisson_solver(surface: Surface, gradient: FaceGradient) -> Solve:
    """Return a function that integrates gradients (F, 2, k): the functions (V, k) with the closest gradients.

    The functions minimise the area integral of the squared difference between their gradient and the target, and have
    area-weighted mean zero on each connected component. Points without a regular face have value 0.

    Notes
    -----
    The normal equations G^t A G y = G^t A g are singular, with one constant per component. A positive number added to
    one diagonal entry per component makes them definite without a change of the solution: the right-hand side has sum
    zero over a component, so this entry of the solution is zero.

    References
    ----------
    Yu et al., "Mesh editing with Poisson-based gradient field manipulation", 2004.
    """
    operator, weight = gradient.operator, np.repeat(gradient.areas, 2)
    adjoint = (sparse.diags(weight) @ operator).T.tocsr()
    matrix = (adjoint @ operator).tocsc()
    label, count = _components(surface, gradient)
    mass = _point_areas(surface, gradient)
    pinned = np.unique(label, return_index=True)[1]
    diagonal = matrix.diagonal()
    extra = np.zeros(surface.n_points)
    extra[pinned] = np.where(diagonal[pinned] > 0.0, diagonal[pinned], 1.0)
    order = nested_dissection(surface.points, surface.edges)
    solve = factorise((matrix + sparse.diags(extra)).tocsc(), order)
    total = np.bincount(label, mass, minlength=count)
    fraction = np.divide(mass, total[label], out=np.zeros_like(mass), where=mass > 0.0)
    average = sparse.csr_matrix((fraction, (label, np.arange(surface.n_points))), shape=(count, surface.n_points))

    def integrate(target: Columns) -> Columns:
        solution = solve(adjoint @ target.reshape(2 * surface.n_faces, -1))
        return np.asarray(solution - (average @ solution)[label])

    return integrate


def _components(surface: Surface, gradient: FaceGradient) -> tuple[npt.NDArray[np.int64], int]:
    """Return the component (V,) of each point, connected by regular faces, and the number of components."""
    faces = surface.faces[gradient.regular]
    count, face_label = connected_components(faces, surface.n_points) if len(faces) else (0, np.empty(0, np.int32))
    label = np.full(surface.n_points, -1, dtype=np.int64)
    label[faces] = face_label[:, None]
    isolated = np.flatnonzero(label < 0)
    label[isolated] = count + np.arange(len(isolated))
    return label, count + len(isolated)


def _point_areas(surface: Surface, gradient: FaceGradient) -> npt.NDArray[np.float64]:
    """Return a third of the area of the regular faces at each point (V,)."""
    areas = np.repeat(gradient.areas / 3.0, 3)
    return np.asarray(np.bincount(surface.faces.ravel(), areas, minlength=surface.n_points), dtype=np.float64)
