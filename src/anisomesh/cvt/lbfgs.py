"""Minimisation of a tessellation's energy by L-BFGS."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import PointTensors, Sites, SiteScalars
from anisomesh.cvt.energy import Energy, evaluate_energy, inverse_blocks
from anisomesh.cvt.lloyd import OnIteration, divide_rows
from anisomesh.execution.deadline import NO_DEADLINE, Deadline
from anisomesh.voronoi.restricted import EnergyValue, RestrictedVoronoi

_ARMIJO = 1e-4  # share of the expected decrease that a step must reach; Nocedal and Wright, section 3.1
_WOLFE = 0.9  # share of the slope that may be left; the same
_MAX_LINE_SEARCH_TRIALS = 12  # halvings to 2e-4 of the first step


class Status(StrEnum):
    """Why an optimisation stopped."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "all iterations done"
    TIME_LIMIT = "ended by the time limit"
    NO_DESCENT = "no step lowers the energy further: a kink of the energy, or the limit of floating point"


@dataclass(frozen=True, kw_only=True)
class Optimised:
    """Result of an optimisation.

    Attributes
    ----------
    sites
        Positions (S, d).
    energy, mass
        Their energy, and the mass of each cell (S,).
    iterations, evaluations
        Numbers of iterations, and of evaluations of the energy.
    status
        Why it stopped.
    """

    sites: Sites
    energy: float
    mass: SiteScalars
    iterations: int
    evaluations: int
    status: Status


@dataclass(frozen=True, kw_only=True)
class DescentOptions:
    """Bounds of the minimisation.

    Attributes
    ----------
    max_iterations
        Upper bound on iterations; an iteration takes one evaluation, rarely two.
    memory
        Pairs of steps and gradient changes kept.
    tolerance
        The optimisation has converged when the root mean square, weighted by mass, of the step gradient / (2 mass)
        falls below this share of the root of energy / mass: when sites would move by about that share of a cell's
        radius.
    """

    max_iterations: int = 150
    memory: int = 7
    tolerance: float = 1e-4


Mask = npt.NDArray[np.bool_]


def minimise(
    voronoi: RestrictedVoronoi,
    sites: Sites,
    energy: Energy,
    *,
    options: DescentOptions,
    fixed: Mask | None = None,
    on_iteration: OnIteration | None = None,
    deadline: Deadline = NO_DEADLINE,
) -> Optimised:
    """Minimise an energy from these sites by L-BFGS.

    Parameters
    ----------
    voronoi
        The diagram over the embedded surface.
    sites
        Start positions (S, d).
    energy
        The energy, for example :class:`~anisomesh.cvt.energy.NormalMetric`.
    options
        Bounds and tolerances.
    fixed
        Sites that stay where they are (S,).
    on_iteration
        Called with iteration and energy after every iteration.
    deadline
        Asked before every iteration.

    Notes
    -----
    Two-loop recursion with the inverse of twice the masses as initial matrix, scaled as usual by the last pair: for the
    plain CVT and no pairs the step is Lloyd's. With a :class:`~anisomesh.cvt.energy.PreconditionedEnergy` each site has
    a block more, which saves iterations. The line search accepts the weak Wolfe
    conditions by bisection (Lewis and Overton 2013), from step 1. All sums are NumPy's own, so the result does not
    depend on a threaded BLAS.

    With a normal metric the energy has kinks where a cell boundary lies along a mesh edge, because the normal jumps
    there; on a surface that is coarse against the cells the optimisation can end in one, with a gradient left.

    References
    ----------
    Liu, Wang, Levy, Sun, Yan, Lu, Yang, "On centroidal Voronoi tessellation: energy smoothness and fast
    computation", TOG 2009; Nocedal and Wright, "Numerical optimization", algorithm 7.4.
    """

    def evaluate(positions: Sites) -> EnergyValue:
        value = evaluate_energy(energy, voronoi, positions)
        if fixed is not None:
            value.gradient[fixed] = 0.0
        return value

    here = evaluate(sites)
    evaluations, iteration, status = 1, 0, Status.ITERATION_LIMIT
    inverse = _InverseHessian(options.memory, inverse_blocks(energy, voronoi, sites))
    while iteration < options.max_iterations:
        if _relative_gradient(here) < options.tolerance:
            status = Status.CONVERGED
            break
        if deadline.passed():
            status = Status.TIME_LIMIT
            break
        direction, slope = inverse.descent(here)
        step, there, trials = _line_search(evaluate, sites, here, direction, slope)
        evaluations += trials
        if there is None:
            if not inverse.forget():
                status = Status.NO_DESCENT
                break
            continue
        inverse.learn(step * direction, there.gradient - here.gradient)
        sites, here, iteration = sites + step * direction, there, iteration + 1
        if on_iteration is not None:
            on_iteration(iteration, here.value)
    return Optimised(
        sites=sites,
        energy=here.value,
        mass=here.mass,
        iterations=iteration,
        evaluations=evaluations,
        status=status,
    )


class _InverseHessian:
    """The inverse Hessian of an energy as L-BFGS knows it: an initial matrix, and pairs of steps and their effects."""

    def __init__(self, memory: int, blocks: PointTensors | None) -> None:
        self._pairs: deque[tuple[Sites, Sites, float]] = deque(maxlen=memory)
        self._blocks = blocks

    def learn(self, moved: Sites, change: Sites) -> None:
        """Remember a step and the change of the gradient, unless the energy is concave along it."""
        curvature = _dot(moved, change)
        if curvature > 0.0:
            self._pairs.append((moved, change, 1.0 / curvature))

    def forget(self) -> bool:
        """Forget all steps, and return whether there were any."""
        known = bool(self._pairs)
        self._pairs.clear()
        return known

    def descent(self, here: EnergyValue) -> tuple[Sites, float]:
        """Return a direction of descent and the slope along it; steps that do not lead to one are forgotten."""
        direction = self._direction(here)
        slope = _dot(here.gradient, direction)
        if slope >= 0.0:
            self.forget()
            direction = self._direction(here)
            slope = _dot(here.gradient, direction)
        return direction, slope

    def _direction(self, here: EnergyValue) -> Sites:
        """Return the direction of L-BFGS (two-loop recursion)."""
        q = here.gradient.copy()
        factors = []
        for moved, change, rho in reversed(self._pairs):
            factor = rho * _dot(moved, q)
            factors.append(factor)
            q -= factor * change
        q = self._scaled(q, here)
        if self._pairs:
            _, change, rho = self._pairs[-1]
            q /= rho * _dot(change, self._scaled(change, here))
        for (moved, change, rho), factor in zip(self._pairs, reversed(factors), strict=True):
            q += (factor - rho * _dot(change, q)) * moved
        return -q

    def _scaled(self, gradient: Sites, here: EnergyValue) -> Sites:
        """Return a gradient (S, d) times the initial matrix: over twice the masses, times the blocks in space."""
        step = divide_rows(gradient, 2.0 * here.mass)
        if self._blocks is not None:
            step[:, :3] = np.einsum("sij,sj->si", self._blocks, step[:, :3])
        return step


def _line_search(
    evaluate: Callable[[Sites], EnergyValue], sites: Sites, here: EnergyValue, direction: Sites, slope: float
) -> tuple[float, EnergyValue | None, int]:
    """Return a step that satisfies the weak Wolfe conditions, its evaluation, and the number of trials."""
    low, high, step = 0.0, np.inf, 1.0
    best: tuple[float, EnergyValue | None] = (0.0, None)
    for trial in range(1, _MAX_LINE_SEARCH_TRIALS + 1):
        there = evaluate(sites + step * direction)
        if there.value > here.value + _ARMIJO * step * slope:
            high = step
        else:
            best = (step, there)
            if _dot(there.gradient, direction) >= _WOLFE * slope:
                return step, there, trial
            low = step
        step = 0.5 * (low + high) if np.isfinite(high) else 2.0 * low
    return best[0], best[1], _MAX_LINE_SEARCH_TRIALS


def _relative_gradient(here: EnergyValue) -> float:
    """Return the mass-weighted distance to the minimum, as a share of the root mean square cell radius."""
    step = divide_rows(here.gradient, 2.0 * here.mass)
    return float(np.sqrt(_dot(here.mass[:, None] * step, step) / max(here.value, np.finfo(float).tiny)))


def _dot(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]) -> float:
    return float(np.einsum("ij,ij->", a, b))
