"""Means over rings of edges around points."""

import numpy as np

from .compiled import kernel


@kernel
def mean_ring_lengths(normals, first, neighbours, radius, seen, ring, lengths):
    """Write the length of the mean of the normals (V, 3) over the ``radius``-ring of each point.

    The neighbours of point ``v`` are the entries from ``first[v]`` to ``first[v + 1]``. ``seen`` (V,) is -1 between
    calls, and ``ring`` (V,) a workspace.
    """
    for centre in range(lengths.shape[0]):
        ring[0] = centre
        seen[centre] = centre
        begin, end = 0, 1
        for _ in range(radius):
            n = end
            for k in range(begin, end):
                for m in range(first[ring[k]], first[ring[k] + 1]):
                    other = neighbours[m]
                    if seen[other] != centre:
                        seen[other] = centre
                        ring[n] = other
                        n += 1
            begin, end = end, n
        x = y = z = 0.0
        for k in range(end):
            x += normals[ring[k], 0]
            y += normals[ring[k], 1]
            z += normals[ring[k], 2]
        lengths[centre] = np.sqrt(x * x + y * y + z * z) / end
    for centre in range(lengths.shape[0]):
        seen[centre] = -1
