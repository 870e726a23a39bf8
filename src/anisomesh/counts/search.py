"""The smallest number of vertices that keeps a remesh within a distance of the surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import exp, log

from anisomesh.errors import OptionError, TimeLimitError
from anisomesh.execution.deadline import Deadline
from anisomesh.mesh.distance import hausdorff_distance
from anisomesh.mesh.surface import Surface
from anisomesh.options import MIN_VERTICES
from anisomesh.result import RemeshResult

MAX_SEARCH_RUNS = 16  # heuristic; ten are usual
COUNT_PRECISION = 1.03  # the search ends when a count smaller by this factor is known to be too small
FIRST_RATIO = 0.1  # vertices per vertex of the surface, for the first run; heuristic
MAX_FIRST_COUNT = 2_000  # largest count of the first run; heuristic
MAX_RATIO, MAX_MORE = 4, 1_000  # largest count: ratio times the vertices of the surface, and more
_ENDED = "the time limit ended the search for fewer vertices"
DISTANCE_SAMPLES = 50_000  # points on each surface besides vertices and edge midpoints; the largest are followed


@dataclass(frozen=True, kw_only=True)
class Counts:
    """The counts of a search: the first one tried, the smallest, the largest, and one tried before any larger one."""

    first: int
    least: int
    most: int
    milestone: int = 0


def smallest_within(
    remesh: Callable[[int], RemeshResult],
    surface: Surface,
    max_error: float,
    deadline: Deadline,
    *,
    least: int = MIN_VERTICES,
) -> RemeshResult:
    """Return the smallest remesh found with a distance to the surface, both ways, of at most ``max_error``.

    The distance from prescribed edges to edges that follow them counts as well.

    Parameters
    ----------
    remesh
        Returns the result for a number of vertices.
    surface
        The surface that is remeshed.
    max_error
        Largest distance, in the units of the surface.
    deadline
        The search ends when it has passed, if a sufficient result is known.
    least
        The smallest number that is allowed.

    Raises
    ------
    OptionError
        If four times the vertices of the surface are not enough.
    TimeLimitError
        If the deadline passes before any sufficient result.
    """
    results: dict[int, RemeshResult] = {}

    def error_at(n: int) -> float:
        result = remesh(n)
        error = hausdorff_distance(surface, result.surface, DISTANCE_SAMPLES)
        lost = min(result.feature_distance, surface.diagonal)
        if max(error, lost) <= max_error:
            results.clear()
            results[n] = replace(result, distance=error)  # only the last sufficient result is kept
        return max(error, lost)

    counts = Counts(
        first=max(least, min(round(FIRST_RATIO * surface.n_points), MAX_FIRST_COUNT)),
        least=least,
        most=MAX_RATIO * surface.n_points + MAX_MORE,
        milestone=surface.n_points,
    )
    try:
        n, error = smallest_count(error_at, max_error, counts, stop=deadline.passed)
    except TimeLimitError:
        if not results:
            raise
        found = next(iter(results.values()))
        return replace(found, warnings=(*found.warnings, _ENDED))
    if n not in results:
        raise OptionError(
            f"max_error = {max_error:g} is not reached: with {n:,} vertices the distance is {error:g}, "
            f"on a mesh whose bounding-box diagonal is {surface.diagonal:.4g}; allow more"
        )
    result = results[n]
    if deadline.passed():
        result = replace(result, warnings=(*result.warnings, _ENDED))
    if n > surface.n_points:
        more = f"the distance takes more vertices than the input has ({n:,} for {surface.n_points:,})"
        result = replace(result, warnings=(*result.warnings, more))
    return result


def smallest_count(
    error_at: Callable[[int], float],
    max_error: float,
    counts: Counts,
    *,
    stop: Callable[[], bool] = lambda: False,
) -> tuple[int, float]:
    """Return the smallest count found with an error of at most ``max_error``, and that error.

    Parameters
    ----------
    error_at
        The error for a count; it decreases about as a power of the count, not monotonically.
    max_error
        The error allowed.
    counts
        The counts that are allowed.
    stop
        Whether to end now, asked once a sufficient count is known.

    Returns
    -------
    n, error
        A sufficient count, unless ``most`` (or the last count tried) has a larger error.

    Notes
    -----
    The answer is bracketed by a too small and a sufficient count, and the bracket shrunk by the secant through both in
    logarithms, until its ends are within 3 % of each other.
    """
    least, most = counts.least, counts.most
    n = min(max(counts.first, least), most)
    error = error_at(n)
    low: tuple[int, float] | None = None
    high: tuple[int, float] | None = None
    for _ in range(MAX_SEARCH_RUNS):
        if error <= max_error:
            high = n, error
        else:
            low = n, error
        if high is not None and (high[0] == least or stop()):
            break
        if low is not None and (low[0] == most or (high is not None and _close(low[0], high[0]))):
            break
        n = _next(low, high, max_error, least, most)
        if n > counts.milestone and (low is None or low[0] < counts.milestone):
            n = max(counts.milestone, least)
        error = error_at(n)
    else:
        if error <= max_error:
            high = n, error
    return high or (n, error)


def _close(low: int, high: int) -> bool:
    return high <= low + 1 or high <= COUNT_PRECISION * low


def _next(
    low: tuple[int, float] | None, high: tuple[int, float] | None, max_error: float, least: int, most: int
) -> int:
    """Return the count to try next: beyond the end that is known, or between both."""
    if low is None or high is None:
        n, error = low or high or (least, max_error)
        factor = min(max(error / max_error, 1e-3), 1e3)  # the error of a smooth surface is about as 1 / count
        factor = min(max(factor, 1.3), 4.0) if low is not None else min(max(factor, 0.25), 1 / 1.3)
        return min(max(round(factor * n), least), most)
    width = log(high[0] / low[0])
    drop = log(max(low[1], 1e-300) / max(high[1], 1e-300))
    share = log(low[1] / max_error) / drop if drop > 0.0 else 0.5
    share = min(max(share, 0.15), 0.85)
    n = round(exp(log(low[0]) + share * width))
    return min(max(n, low[0] + 1), high[0] - 1)
