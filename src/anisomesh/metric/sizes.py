"""Lengths of edges that a user prescribes, their limits, and the metric in which such edges have the length 1."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from anisomesh._arrays import Points, PointScalars, PointTensors
from anisomesh._values import LARGEST_SIZE
from anisomesh.errors import OptionError
from anisomesh.mesh.surface import Surface


def checked_sizes(sizes: PointScalars, points: Points, numbers: npt.NDArray[np.integer] | None = None) -> PointScalars:
    """Return sizes (V,) after validation.

    Parameters
    ----------
    sizes
        Lengths.
    points
        Where they are, in model units (V, 3).
    numbers
        Numbers of the points (V,) in messages, None if they have none that a user knows.

    Raises
    ------
    OptionError
        If some are not positive and finite; says how many, and which is the first and where.
    """
    invalid = np.flatnonzero(~((sizes > 1.0 / LARGEST_SIZE) & (sizes < LARGEST_SIZE)))
    if len(invalid):
        first = invalid[0]
        name = "size_field" if numbers is None else f"size_field[{numbers[first]}]"
        where = ", ".join(f"{x:.6g}" for x in points[first])
        raise OptionError(
            f"{name} is {sizes[first]:g} at ({where}), and {len(invalid):,} of {len(sizes):,} sizes are not positive "
            "and finite; expected lengths in model units"
        )
    return sizes


def limited_sizes(
    surface: Surface,
    sizes: PointScalars,
    *,
    low: float | None = None,
    high: float | None = None,
    gradation: float | None = None,
) -> PointScalars:
    """Return sizes (V,) within bounds that grow no faster than by a factor of the distance.

    Parameters
    ----------
    surface
        The surface.
    sizes
        Lengths at its points (V,), in its units.
    low, high
        Bounds of the result; None for none.
    gradation
        Largest difference of the sizes at the ends of an edge, over its length; None for no limit.

    Notes
    -----
    The largest sizes below the given ones with h(q) <= h(p) + g |p - q| along all edges are the distances from one
    source that is joined to every point p by an arc of length h(p), while edges count g times their length: one run of
    Dijkstra's algorithm.

    References
    ----------
    Persson, "Mesh size functions for implicit geometries and PDE-based gradient limiting", 2006.
    """
    sizes = np.clip(sizes, low, high) if low is not None or high is not None else np.array(sizes)
    if gradation is None:
        return sizes
    n = surface.n_points
    first, second = surface.edges.T.astype(np.int64)
    arcs = np.maximum(gradation * surface.edge_lengths, np.finfo(np.float64).tiny)
    heads = np.concatenate([np.full(n, n), first, second])
    tails = np.concatenate([np.arange(n), second, first])
    graph = sparse.csr_matrix((np.concatenate([sizes, arcs, arcs]), (heads, tails)), shape=(n + 1, n + 1))
    return np.asarray(dijkstra(graph, indices=n)[:n])


def metric_of_sizes(sizes: PointScalars) -> PointTensors:
    """Return the isotropic metric (V, 3, 3) in which edges of these lengths (V,) have the length 1."""
    return np.asarray(np.eye(3) / sizes[:, None, None] ** 2)
