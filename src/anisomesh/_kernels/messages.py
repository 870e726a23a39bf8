"""Kernels of message passing: maximum and mean over neighbours, distances of features, and their gradients."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._kernels.compiled import allocating, inlined, kernel, summing

Floats = npt.NDArray[np.float32]
Ints = npt.NDArray[np.int32]


@allocating
def max_messages(
    first: Ints, neighbour: Ints, sent: Floats, edge_features: Floats, weight: Floats, maximum: Floats, winner: Ints
) -> None:
    """Compute the maximum over the edges e of each node of sent[neighbour[e]] + edge_features[e] weight, per channel.

    Parameters
    ----------
    first
        First edge of each node (V + 1,), the row pointers of compressed rows.
    neighbour
        Node at the other end of each edge (E,).
    sent
        Message of each node (V, C).
    edge_features
        Features of the edges (E, K).
    weight
        Linear map of the edge features to the channels (K, C).
    maximum
        Output (V, C); 0 for a node without edges.
    winner
        Output (V, C): edge of the maximum; -1 for a node without edges.
    """
    channels = sent.shape[1]
    message = np.empty(channels, dtype=np.float32)
    for i in range(len(first) - 1):
        for c in range(channels):
            maximum[i, c] = 0.0
            winner[i, c] = -1
        for e in range(first[i], first[i + 1]):
            j = neighbour[e]
            for c in range(channels):
                message[c] = sent[j, c]
            for k in range(edge_features.shape[1]):
                value = edge_features[e, k]
                for c in range(channels):
                    message[c] += value * weight[k, c]
            for c in range(channels):
                if winner[i, c] < 0 or message[c] > maximum[i, c]:
                    maximum[i, c] = message[c]
                    winner[i, c] = e


@kernel
def max_messages_gradient(
    neighbour: Ints,
    edge_features: Floats,
    weight: Floats,
    winner: Ints,
    gradient: Floats,
    to_sent: Floats,
    to_edges: Floats,
    to_weight: Floats,
) -> None:
    """Add the gradient of :func:`max_messages` to ``to_sent`` (V, C), ``to_edges`` (E, K) and ``to_weight`` (K, C).

    Parameters
    ----------
    neighbour, edge_features, weight, winner
        As in :func:`max_messages`.
    gradient
        Derivative with respect to the maximum (V, C).
    """
    for i in range(winner.shape[0]):
        for c in range(winner.shape[1]):
            e = winner[i, c]
            if e >= 0:
                g = gradient[i, c]
                to_sent[neighbour[e], c] += g
                for k in range(edge_features.shape[1]):
                    to_weight[k, c] += g * edge_features[e, k]
                    to_edges[e, k] += g * weight[k, c]


@inlined
def _write_message(own: Floats, sent: Floats, edge_features: Floats, weight: Floats, message: Floats) -> None:
    """Compute own + sent + edge_features weight from rows (C,), (C,), (K,) and weights (K, C)."""
    for c in range(len(message)):
        message[c] = own[c] + sent[c]
    for k in range(len(edge_features)):
        value = edge_features[k]
        for c in range(len(message)):
            message[c] += value * weight[k, c]


@allocating
def mean_messages(
    first: Ints,
    neighbour: Ints,
    own: Floats,
    sent: Floats,
    edge_features: Floats,
    weight: Floats,
    slope: float,
    mean: Floats,
) -> None:
    """Compute the mean over the edges e of node i of leaky(own[i] + sent[neighbour[e]] + edge_features[e] weight).

    Parameters
    ----------
    first, neighbour, sent, edge_features, weight
        As in :func:`max_messages`.
    own
        Term of the receiving node (V, C).
    slope
        Slope of the leaky rectifier below zero.
    mean
        Output (V, C); 0 for a node without edges.
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
            _write_message(own[i], sent[j], edge_features[e], weight, message)
            for c in range(channels):
                mean[i, c] += share * max(message[c], below * message[c])


@allocating
def mean_messages_gradient(
    first: Ints,
    neighbour: Ints,
    own: Floats,
    sent: Floats,
    edge_features: Floats,
    weight: Floats,
    slope: float,
    gradient: Floats,
    to_own: Floats,
    to_sent: Floats,
    to_weight: Floats,
) -> None:
    """Add the gradient of :func:`mean_messages` to ``to_own`` (V, C), ``to_sent`` (V, C) and ``to_weight`` (K, C).

    Parameters
    ----------
    first, neighbour, own, sent, edge_features, weight, slope
        As in :func:`mean_messages`.
    gradient
        Derivative with respect to the mean (V, C).
    """
    channels = sent.shape[1]
    message = np.empty(channels, dtype=np.float32)
    below = np.float32(slope)
    for i in range(len(first) - 1):
        share = np.float32(1.0 / max(first[i + 1] - first[i], 1))
        for e in range(first[i], first[i + 1]):
            j = neighbour[e]
            _write_message(own[i], sent[j], edge_features[e], weight, message)
            for c in range(channels):
                g = share * gradient[i, c] * (np.float32(1.0) if message[c] > 0.0 else below)
                message[c] = g
                to_own[i, c] += g
                to_sent[j, c] += g
            for k in range(edge_features.shape[1]):
                value = edge_features[e, k]
                for c in range(channels):
                    to_weight[k, c] += value * message[c]


@summing
def feature_distances(first: Ints, neighbour: Ints, values: Floats, softening: float, distance: Floats) -> None:
    """Compute sqrt(|values[j] - values[i]|^2 + softening) for each edge from i to j.

    Parameters
    ----------
    first, neighbour
        As in :func:`max_messages`.
    values
        Features of the nodes (V, C).
    softening
        Positive number that keeps the distance differentiable where the features are equal.
    distance
        Output (E,).
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
def feature_distances_gradient(
    first: Ints, neighbour: Ints, values: Floats, distance: Floats, gradient: Floats, to_values: Floats
) -> None:
    """Add the gradient of :func:`feature_distances` to ``to_values`` (V, C).

    Parameters
    ----------
    first, neighbour, values, distance
        As in :func:`feature_distances`.
    gradient
        Derivative with respect to the distances (E,).
    """
    for i in range(len(first) - 1):
        for e in range(first[i], first[i + 1]):
            j = neighbour[e]
            share = gradient[e] / distance[e]
            for c in range(values.shape[1]):
                part = share * (values[j, c] - values[i, c])
                to_values[j, c] += part
                to_values[i, c] -= part
