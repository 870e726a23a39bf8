"""What the kernels of the graph hierarchy compute, against NumPy and SciPy on whole arrays."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anisomesh._kernels import graph_hierarchy as kernels
from anisomesh.learn.graphs.graph import graph_from_edges
from anisomesh.mesh.geometry import unit
from anisomesh.metric.tangent import tangent_frames
from anisomesh.shapes.analytic import torus

EMPTY = 0.1  # share of the nodes without an edge


@pytest.fixture
def graph():
    rng = np.random.default_rng(0)
    surface = torus(n_major=20, n_minor=10)
    start, end = np.concatenate([surface.edges, surface.edges[:, ::-1]]).T
    gone = rng.random(surface.n_points) < EMPTY
    kept = ~(gone[start] | gone[end])
    return graph_from_edges(surface.n_points, start[kept], end[kept], np.zeros((int(kept.sum()), 1), dtype=np.float32))


@pytest.fixture
def places(graph):
    rng = np.random.default_rng(1)
    positions, normals = rng.normal(size=(graph.n_nodes, 3)), unit(rng.normal(size=(graph.n_nodes, 3)))
    return positions, normals, tangent_frames(normals)


def doubled(vectors):
    """Return cosine and sine of twice the angle of vectors (n, 2)."""
    number = (vectors[:, 0] + 1j * vectors[:, 1]) ** 2
    number /= np.abs(number)
    return np.stack([number.real, number.imag], axis=1)


def rotations(normals, others):
    """Return the smallest rotations of unit vectors to others."""
    axis = np.cross(normals, others)
    angle = np.arctan2(np.linalg.norm(axis, axis=1), (normals * others).sum(axis=1))
    return Rotation.from_rotvec(unit(axis) * angle[:, None])


def test_edges_are_measured_from_both_ends(graph, places):
    positions, normals, frames = places
    i, j, n = graph.node, graph.neighbour, len(graph.neighbour)
    values, turns = np.empty((n, 4)), np.empty((n, 2, 2))
    ways, ties = np.empty((n, 3), dtype=np.float32), np.empty((n, 2), dtype=np.float32)
    kernels.edge_geometry(graph.first, j, positions, normals, frames, values, turns, ways, ties)
    way = positions[j] - positions[i]
    length = np.linalg.norm(way, axis=1)
    np.testing.assert_allclose(ways, way, rtol=1e-6)
    np.testing.assert_allclose(values[:, 0], length)
    for column, (k, sign) in enumerate(((i, -1), (j, 1)), 1):
        np.testing.assert_allclose(values[:, column], sign * 2 * (normals[k] * way).sum(axis=1) / length**2)
        np.testing.assert_allclose(turns[:, column - 1], doubled((frames[k] @ way[:, :, None])[:, :, 0]), atol=1e-9)
    np.testing.assert_allclose(values[:, 3], np.linalg.norm(normals[j] - normals[i], axis=1) / length)
    carried = rotations(normals[j], normals[i]).apply(frames[j, 0])
    np.testing.assert_allclose(ties, doubled((frames[i] @ carried[:, :, None])[:, :, 0]), atol=1e-5)


def test_frames_are_carried_by_the_smallest_rotation(places):
    _, normals, frames = places
    ancestor = np.random.default_rng(2).integers(0, len(normals), len(normals))
    carry = np.empty((len(normals), 2), dtype=np.float32)
    kernels.transport_to_points(ancestor, frames, normals, frames, normals, carry)
    carried = rotations(normals[ancestor], normals).apply(frames[ancestor, 0])
    np.testing.assert_allclose(carry, doubled((frames @ carried[:, :, None])[:, :, 0]), atol=1e-5)


def test_fit_is_the_one_of_ridge_regression(graph):
    rng = np.random.default_rng(3)
    angle, bend = rng.uniform(0, np.pi, len(graph.neighbour)), rng.normal(size=len(graph.neighbour))
    turns = np.stack([np.cos(2 * angle), np.sin(2 * angle)], axis=1)
    duals, fit, imbalance = np.empty((len(bend), 3)), np.empty((graph.n_nodes, 3)), np.empty(graph.n_nodes)
    kernels.fit_normal_curvature(graph.first, np.stack([turns, 9 * turns], axis=1), bend, 0.02, duals, fit, imbalance)
    for i in range(graph.n_nodes):
        rows = slice(graph.first[i], graph.first[i + 1])
        basis, n = np.concatenate([np.ones((rows.stop - rows.start, 1)), turns[rows]], axis=1), rows.stop - rows.start
        if n == 0:
            assert not fit[i].any()
            assert imbalance[i] == 0.0
            continue
        solution = np.linalg.solve(basis.T @ basis + 0.02 * n * np.eye(3), basis.T)
        np.testing.assert_allclose(duals[rows], solution.T, atol=1e-9)
        np.testing.assert_allclose(fit[i], solution @ bend[rows], atol=1e-9)
        np.testing.assert_allclose(imbalance[i], np.linalg.norm(turns[rows].mean(axis=0)))


def test_edge_features_match_whole_array_formulas(graph):
    rng = np.random.default_rng(6)
    n, i, j = len(graph.neighbour), graph.node, graph.neighbour
    values, turns, duals = rng.uniform(0.5, 2.0, (n, 4)), rng.normal(size=(n, 2, 2)), rng.normal(size=(n, 3))
    line, mean_length = rng.normal(size=(graph.n_nodes, 2)), rng.uniform(0.5, 2.0, graph.n_nodes)
    along = np.empty((n, 7), dtype=np.float32)
    kernels.edge_features(graph.first, j, values, turns, line, duals, mean_length, along)
    wanted = [np.log(values[:, 0] / mean_length[i]), *values[:, 1:].T, (line[i] * turns[:, 0]).sum(axis=1)]
    wanted += [(line[j] * turns[:, 1]).sum(axis=1), duals[:, 0] * np.diff(graph.first)[i]]
    np.testing.assert_allclose(along, np.stack(wanted, axis=1), rtol=1e-5, atol=1e-6)


def test_spread_is_that_of_numpy(graph):
    values = np.random.default_rng(4).normal(size=(len(graph.neighbour), 2))
    spread = np.empty((graph.n_nodes, 2, 4))
    kernels.edge_statistics(graph.first, values, spread)
    for i in range(graph.n_nodes):
        mine = values[graph.first[i] : graph.first[i + 1]]
        wanted = (
            [mine.max(axis=0), mine.min(axis=0), mine.mean(axis=0), mine.std(axis=0)] if len(mine) else [[0, 0]] * 4
        )
        np.testing.assert_allclose(spread[i], np.transpose(wanted))


def test_the_independent_set_is_the_greedy_one(graph):
    n = graph.n_nodes
    order = np.random.default_rng(5).permutation(n)
    state, owner = np.zeros(n, dtype=np.int8), np.zeros(n, dtype=np.int64)
    kernels.maximal_independent_set(graph.first, graph.neighbour, order, state, owner)
    around = [set(graph.neighbour[graph.first[i] : graph.first[i + 1]].tolist()) for i in range(n)]
    taken = []
    for i in order.tolist():
        if not around[i] & set(taken):
            taken.append(i)
    assert sorted(taken) == np.flatnonzero(state == kernels.IN_SET).tolist()
    for i in range(n):
        first = next(other for other in taken if other == i or other in around[i])
        assert sorted(taken)[owner[i]] == first
