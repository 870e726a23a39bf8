"""Compact groups of points, for bounds that hold group by group."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

_MIN_BLOCK_SIZE = 64  # points; performance only
_MAX_BLOCKS = 128  # pairs of blocks are compared; performance only


class Blocks:
    """A division of points (n, d) into compact blocks, by halving along the longest side.

    Attributes
    ----------
    of
        Block of each point (n,).
    order
        The points, block by block (n,).
    start
        First place of each block in ``order`` (B,).
    """

    def __init__(self, points: Floats) -> None:
        size = max(_MIN_BLOCK_SIZE, -(-len(points) // _MAX_BLOCKS))
        parts, done = [np.arange(len(points))], []
        while parts:
            part = parts.pop()
            if len(part) <= size:
                done.append(part)
                continue
            axis = int(np.argmax(np.ptp(points[part], axis=0)))
            half = len(part) // 2
            split = part[np.argpartition(points[part, axis], half)]
            parts += [split[half:], split[:half]]
        sizes = [len(part) for part in done]
        self.order = np.concatenate(done)
        self.start = np.cumsum([0, *sizes[:-1]])
        self.of = np.empty(len(points), dtype=np.int64)
        self.of[self.order] = np.repeat(np.arange(len(done)), sizes)

    def largest(self, values: Floats) -> Floats:
        """Return the largest of the values (n, ...) in each block (B, ...)."""
        return np.asarray(np.maximum.reduceat(values[self.order], self.start))

    def near(self, points: Floats, reach: Floats) -> npt.NDArray[np.bool_]:
        """Return which pairs of blocks (B, B) can hold points no farther apart than the reach (B,) of the first.

        ``points`` (n, d) may have moved since the division.
        """
        high, low = self.largest(points), -self.largest(-points)
        gap2 = np.zeros((len(high), len(high)))
        for axis in range(points.shape[1]):
            between = low[None, :, axis] - high[:, None, axis]
            gap2 += np.maximum(np.maximum(between, between.T), 0.0) ** 2
        return np.asarray(gap2 <= reach[:, None] ** 2)
