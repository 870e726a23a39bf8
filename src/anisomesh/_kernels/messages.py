"""The largest message among the neighbours of each node, channel by channel, and its derivative."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._kernels.compiled import allocating, kernel

Floats = npt.NDArray[np.float32]
Ints = npt.NDArray[np.int32]


@allocating
def largest_messages(
    first: Ints, neighbour: Ints, sent: Floats, along: Floats, weight: Floats, largest: Floats, winner: Ints
) -> None:
    """Write the largest message of each node, max over its edges e of sent[neighbour[e]] + along[e] weight.

    Parameters
    ----------
    first
        First edge of each node (V + 1,).
    neighbour
        Node at the other end of each edge (E,).
    sent
        What each node sends (V, C).
    along
        Values of the edges (E, K).
    weight
        What these add to each channel (K, C).
    largest
        Room for the result (V, C); 0 for a node without an edge.
    winner
        Room for the edge that it comes from (V, C); -1 for a node without an edge.
    """
    channels = sent.shape[1]
    message = np.empty(channels, dtype=np.float32)
    for i in range(len(first) - 1):
        for c in range(channels):
            largest[i, c] = 0.0
            winner[i, c] = -1
        for e in range(first[i], first[i + 1]):
            j = neighbour[e]
            for c in range(channels):
                message[c] = sent[j, c]
            for k in range(along.shape[1]):
                value = along[e, k]
                for c in range(channels):
                    message[c] += value * weight[k, c]
            for c in range(channels):
                if winner[i, c] < 0 or message[c] > largest[i, c]:
                    largest[i, c] = message[c]
                    winner[i, c] = e


@kernel
def spread_back(
    neighbour: Ints,
    along: Floats,
    weight: Floats,
    winner: Ints,
    gradient: Floats,
    to_sent: Floats,
    to_along: Floats,
    to_weight: Floats,
) -> None:
    """Add the derivatives of :func:`largest_messages` to ``to_sent`` (V, C), ``to_along`` (E, K), ``to_weight`` (K, C).

    Parameters
    ----------
    neighbour, along, weight, winner
        As there.
    gradient
        Of the result (V, C).
    """
    for i in range(winner.shape[0]):
        for c in range(winner.shape[1]):
            e = winner[i, c]
            if e >= 0:
                g = gradient[i, c]
                to_sent[neighbour[e], c] += g
                for k in range(along.shape[1]):
                    to_weight[k, c] += g * along[e, k]
                    to_along[e, k] += g * weight[k, c]
