"""Message passing as differentiable torch functions: compiled kernels on the CPU, torch operations elsewhere."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from anisomesh._kernels.messages import (
    feature_distances,
    feature_distances_gradient,
    max_messages,
    max_messages_gradient,
    mean_messages,
    mean_messages_gradient,
)
from anisomesh.learn.architecture import DISTANCE_SOFTENING
from anisomesh.learn.graphs.graph import Graph


class _MaxMessages(torch.autograd.Function):
    """Kernel of :func:`max_aggregation`: one pass over the edges, without a table of messages."""

    @staticmethod
    def forward(context: Any, sent: Tensor, edge_features: Tensor, weight: Tensor, graph: Graph) -> Tensor:
        sent, edge_features, weight = (value.detach().contiguous() for value in (sent, edge_features, weight))
        maximum = torch.empty((graph.n_nodes, sent.shape[1]), dtype=torch.float32)
        winner = torch.empty(maximum.shape, dtype=torch.int32)
        arrays = (value.numpy() for value in (sent, edge_features, weight, maximum, winner))
        max_messages(graph.first, graph.neighbour, *arrays)
        context.graph = graph
        context.save_for_backward(edge_features, weight, winner)
        context.n_sent = len(sent)
        return maximum

    @staticmethod
    @once_differentiable
    def backward(context: Any, gradient: Tensor) -> tuple[Tensor, Tensor, Tensor, None]:
        edge_features, weight, winner = context.saved_tensors
        to_sent = torch.zeros((context.n_sent, gradient.shape[1]), dtype=torch.float32)
        to_edges, to_weight = torch.zeros_like(edge_features), torch.zeros_like(weight)
        values = (edge_features, weight, winner, gradient.contiguous(), to_sent, to_edges, to_weight)
        max_messages_gradient(context.graph.neighbour, *(value.numpy() for value in values))
        return to_sent, to_edges, to_weight, None


def max_aggregation(sent: Tensor, weight: Tensor, graph: Graph, edge_features: Tensor | None = None) -> Tensor:
    """Return the maximum of the messages from the neighbours of each node, per channel.

    Parameters
    ----------
    sent
        Message of each node (V, C), float32.
    weight
        Linear map of edge features to channels (K, C).
    graph
        The nodes and edges.
    edge_features
        Features of the edges (E, K); the features in the graph if None.

    Returns
    -------
    Tensor
        (V, C): max over the edges e from i to j of sent[j] + edge_features[e] weight; 0 for a node without edges.
    """
    edge_features = graph.edges_on(sent.device).features if edge_features is None else edge_features
    if sent.device.type == "cpu":
        maximum: Tensor = _MaxMessages.apply(sent, edge_features, weight, graph)  # type: ignore[no-untyped-call]
        return maximum
    return max_by_scatter(sent, weight, graph, edge_features)


def max_by_scatter(sent: Tensor, weight: Tensor, graph: Graph, edge_features: Tensor | None = None) -> Tensor:
    """Return :func:`max_aggregation` computed with torch operations, on any device."""
    edges = graph.edges_on(sent.device)
    messages = sent[edges.neighbour] + (edges.features if edge_features is None else edge_features) @ weight
    start = messages.new_full((graph.n_nodes, sent.shape[1]), -torch.inf)
    index = edges.node[:, None].expand_as(messages)
    maximum = start.scatter_reduce(0, index, messages, "amax", include_self=True)
    return torch.where(torch.isinf(maximum), torch.zeros_like(maximum), maximum)


class _Distances(torch.autograd.Function):
    """Kernel of :func:`neighbour_distances`: one pass over the edges, without a table of differences."""

    @staticmethod
    def forward(context: Any, values: Tensor, graph: Graph) -> Tensor:
        values = values.detach().contiguous()
        distance = torch.empty(len(graph.neighbour), dtype=torch.float32)
        feature_distances(graph.first, graph.neighbour, values.numpy(), DISTANCE_SOFTENING, distance.numpy())
        context.graph = graph
        context.save_for_backward(values, distance)
        return distance[:, None]

    @staticmethod
    @once_differentiable
    def backward(context: Any, gradient: Tensor) -> tuple[Tensor, None]:
        values, distance = context.saved_tensors
        to_values = torch.zeros_like(values)
        tables = (values, distance, gradient[:, 0].contiguous(), to_values)
        feature_distances_gradient(context.graph.first, context.graph.neighbour, *(table.numpy() for table in tables))
        return to_values, None


def neighbour_distances(values: Tensor, graph: Graph) -> Tensor:
    """Return the distance (E, 1) between the features (V, C), float32, of the two nodes of each edge.

    It is softened by 1e-12 under the root.
    """
    if values.device.type == "cpu":
        distance: Tensor = _Distances.apply(values, graph)  # type: ignore[no-untyped-call]
        return distance
    return distances_by_gather(values, graph)


def distances_by_gather(values: Tensor, graph: Graph) -> Tensor:
    """Return :func:`neighbour_distances` computed with torch operations, on any device."""
    edges = graph.edges_on(values.device)
    difference = values[edges.neighbour] - values[edges.node]
    return torch.sqrt((difference * difference).sum(dim=1, keepdim=True) + DISTANCE_SOFTENING)


class _MeanMessages(torch.autograd.Function):
    """Kernel of :func:`mean_aggregation`: one pass over the edges, without a table of messages."""

    @staticmethod
    def forward(context: Any, own: Tensor, sent: Tensor, weight: Tensor, graph: Graph, slope: float) -> Tensor:
        own, sent, weight = (value.detach().contiguous() for value in (own, sent, weight))
        mean = torch.empty((graph.n_nodes, sent.shape[1]), dtype=torch.float32)
        arrays = [value.numpy() for value in (own, sent, weight, mean)]
        mean_messages(graph.first, graph.neighbour, *arrays[:2], graph.features, arrays[2], slope, arrays[3])
        context.graph, context.slope = graph, slope
        context.save_for_backward(own, sent, weight)
        return mean

    @staticmethod
    @once_differentiable
    def backward(context: Any, gradient: Tensor) -> tuple[Tensor | None, ...]:
        graph, saved = context.graph, context.saved_tensors
        found = tuple(torch.zeros_like(value) for value in saved)
        own, sent, weight = (value.numpy() for value in saved)
        arrays = (own, sent, graph.features, weight)
        into = (value.numpy() for value in found)
        table = gradient.contiguous().numpy()
        mean_messages_gradient(graph.first, graph.neighbour, *arrays, context.slope, table, *into)
        return (*found, None, None)


def mean_aggregation(own: Tensor, sent: Tensor, weight: Tensor, graph: Graph, slope: float) -> Tensor:
    """Return the mean of the messages to each node, each passed through a leaky rectifier.

    Parameters
    ----------
    own
        Term of the receiving node (V, C), float32.
    sent
        Term of the sending node (V, C).
    weight
        Linear map of edge features to channels (K, C).
    graph
        The nodes and edges, with K features per edge.
    slope
        Slope of the rectifier below zero.

    Returns
    -------
    Tensor
        (V, C): mean over the edges e from i to j of leaky(own[i] + sent[j] + features[e] weight); 0 for a node without
        edges.
    """
    if sent.device.type == "cpu":
        mean: Tensor = _MeanMessages.apply(own, sent, weight, graph, slope)  # type: ignore[no-untyped-call]
        return mean
    return mean_by_scatter(own, sent, weight, graph, slope)


def mean_by_scatter(own: Tensor, sent: Tensor, weight: Tensor, graph: Graph, slope: float) -> Tensor:
    """Return :func:`mean_aggregation` computed with torch operations, on any device."""
    edges = graph.edges_on(sent.device)
    messages = own[edges.node] + sent[edges.neighbour] + edges.features @ weight
    total = torch.zeros_like(own).index_add(0, edges.node, torch.nn.functional.leaky_relu(messages, slope))
    count = torch.bincount(edges.node, minlength=graph.n_nodes).clamp(min=1)
    return total / count[:, None]
