"""Graphs of meshes: the fused neighbour kernel against plain torch and brute force, maximal independent sets."""

from itertools import pairwise

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from anisomesh.learn.graphs.graph import coarsen, graph_from_edges  # noqa: E402
from anisomesh.learn.models.messages import (  # noqa: E402
    distances_by_gather,
    max_aggregation,
    max_by_scatter,
    mean_aggregation,
    mean_by_scatter,
    neighbour_distances,
)
from anisomesh.mesh.surface import Surface  # noqa: E402
from anisomesh.shapes.analytic import open_patch, sphere, torus  # noqa: E402


def random_graph(n=40, n_edges=120, values=3, seed=0):
    """Return a graph with nodes that have no edge, and edges that are there twice."""
    rng = np.random.default_rng(seed)
    start, end = rng.integers(0, n // 2, n_edges), rng.integers(0, n, n_edges)
    return graph_from_edges(
        n, start.astype(np.int32), end.astype(np.int32), rng.normal(size=(n_edges, values)).astype(np.float32)
    )


def mesh_graph(surface):
    start, end = np.concatenate([surface.edges, surface.edges[:, ::-1]]).T
    return graph_from_edges(surface.n_points, start, end, np.ones((len(start), 1), dtype=np.float32))


def shaken(surface, seed=0):
    """Return a surface without two edges of the same length."""
    rng = np.random.default_rng(seed)
    return surface.with_points(
        surface.points + rng.normal(0.0, 0.02 * surface.edge_lengths.mean(), surface.points.shape)
    )


@pytest.mark.parametrize("seed", range(3))
def test_largest_messages_match_brute_force(seed):
    graph = random_graph(seed=seed)
    sent, weight = torch.randn(40, 7), torch.randn(3, 7)
    found = max_aggregation(sent, weight, graph)
    for i in range(40):
        edges = range(graph.first[i], graph.first[i + 1])
        messages = [sent[graph.neighbour[e]] + torch.from_numpy(graph.features[e]) @ weight for e in edges]
        wanted = torch.stack(messages).amax(dim=0) if messages else torch.zeros(7)
        torch.testing.assert_close(found[i], wanted)
    torch.testing.assert_close(found, max_by_scatter(sent, weight, graph))


def test_derivatives_of_the_kernel_match_plain_torch():
    graph = random_graph(seed=4)
    sent, weight = torch.randn(40, 7, requires_grad=True), torch.randn(3, 7, requires_grad=True)
    along = torch.randn(graph.features.shape, requires_grad=True)
    towards, inputs = torch.randn(40, 7), (sent, weight, along)
    mine = torch.autograd.grad(max_aggregation(sent, weight, graph, along), inputs, towards)
    theirs = torch.autograd.grad(max_by_scatter(sent, weight, graph, along), inputs, towards)
    for a, b in zip(mine, theirs, strict=True):
        torch.testing.assert_close(a, b)
    assert all(grad.abs().sum() > 0 for grad in mine)


@pytest.mark.parametrize("channels", [1, 6, 64])
def test_distances_of_values_and_their_derivatives_match_plain_torch(channels):
    torch.manual_seed(0)
    graph = random_graph(seed=channels)
    values = torch.randn(40, channels)
    values[graph.neighbour[:1]] = values[graph.node[:1]]  # equal values have no direction
    values.requires_grad_()
    found = neighbour_distances(values, graph)
    for e in range(1, 10):
        ends = values[int(graph.node[e])], values[int(graph.neighbour[e])]
        assert float(found[e].detach()) == pytest.approx(float((ends[0] - ends[1]).norm().detach()), rel=1e-5, abs=2e-6)
    towards = torch.randn(len(found), 1)
    (mine,) = torch.autograd.grad(found, values, towards)
    (theirs,) = torch.autograd.grad(distances_by_gather(values, graph), values, towards)
    torch.testing.assert_close(mine, theirs, rtol=1e-4, atol=1e-5)
    assert mine.abs().sum() > 0.0


@pytest.mark.parametrize("seed", range(3))
def test_mean_messages_and_their_derivatives_match_brute_force_and_plain_torch(seed):
    graph = random_graph(seed=seed)
    own, sent, weight = torch.randn(40, 7), torch.randn(40, 7), torch.randn(3, 7)
    found = mean_aggregation(own, sent, weight, graph, 0.1)
    for i in range(40):
        edges = range(graph.first[i], graph.first[i + 1])
        messages = [own[i] + sent[graph.neighbour[e]] + torch.from_numpy(graph.features[e]) @ weight for e in edges]
        leaky = [torch.where(message > 0.0, message, 0.1 * message) for message in messages]
        torch.testing.assert_close(found[i], torch.stack(leaky).mean(dim=0) if leaky else torch.zeros(7))
    inputs = [value.requires_grad_() for value in (own, sent, weight)]
    towards = torch.randn(40, 7)
    mine = torch.autograd.grad(mean_aggregation(*inputs, graph, 0.1), inputs, towards)
    theirs = torch.autograd.grad(mean_by_scatter(*inputs, graph, 0.1), inputs, towards)
    for a, b in zip(mine, theirs, strict=True):
        torch.testing.assert_close(a, b, rtol=1e-4, atol=1e-5)
        assert a.abs().sum() > 0.0


def test_derivatives_agree_with_differences():
    graph = random_graph(seed=5)
    sent, weight, towards = torch.randn(40, 2), torch.randn(3, 2), torch.randn(40, 2)
    sent.requires_grad_(True)
    (gradient,) = torch.autograd.grad((max_aggregation(sent, weight, graph) * towards).sum(), sent)
    step = 1e-2
    with torch.no_grad():
        for j, c in ((0, 0), (3, 1), (11, 0)):
            ahead, back = sent.clone(), sent.clone()
            ahead[j, c] += step
            back[j, c] -= step
            values = [(max_aggregation(x, weight, graph) * towards).sum() for x in (ahead, back)]
            assert float(gradient[j, c]) == pytest.approx(float(values[0] - values[1]) / (2 * step), abs=2e-2)


@pytest.mark.parametrize(
    "surface", [shaken(sphere(3)), torus(n_major=24, n_minor=12), shaken(open_patch(lambda x, y: x * y, n=9))]
)
def test_coarser_graphs_are_maximal_independent_sets(surface):
    levels = coarsen(mesh_graph(surface), surface.points, 4)
    assert len(levels) == 4
    assert levels[-1].cluster is None
    for level, coarser in pairwise(levels):
        graph, cluster = level.graph, level.cluster
        n = coarser.graph.n_nodes
        assert 0.1 * graph.n_nodes < n < 0.5 * graph.n_nodes
        assert set(cluster.tolist()) == set(range(n))
        ends = cluster[graph.node], cluster[graph.neighbour]
        between = {(a, b) for a, b in zip(*(end.tolist() for end in ends), strict=True) if a != b}
        theirs = set(zip(coarser.graph.node.tolist(), coarser.graph.neighbour.tolist(), strict=True))
        assert between == theirs
        size = np.bincount(cluster)
        for name in range(n):  # one node of each cluster is next to all others of it
            members = np.flatnonzero(cluster == name)
            around = [set(graph.neighbour[graph.first[m] : graph.first[m + 1]].tolist()) | {m} for m in members]
            assert any(set(members.tolist()) <= near for near in around)
        assert size.max() < 40


def test_neither_order_nor_motion_changes_the_coarser_graphs():
    surface = shaken(sphere(3))
    rng = np.random.default_rng(1)
    order = rng.permutation(surface.n_points)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    other = Surface(
        surface.points[order] @ turn.T + 3.0, np.argsort(order)[surface.faces][rng.permutation(surface.n_faces)]
    )
    mine, theirs = (coarsen(mesh_graph(s), s.points, 3) for s in (surface, other))
    for a, b in zip(mine, theirs, strict=True):
        assert a.graph.n_nodes == b.graph.n_nodes
    same = mine[0].cluster[order]
    pairs = set(zip(same.tolist(), theirs[0].cluster.tolist(), strict=True))
    assert len(pairs) == mine[1].graph.n_nodes  # the same clusters under other names
