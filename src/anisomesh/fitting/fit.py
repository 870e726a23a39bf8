"""The fit of a mesh to a surface: error and shape of its triangles together, by local changes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from anisomesh.execution.deadline import NO_DEADLINE, Deadline
from anisomesh.fitting.arrays import FitTask
from anisomesh.fitting.samples import SurfaceSamples
from anisomesh.fitting.state import FitState
from anisomesh.mesh.surface import Surface

SAMPLES_PER_VERTEX = 40
"""Samples for each vertex to which a mesh is fitted; fewer are fitted better than the surface between them."""

_LAST_SWEEPS = 8  # at most
_RISE = (1.0, 7.0, 50.0, 300.0)  # steps of a price that rises
_MAX_ERROR_FACTOR = 2.5  # root mean squared error over the one at the start, up to which a price rises
_MIN_SWEEP_GAIN = 1e-2  # of the energy in a sweep, below which it is the last


@dataclass(frozen=True, kw_only=True)
class FitOptions:
    """How much the shape of triangles counts, and how many edges are exchanged.

    Attributes
    ----------
    price
        Price of a triangle of quality 0 at the end, in mean errors of a triangle at the start.
    exchange_price
        The same while edges are exchanged. At the final price a split would hardly pay, since the shapes around a new
        point get good only afterwards.
    rounds
        Rounds of exchanges; 0 to keep the points.
    first_sweeps, round_sweeps
        Sweeps before the first exchange and after each, at most.
    share
        Points added and removed in a round, of all points.
    min_quality
        Mean quality up to which the price rises: to 300 times what it is at most, and as long as the root mean squared
        error is not 2.5 times the one at the start. 0 for a price that stays.
    """

    price: float = 20.0
    exchange_price: float = 2.0
    rounds: int = 4
    first_sweeps: int = 4
    round_sweeps: int = 2
    share: float = 0.05
    min_quality: float = 0.0

    def weighted(self, shape_weight: float) -> FitOptions:
        """Return the options with prices times a factor."""
        return replace(self, price=shape_weight * self.price, exchange_price=shape_weight * self.exchange_price)


@dataclass(frozen=True, kw_only=True)
class FitPlan:
    """What is fitted, and how.

    Attributes
    ----------
    mesh
        How a mesh is fitted.
    decimation
        How a decimation of the surface is fitted in place of the mesh, None if it is not.
    relative
        Whether distances count relative to the area that the metric gives a triangle, not as they are. Where triangles
        are ten times as large, their distances are a hundred times as large, and would draw all points there.
    samples_per_vertex
        Samples on faces for each vertex of the mesh.
    threads
        Number of threads; the result does not depend on it.
    """

    mesh: FitOptions = field(default_factory=FitOptions)
    decimation: FitOptions | None = None
    relative: bool = False
    samples_per_vertex: int = SAMPLES_PER_VERTEX
    threads: int = 1


def fit_mesh(
    task: FitTask,
    samples: SurfaceSamples,
    options: FitOptions | None = None,
    *,
    threads: int = 1,
    deadline: Deadline = NO_DEADLINE,
) -> Surface:
    """Return a mesh with as many points, changed such that it is nearer to a surface and its triangles better shaped.

    Parameters
    ----------
    task
        The mesh.
    samples
        Samples of the surface, at bounding-box diagonal 1.
    options
        How it is fitted.
    threads
        Number of threads; the result does not depend on it.
    deadline
        Asked before every sweep and round.

    Notes
    -----
    The energy is sum w d^2 + price sum (1 - G): weight and squared distance of each sample to the mesh, and the quality
    of each triangle in the metric of its samples. The price is proportional to the error at the start, so it does not
    depend on the size of the surface, and what is exact stays so.

    - *Moves.* A point goes to the best of a few places: between the least squares fit of the planes of the samples
      around it, which is a system of three equations, and the mean of the places at which each of its triangles is
      equilateral. Where the samples say nothing about a direction, as along a crease or in a plane, the shape decides.
    - *Flips* of edges.
    - *Exchange.* The edges whose splits lower the energy most are split, and as many collapsed that raise it least.

    Every change is one of the energy of the triangles around it, with their samples free to go to any of these, and
    none is made that inverts a triangle against its samples. A round of exchanges that has not lowered the energy is
    undone.

    References
    ----------
    Hoppe, DeRose, Duchamp, McDonald, Stuetzle, "Mesh optimization", 1993 (samples, local changes); NASM, section 4.1
    (G).
    """
    options = FitOptions() if options is None else options
    count = int(options.share * task.mesh.n_points) + 1 if options.rounds else 0
    state = FitState(task, samples, n_spare=count, threads=threads)
    largest = _MAX_ERROR_FACTOR**2 * state.mean_square
    for factor in _RISE:
        saved = state.saved() if factor > 1.0 else None
        _fit_at(state, options, factor * state.mean_triangle_error, count, deadline)
        if saved is not None and state.present_mean_square > largest:
            state.restore(saved)
            break
        if deadline.passed() or state.mean_quality >= options.min_quality:
            break
    return state.surface()


def _fit_at(state: FitState, options: FitOptions, unit: float, count: int, deadline: Deadline) -> None:
    """Lower the energy with prices in this unit, in every round with an exchange of this many points."""
    price, exchange_price = options.price * unit, options.exchange_price * unit
    state.wake()
    _settle(state, price, options.first_sweeps, deadline)
    for _ in range(options.rounds):
        if deadline.passed() or not _exchange(state, exchange_price, count, options.round_sweeps, deadline):
            break
    state.wake()
    _settle(state, price, _LAST_SWEEPS, deadline)


def _settle(state: FitState, price: float, sweeps: int, deadline: Deadline) -> None:
    """Sweep until the energy hardly gets lower."""
    before = state.energy(price)
    for _ in range(sweeps):
        if deadline.passed():
            break
        state.sweep(price)
        after = state.energy(price)
        if after > (1.0 - _MIN_SWEEP_GAIN) * before:
            break
        before = after


def _exchange(state: FitState, price: float, count: int, sweeps: int, deadline: Deadline) -> bool:
    """Split edges and collapse as many, and return whether that has lowered the energy; if not, undo it."""
    saved, before = state.saved(), state.energy(price)
    added = state.split(price, count)
    if added == 0:
        return False
    state.sweep(price)
    removed = state.collapse(price, added)
    _settle(state, price, sweeps, deadline)
    if removed == added and state.energy(price) < before:
        return True
    state.restore(saved)
    return False
