"""Reduction of a dense surface to some of its points, near it and of the same topology."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh._arrays import EdgeLabels, PointLabels, PointMask
from anisomesh._kernels.decimate import Decimation, ShapeLimits, set_quadrics
from anisomesh._kernels.reduce import collapse_cheap_edges, costs_of_edges
from anisomesh.mesh.surface import Surface
from anisomesh.meshops.decimation import decimation_arrays
from anisomesh.working.marked_surface import MarkedSurface

_SAMPLED_FACES = 20_000  # whose edges say how large costs are
_SHARE = 0.5  # of the points that are to go, as a share of the edges that the first pass may collapse; heuristic
_GROWTH, _LAST_GROWTH = 2.0, 1.25  # of the largest cost from pass to pass, and with few points left to go; heuristic
_LAST_FACTOR = 2.0  # points left over points wanted, up to which these are few; heuristic
_MOST_PASSES = 100  # less than twenty are enough from a hundred times as many points
_FINE_LIMITS = ShapeLimits(cosine=0.7, thickness=0.05)  # for triangles that are small, and are to be even; heuristic
_MAX_IDLE_PASSES = 8  # without a collapse, one after the other: then the ones that are left are not allowed; heuristic


@dataclass(frozen=True, kw_only=True, eq=False)
class Reduced:
    """A surface with some of the points of another one.

    Attributes
    ----------
    surface
        The surface.
    labels
        Labels of its edges (E',).
    kept
        The point of the other surface that each of its points is (V',).
    """

    surface: Surface
    labels: EdgeLabels
    kept: PointLabels


def reduce_points(surface: Surface, n_points: int, *, held: PointMask, labels: EdgeLabels) -> Reduced:
    """Collapse edges until a number of points is left, or none can go.

    Parameters
    ----------
    surface
        An oriented manifold surface.
    n_points
        Number of points wanted.
    held
        Points (V,) that stay.
    labels
        Edges (E,) of another label than 0 form lines: points on these only go along them, and stay where a line ends,
        meets others, changes its label or reaches the boundary.

    Returns
    -------
    Reduced
        Every point is a point of the surface, so values at its points are known.

    Notes
    -----
    Edges are collapsed into one of their ends, by the costs of :func:`~anisomesh.meshops.decimation.decimate`: squared
    distances from the planes of the faces that were there, by quadrics, and a share of the squared length of the edge
    so that triangles become even. In place of one edge after the other in the order of costs, passes over all edges
    collapse the ones below a limit that grows from pass to pass, and never two at one point. That takes linear time and
    hardly adds to the error, which on smooth surfaces falls with one over the number of points.

    References
    ----------
    Garland, Heckbert, "Surface simplification using quadric error metrics", 1997.
    """
    if surface.n_points <= n_points:
        return Reduced(surface=surface, labels=labels, kept=np.arange(surface.n_points, dtype=np.int32))
    stays = held | _line_ends(surface, labels)
    state = decimation_arrays(surface, stays, labels, moves=False, limits=_FINE_LIMITS)
    set_quadrics(state)
    left, share = surface.n_points, _SHARE * (1.0 - n_points / surface.n_points)
    limit, idle = _quantile_of_costs(state, share), 0
    for number in range(1, _MOST_PASSES + 1):
        count = collapse_cheap_edges(state, limit, left - n_points, number)
        left, idle = left - count, 0 if count else idle + 1
        if left == n_points or idle == _MAX_IDLE_PASSES:
            break
        limit *= _GROWTH if left > _LAST_FACTOR * n_points else _LAST_GROWTH
        if count == 0:
            limit = max(limit, _quantile_of_costs(state, _SHARE))
    alive = state.mesh.faces[:, 0] >= 0
    used, position = np.unique(state.mesh.faces[alive], return_inverse=True)
    result = Surface(state.mesh.points[used], position.reshape(-1, 3).astype(np.int32))
    return Reduced(surface=result, labels=MarkedSurface.of(result, state.mesh, alive).labels, kept=state.origin[used])


def _quantile_of_costs(state: Decimation, share: float) -> float:
    """Return the cost that a share of the edges does not exceed, from a sample."""
    step = max(1, len(state.mesh.faces) // _SAMPLED_FACES)
    costs = np.empty(3 * (len(state.mesh.faces) // step + 1))
    count = costs_of_edges(state, step, costs)
    return float(np.quantile(costs[:count], share)) if count else 0.0


def _line_ends(surface: Surface, labels: EdgeLabels) -> PointMask:
    """Return which points (V,) lines end at, meet at, or change their label at."""
    on_line = labels != 0
    ends, values = surface.edges[on_line], labels[on_line]
    n = surface.n_points
    count = np.bincount(ends.ravel(), minlength=n)
    least, most = np.full(n, np.iinfo(np.int32).max), np.zeros(n, dtype=np.int32)
    np.minimum.at(least, ends, values[:, None])
    np.maximum.at(most, ends, values[:, None])
    return np.asarray((count != 0) & ((count != 2) | (least != most)))
