"""Lloyd's algorithm and L-BFGS on the CVT energy."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Sites
from anisomesh.deadline import Stop, never
from anisomesh.voronoi.restricted import Evaluation, RestrictedVoronoi

_ARMIJO = 1e-4
_WOLFE = 0.9
_MAX_TRIALS = 12


class Status(StrEnum):
    """Why an optimisation stopped."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "all iterations done; more (max_iterations) would lower the energy a little"
    TIME_LIMIT = "ended by the time limit"
    NO_DESCENT = "no step lowers the energy further: a kink of the energy, or the limit of floating point"


@dataclass(frozen=True, kw_only=True)
class Optimised:
    """Sites (S, d), their energy, the number of iterations and of evaluations, and why it stopped."""

    sites: Sites
    energy: float
    iterations: int
    evaluations: int
    status: Status


Step = Callable[[int, float], None]
Mask = npt.NDArray[np.bool_]


def lloyd(
    voronoi: RestrictedVoronoi, sites: Sites, iterations: int, on_step: Step | None = None, *, fixed: Mask | None = None
) -> Sites:
    """Move every site but the fixed ones (S,) to the centroid of its cell, a number of times; return the sites (S, d).

    A site with an empty cell (hidden by another at the same place) stays.

    References
    ----------
    Lloyd 1982; Du, Faber, Gunzburger, "Centroidal Voronoi tessellations", SIAM Review 1999.
    """
    for iteration in range(iterations):
        evaluation = _evaluate(voronoi, sites, 1.0, fixed)
        sites = sites - _per_site(evaluation.gradient, 2.0 * evaluation.mass)
        if on_step is not None:
            on_step(iteration + 1, evaluation.energy)
    return sites


def minimise(
    voronoi: RestrictedVoronoi,
    sites: Sites,
    *,
    sharpness: float,
    max_iterations: int,
    memory: int = 7,
    tolerance: float = 1e-4,
    on_step: Step | None = None,
    fixed: Mask | None = None,
    stop: Stop = never,
) -> Optimised:
    """Minimise the normal-metric CVT energy from these sites by L-BFGS.

    Parameters
    ----------
    voronoi
        The diagram over the embedded surface.
    sites
        Start positions (S, d).
    sharpness
        The factor s of the normal metric; 1 is the plain CVT.
    max_iterations
        Upper bound on iterations; an iteration takes one evaluation, rarely two.
    memory
        Pairs of steps and gradient changes kept.
    tolerance
        The optimisation has converged when the root mean square, weighted by cell area, of the step gradient /
        (2 area), which is Lloyd's for s = 1, falls below this share of the square root of energy / area: when the
        sites would move by about that share of a cell's radius. It is tested before every iteration.
    on_step
        Called with iteration and energy after every iteration.
    fixed
        Sites that stay where they are (S,).
    stop
        Asked before every iteration whether it is the last one.

    Notes
    -----
    Two-loop recursion with the inverse of twice the cell areas as initial matrix, scaled as usual by the last
    pair: for s = 1 and no pairs the step is Lloyd's. The line search accepts the weak Wolfe conditions by
    bisection (Lewis and Overton 2013), from step 1. All sums are NumPy's own, so the result does not depend
    on a threaded BLAS.

    For s > 1 the energy has kinks where a cell boundary comes to lie along a mesh edge, because the normal jumps
    there; on a surface that is coarse against the cells the optimisation can end in one, with a gradient left.

    References
    ----------
    Liu, Wang, Levy, Sun, Yan, Lu, Yang, "On centroidal Voronoi tessellation: energy smoothness and fast
    computation", TOG 2009; Nocedal and Wright, "Numerical optimization", algorithm 7.4.
    """
    here = _evaluate(voronoi, sites, sharpness, fixed)
    evaluations = 1
    pairs: deque[tuple[Sites, Sites, float]] = deque(maxlen=memory)
    status = Status.ITERATION_LIMIT
    iteration = 0
    while iteration < max_iterations:
        if _relative_gradient(here) < tolerance:
            status = Status.CONVERGED
            break
        if stop():
            status = Status.TIME_LIMIT
            break
        direction = _direction(here, pairs)
        slope = _dot(here.gradient, direction)
        if slope >= 0.0:
            pairs.clear()
            direction = _direction(here, pairs)
            slope = _dot(here.gradient, direction)
        step, there, trials = _line_search(
            lambda place: _evaluate(voronoi, place, sharpness, fixed), sites, here, direction, slope
        )
        evaluations += trials
        if there is None:
            if not pairs:
                status = Status.NO_DESCENT
                break
            pairs.clear()
            continue
        moved = step * direction
        change = there.gradient - here.gradient
        curvature = _dot(moved, change)
        if curvature > 0.0:
            pairs.append((moved, change, 1.0 / curvature))
        sites = sites + moved
        here = there
        iteration += 1
        if on_step is not None:
            on_step(iteration, here.energy)
    return Optimised(sites=sites, energy=here.energy, iterations=iteration, evaluations=evaluations, status=status)


def _evaluate(voronoi: RestrictedVoronoi, sites: Sites, sharpness: float, fixed: Mask | None) -> Evaluation:
    """Return energy and gradient, the gradient of fixed sites as zero."""
    evaluation = voronoi.evaluate(sites, sharpness)
    if fixed is not None:
        evaluation.gradient[fixed] = 0.0
    return evaluation


def _line_search(
    evaluate: Callable[[Sites], Evaluation], sites: Sites, here: Evaluation, direction: Sites, slope: float
) -> tuple[float, Evaluation | None, int]:
    """Return a step that satisfies the weak Wolfe conditions, its evaluation, and the number of trials."""
    low, high, step = 0.0, np.inf, 1.0
    best: tuple[float, Evaluation | None] = (0.0, None)
    for trial in range(1, _MAX_TRIALS + 1):
        there = evaluate(sites + step * direction)
        if there.energy > here.energy + _ARMIJO * step * slope:
            high = step
        else:
            best = (step, there)
            if _dot(there.gradient, direction) >= _WOLFE * slope:
                return step, there, trial
            low = step
        step = 0.5 * (low + high) if np.isfinite(high) else 2.0 * low
    return best[0], best[1], _MAX_TRIALS


def _direction(here: Evaluation, pairs: deque[tuple[Sites, Sites, float]]) -> Sites:
    """Return the L-BFGS direction (two-loop recursion)."""
    q = here.gradient.copy()
    factors = []
    for moved, change, rho in reversed(pairs):
        factor = rho * _dot(moved, q)
        factors.append(factor)
        q -= factor * change
    q = _per_site(q, 2.0 * here.mass)
    if pairs:
        _, change, rho = pairs[-1]
        q /= rho * _dot(change, _per_site(change, 2.0 * here.mass))
    for (moved, change, rho), factor in zip(pairs, reversed(factors), strict=True):
        q += (factor - rho * _dot(change, q)) * moved
    return -q


def _per_site(values: Sites, weights: npt.NDArray[np.float64]) -> Sites:
    """Divide rows (S, d) by weights (S,); rows of weight 0 become 0."""
    return np.asarray(np.divide(values, weights[:, None], out=np.zeros_like(values), where=weights[:, None] > 0.0))


def _relative_gradient(here: Evaluation) -> float:
    """Return the mass-weighted distance to the minimum, as a share of the root mean square cell radius."""
    step = _per_site(here.gradient, 2.0 * here.mass)
    return float(np.sqrt(_dot(here.mass[:, None] * step, step) / max(here.energy, np.finfo(float).tiny)))


def _dot(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]) -> float:
    return float(np.einsum("ij,ij->", a, b))
