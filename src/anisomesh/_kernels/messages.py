"""What nodes get from their neighbours, largest or mean, how far apart their values are, and the derivatives."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._kernels.compiled import allocating, inlined, kernel, summing

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


@inlined
def _write_message(own: Floats, sent: Floats, along: Floats, weight: Floats, message: Floats) -> None:
    """Write own + sent + along weight, from rows (C,), (C,), (K,) and weights (K, C)."""
    for c in range(len(message)):
        message[c] = own[c] + sent[c]
    for k in range(len(along)):
        value = along[k]
        for c in range(len(message)):
            message[c] += value * weight[k, c]


@allocating
def mean_messages(
    first: Ints, neighbour: Ints, own: Floats, sent: Floats, along: Floats, weight: Floats, slope: float, mean: Floats
) -> None:
    """Write the mean over the edges e of each node i of leaky(own[i] + sent[neighbour[e]] + along[e] weight).

    Parameters
    ----------
    first, neighbour, sent, along, weight
        As in :func:`largest_messages`.
    own
        What each node adds to the messages that it gets (V, C).
    slope
        Of the leaky rectifier below zero.
    mean
        Room for the result (V, C); 0 for a node without an edge.
    """
    channels = sent.shape[1]
    message = np.empty(channels, dtype=np.float32)
    below = np.float32(slope)
    for i in range(len(first) - 1):
        for c in range(channels):
            mean[i, c] = 0.0
        share = np.float32(1.0 / max(first[i + 1] - first[i], 1))
        for e in range(first[i], first[i + 1]):
            j = neighbour[e]
            _write_message(own[i], sent[j], along[e], weight, message)
            for c in range(channels):
                mean[i, c] += share * max(message[c], below * message[c])


@allocating
def mean_back(
    first: Ints,
    neighbour: Ints,
    own: Floats,
    sent: Floats,
    along: Floats,
    weight: Floats,
    slope: float,
    gradient: Floats,
    to_own: Floats,
    to_sent: Floats,
    to_weight: Floats,
) -> None:
    """Add the derivatives of :func:`mean_messages` to ``to_own`` (V, C), ``to_sent`` (V, C), ``to_weight`` (K, C).

    Parameters
    ----------
    first, neighbour, own, sent, along, weight, slope
        As there.
    gradient
        Of the result (V, C).
    """
    channels = sent.shape[1]
    message = np.empty(channels, dtype=np.float32)
    below = np.float32(slope)
    for i in range(len(first) - 1):
        share = np.float32(1.0 / max(first[i + 1] - first[i], 1))
        for e in range(first[i], first[i + 1]):
            j = neighbour[e]
            _write_message(own[i], sent[j], along[e], weight, message)
            for c in range(channels):
                g = share * gradient[i, c] * (np.float32(1.0) if message[c] > 0.0 else below)
                message[c] = g
                to_own[i, c] += g
                to_sent[j, c] += g
            for k in range(along.shape[1]):
                value = along[e, k]
                for c in range(channels):
                    to_weight[k, c] += value * message[c]


@summing
def value_distances(first: Ints, neighbour: Ints, values: Floats, softening: float, distance: Floats) -> None:
    """Write the distance between the values of the ends of each edge, sqrt(|values[j] - values[i]|^2 + softening).

    Parameters
    ----------
    first, neighbour
        As in :func:`largest_messages`.
    values
        Of the nodes (V, C).
    softening
        Positive, so that there is a derivative where values are equal.
    distance
        Room for the result (E,).
    """
    for i in range(len(first) - 1):
        for e in range(first[i], first[i + 1]):
            j = neighbour[e]
            total = np.float32(softening)
            for c in range(values.shape[1]):
                way = values[j, c] - values[i, c]
                total += way * way
            distance[e] = np.sqrt(total)


@kernel
def distances_back(
    first: Ints, neighbour: Ints, values: Floats, distance: Floats, gradient: Floats, to_values: Floats
) -> None:
    """Add the derivatives of :func:`value_distances` to ``to_values`` (V, C).

    Parameters
    ----------
    first, neighbour, values, distance
        As there.
    gradient
        Of the distances (E,).
    """
    for i in range(len(first) - 1):
        for e in range(first[i], first[i + 1]):
            j = neighbour[e]
            share = gradient[e] / distance[e]
            for c in range(values.shape[1]):
                part = share * (values[j, c] - values[i, c])
                to_values[j, c] += part
                to_values[i, c] -= part
