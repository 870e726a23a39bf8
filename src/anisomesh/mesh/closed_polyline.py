"""Points of a loop placed on a closed polyline, by arc length."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

_TURNS = 64  # starts tried of a loop that is placed by its length

Floats = npt.NDArray[np.float64]


def _arc_lengths(corners: Floats) -> Floats:
    """Return the arc length at each corner (n,) of a polyline."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])


def placed_on(points: Floats, sides: Floats, corners: Floats, *, forward: bool = False) -> tuple[int, Floats] | None:
    """Return the arc lengths (n,) of the points of a loop on a closed polyline (m + 1, 3), ascending.

    ``sides`` are the arc lengths (n,) of the sides that follow each point. They begin at the first of the points behind
    the start of the polyline, of which the number is returned too. None if the loop does not go around once; with
    ``forward`` no side is behind the one before it, however far that is.
    """
    start = _arc_lengths(corners)
    total = float(start[-1])
    shift = 0.0 if forward else 0.5 * total
    steps = np.mod(sides - np.roll(sides, 1) + shift, total) - shift
    if len(points) < 3 or abs(steps.sum() - total) > 0.5 * total:
        return None
    before = sides[-1] + np.cumsum(steps) - steps
    placed = np.empty(len(points))
    for k, (point, low, step) in enumerate(zip(points, before.tolist(), steps.tolist(), strict=True)):
        placed[k] = _closest(point, low + min(step, 0.0), abs(step), start, corners)
    return _from_start(np.minimum(np.maximum.accumulate(placed), placed[0] + total), total)


def misfit_of(placed: tuple[int, Floats], points: Floats, corners: Floats) -> float:
    """Return the largest distance of points (n, 3) from where they are placed on a closed polyline (m + 1, 3)."""
    first, places = placed
    start = _arc_lengths(corners)
    at = np.stack([np.interp(places, start, axis, period=float(start[-1])) for axis in corners.T], axis=1)
    return float(np.linalg.norm(at - np.roll(points, -first, axis=0), axis=1).max())


def _from_start(placed: Floats, total: float) -> tuple[int, Floats]:
    """Return which of some ascending arc lengths (n,) around a loop is the first behind its start, and all from it."""
    turn = np.floor(placed / total)
    first = int(np.argmax(turn > turn[0])) if turn[-1] > turn[0] else 0
    return first, np.maximum.accumulate(np.roll(placed - turn * total, -first))  # equal ones may be rounded apart


def placed_by_length(points: Floats, corners: Floats, reach: float) -> tuple[int, Floats] | None:
    """Return the arc lengths (n,) of the points of a loop on a closed polyline (m + 1, 3), by the loop's own length.

    The loop begins where its points come nearest in all. Returned as by :func:`placed_on`; None if they are farther off
    than ``reach`` and their mean distance along the polyline.
    """
    start = _arc_lengths(corners)
    total, n = float(start[-1]), len(points)
    own = _arc_lengths(np.concatenate([points, points[:1]]))
    share = own[:-1] / max(float(own[-1]), np.finfo(np.float64).tiny)
    places = total * (np.linspace(0.0, 1.0, _TURNS, endpoint=False)[:, None] + share)
    at = np.stack([np.interp(places, start, axis, period=total) for axis in corners.T], axis=-1)
    squares = ((at - points) ** 2).sum(axis=2).mean(axis=1)
    best = int(np.argmin(squares))
    return _from_start(places[best], total) if squares[best] <= max(total / n, reach) ** 2 else None


def _closest(point: Floats, first: float, length: float, start: Floats, corners: Floats) -> float:
    """Return the arc length on a closed polyline closest to a point (3,), in an interval that starts at ``first``."""
    total = float(start[-1])
    turns = np.floor(first / total) * total
    first -= turns
    inner = np.concatenate([start, start[1:] + total])
    cuts = np.concatenate([[first], inner[(inner > first) & (inner < first + length)], [first + length]])
    best, nearest = np.inf, first
    for low, high in pairwise(cuts.tolist()):
        a, b = _at(low, start, corners), _at(high, start, corners)
        way = b - a
        square = float(way @ way)
        share = min(max(float((point - a) @ way) / square, 0.0), 1.0) if square > 0.0 else 0.0
        distance = float(np.linalg.norm(a + share * way - point))
        if distance < best:
            best, nearest = distance, low + share * (high - low)
    return float(nearest + turns)


def _at(place: float, start: Floats, corners: Floats) -> Floats:
    """Return the point (3,) of a closed polyline at an arc length."""
    place = place % float(start[-1])
    k = min(int(np.searchsorted(start, place, side="right")) - 1, len(start) - 2)
    length = max(float(start[k + 1] - start[k]), np.finfo(np.float64).tiny)
    return np.asarray(corners[k] + (place - start[k]) / length * (corners[k + 1] - corners[k]))
