"""The fused neighbour kernels as functions of torch."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from anisomesh._kernels.messages import (
    distances_back,
    largest_messages,
    mean_back,
    mean_messages,
    spread_back,
    value_distances,
)
from anisomesh.learn.models.graph import Graph

_SOFTENING = 1e-12  # under the root of a distance, so that it has a derivative where values are equal


class _LargestMessages(torch.autograd.Function):
    """See :func:`largest_of_neighbours`; on the CPU one pass over the edges, with no table of messages."""

    @staticmethod
    def forward(context: Any, sent: Tensor, along: Tensor, weight: Tensor, graph: Graph) -> Tensor:
        sent, along, weight = (value.detach().contiguous() for value in (sent, along, weight))
        largest = torch.empty((graph.n_nodes, sent.shape[1]), dtype=torch.float32)
        winner = torch.empty(largest.shape, dtype=torch.int32)
        arrays = (value.numpy() for value in (sent, along, weight, largest, winner))
        largest_messages(graph.first, graph.neighbour, *arrays)
        context.graph = graph
        context.save_for_backward(along, weight, winner)
        context.n_sent = len(sent)
        return largest

    @staticmethod
    @once_differentiable
    def backward(context: Any, gradient: Tensor) -> tuple[Tensor, Tensor, Tensor, None]:
        along, weight, winner = context.saved_tensors
        to_sent = torch.zeros((context.n_sent, gradient.shape[1]), dtype=torch.float32)
        to_along, to_weight = torch.zeros_like(along), torch.zeros_like(weight)
        values = (along, weight, winner, gradient.contiguous(), to_sent, to_along, to_weight)
        spread_back(context.graph.neighbour, *(value.numpy() for value in values))
        return to_sent, to_along, to_weight, None


def largest_of_neighbours(sent: Tensor, weight: Tensor, graph: Graph, along: Tensor | None = None) -> Tensor:
    """Return the largest message of the neighbours of each node, channel by channel.

    Parameters
    ----------
    sent
        What each node sends (V, C), float32.
    weight
        What the values of an edge add to each channel (K, C).
    graph
        The nodes and their edges, with K values each.
    along
        Other values of the edges (E, K) in place of those.

    Returns
    -------
    Tensor
        (V, C): max over the edges e from i to j of sent[j] + along[e] weight; 0 for a node without an edge.
    """
    along = graph.edges_on(sent.device).along if along is None else along
    if sent.device.type == "cpu":
        largest: Tensor = _LargestMessages.apply(sent, along, weight, graph)  # type: ignore[no-untyped-call]
        return largest
    return largest_by_scatter(sent, weight, graph, along)


def largest_by_scatter(sent: Tensor, weight: Tensor, graph: Graph, along: Tensor | None = None) -> Tensor:
    """Return the same by plain operations of torch, on any device."""
    edges = graph.edges_on(sent.device)
    messages = sent[edges.neighbour] + (edges.along if along is None else along) @ weight
    start = messages.new_full((graph.n_nodes, sent.shape[1]), -torch.inf)
    index = edges.node[:, None].expand_as(messages)
    largest = start.scatter_reduce(0, index, messages, "amax", include_self=True)
    return torch.where(torch.isinf(largest), torch.zeros_like(largest), largest)


class _Distances(torch.autograd.Function):
    """See :func:`distance_of_neighbours`; on the CPU one pass over the edges, with no table of differences."""

    @staticmethod
    def forward(context: Any, values: Tensor, graph: Graph) -> Tensor:
        values = values.detach().contiguous()
        distance = torch.empty(len(graph.neighbour), dtype=torch.float32)
        value_distances(graph.first, graph.neighbour, values.numpy(), _SOFTENING, distance.numpy())
        context.graph = graph
        context.save_for_backward(values, distance)
        return distance[:, None]

    @staticmethod
    @once_differentiable
    def backward(context: Any, gradient: Tensor) -> tuple[Tensor, None]:
        values, distance = context.saved_tensors
        to_values = torch.zeros_like(values)
        tables = (values, distance, gradient[:, 0].contiguous(), to_values)
        distances_back(context.graph.first, context.graph.neighbour, *(table.numpy() for table in tables))
        return to_values, None


def distance_of_neighbours(values: Tensor, graph: Graph) -> Tensor:
    """Return how far apart the values of the two ends of each edge are.

    Parameters
    ----------
    values
        Of the nodes (V, C), float32.
    graph
        The nodes and their edges.

    Returns
    -------
    Tensor
        (E, 1), with 1e-12 under the root.
    """
    if values.device.type == "cpu":
        distance: Tensor = _Distances.apply(values, graph)  # type: ignore[no-untyped-call]
        return distance
    return distance_by_gather(values, graph)


def distance_by_gather(values: Tensor, graph: Graph) -> Tensor:
    """Return the same by plain operations of torch, on any device."""
    edges = graph.edges_on(values.device)
    way = values[edges.neighbour] - values[edges.node]
    return torch.sqrt((way * way).sum(dim=1, keepdim=True) + _SOFTENING)


class _MeanMessages(torch.autograd.Function):
    """See :func:`mean_of_neighbours`; on the CPU one pass over the edges, with no table of messages."""

    @staticmethod
    def forward(context: Any, own: Tensor, sent: Tensor, weight: Tensor, graph: Graph, slope: float) -> Tensor:
        own, sent, weight = (value.detach().contiguous() for value in (own, sent, weight))
        mean = torch.empty((graph.n_nodes, sent.shape[1]), dtype=torch.float32)
        arrays = [value.numpy() for value in (own, sent, weight, mean)]
        mean_messages(graph.first, graph.neighbour, *arrays[:2], graph.along, arrays[2], slope, arrays[3])
        context.graph, context.slope = graph, slope
        context.save_for_backward(own, sent, weight)
        return mean

    @staticmethod
    @once_differentiable
    def backward(context: Any, gradient: Tensor) -> tuple[Tensor | None, ...]:
        graph, saved = context.graph, context.saved_tensors
        found = tuple(torch.zeros_like(value) for value in saved)
        own, sent, weight = (value.numpy() for value in saved)
        into = (value.numpy() for value in found)
        table = gradient.contiguous().numpy()
        mean_back(graph.first, graph.neighbour, own, sent, graph.along, weight, context.slope, table, *into)
        return (*found, None, None)


def mean_of_neighbours(own: Tensor, sent: Tensor, weight: Tensor, graph: Graph, slope: float) -> Tensor:
    """Return the mean of the messages that each node gets, each through a leaky rectifier.

    Parameters
    ----------
    own
        What each node adds to the messages that it gets (V, C), float32.
    sent
        What each node sends (V, C).
    weight
        What the values of an edge add to each channel (K, C).
    graph
        The nodes and their edges, with K values each.
    slope
        Of the rectifier below zero.

    Returns
    -------
    Tensor
        (V, C): mean over the edges e from i to j of leaky(own[i] + sent[j] + along[e] weight); 0 for a node without an
        edge.
    """
    if sent.device.type == "cpu":
        mean: Tensor = _MeanMessages.apply(own, sent, weight, graph, slope)  # type: ignore[no-untyped-call]
        return mean
    return mean_by_scatter(own, sent, weight, graph, slope)


def mean_by_scatter(own: Tensor, sent: Tensor, weight: Tensor, graph: Graph, slope: float) -> Tensor:
    """Return the same by plain operations of torch, on any device."""
    edges = graph.edges_on(sent.device)
    messages = own[edges.node] + sent[edges.neighbour] + edges.along @ weight
    total = torch.zeros_like(own).index_add(0, edges.node, torch.nn.functional.leaky_relu(messages, slope))
    count = torch.bincount(edges.node, minlength=graph.n_nodes).clamp(min=1)
    return total / count[:, None]
