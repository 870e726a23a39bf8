"""What the network sees of a mesh: graphs of several scales with numbers that no motion of the mesh changes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh.learn.graph import Graph, Level, graph_of, hierarchy
from anisomesh.metric.tangent import tangent_frames
from anisomesh.surface.geometry import sums_at_points, unit
from anisomesh.surface.mesh import Surface

N_NODE, N_EDGE = 13, 7
"""Numbers of values of a node and of an edge."""

N_NORMALS = 3
"""Number of graphs whose normals a point may be moved along."""

_LENGTH = 6  # column of the logarithm of the length of the edges
_TURNS = 3.0  # brings the imbalance of directions to the size of the other values
_ROUND_SHARE, _FLAT = 0.1, 0.3  # of the mean curvature, and curvature: differences below them give no direction
_HELD = 0.02  # of the number of edges: what is added to the squares of a fit
_HEIGHT = 3.0  # brings heights to the size of the other values

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Scale:
    """A graph of V nodes and E edges, and what is known at them.

    Attributes
    ----------
    graph
        The nodes and edges; the values of an edge are ``N_EDGE`` invariants.
    nodes
        Invariants of the nodes (V, N_NODE).
    fit
        Line of curvature that fits the edges of each node, at twice its angle, half the difference of the principal
        curvatures long, by arcsinh (V, 2).
    ways
        Vector along each edge (E, 3).
    turns
        Direction of each edge in the tangent frame of its node, at twice its angle, as cosine and sine (E, 2).
    duals
        What each edge adds to a line that fits values of the edges of its node, for each of these values, times the
        number of edges (E, 2).
    ties
        Rotation from the tangent frame at the other end of each edge to that of its node, at twice its angle (E, 2).
    cluster
        Node of the next coarser graph that each belongs to (V,), None on the coarsest.
    ancestor
        Node of this graph that each point of the mesh belongs to (N,).
    carry
        Rotation from the frame of that node to the frame of the point, at twice its angle, as cosine and sine (N, 2).
    """

    graph: Graph
    nodes: Floats
    fit: Floats
    ways: Floats
    turns: Floats
    duals: Floats
    ties: Floats
    cluster: Ints | None
    ancestor: Ints
    carry: Floats


@dataclass(frozen=True, eq=False)
class Pyramid:
    """Scales of a mesh from fine to coarse, and what turns with it at its points.

    Attributes
    ----------
    scales
        The graphs.
    frames
        Tangent frames of the points (N, 2, 3).
    normals
        Unit normals of the nodes that a point belongs to in the first graphs, times the mean length of the edges at the
        point (N, N_NORMALS, 3).
    """

    scales: list[Scale]
    frames: Doubles
    normals: Floats


def pyramid(surface: Surface, n_scales: int) -> Pyramid:
    """Return what the network sees of a surface at bounding-box diagonal 1.

    Notes
    -----
    The nodes of a coarser graph have the mean of the positions and normals of the points that belong to them, which
    noise moves less the more there are. Of an edge the network sees its length, the normal curvature along it,
    2 n (p - q) / |p - q|^2, at both ends, how much the normals turn along it, its angle with the line of curvature at
    both ends, and its weight in a mean over directions; of a node the largest, smallest and mean curvature along its
    edges, their spread, the turn of the normals, the length of the edges, how much the normals within it agree, its
    height over the nodes that it belongs to in the next two graphs, in lengths of its edges, the curvatures that fit
    its edges, and how unevenly their directions are spread. Curvatures are compressed by arcsinh, lengths by the
    logarithm. A point without a normal has that of the z axis.
    """
    n = surface.n_points
    start, end = np.concatenate([surface.edges, surface.edges[:, ::-1]]).T
    base = graph_of(n, start, end, np.zeros((len(start), 1), dtype=np.float32))
    weight = sums_at_points(surface.face_areas, surface.faces, n)
    weight = np.maximum(weight, 1e-12 * max(float(weight.max()), 1e-30))
    values = np.concatenate([surface.points, surface.point_normals, np.ones((n, 1))], axis=1)
    sums = np.asarray(weight[:, None] * values, dtype=np.float64)
    levels = hierarchy(base, surface.points, n_scales)
    ancestors = [np.arange(n)]
    for level in levels[:-1]:
        ancestors.append(np.asarray(level.cluster)[ancestors[-1]])
    places = [
        _mean_place(sums, ancestor, level.graph.n_nodes) for ancestor, level in zip(ancestors, levels, strict=True)
    ]
    frames = tangent_frames(places[0].normals)
    scales = [
        _scale(level, _heights(levels, places, k), places[k], ancestors[k], frames) for k, level in enumerate(levels)
    ]
    length = np.exp(scales[0].nodes[:, _LENGTH].astype(np.float64))
    near = [min(k, len(levels) - 1) for k in range(N_NORMALS)]
    normals = np.stack([places[k].normals[ancestors[k]] for k in near], axis=1) * length[:, None, None]
    return Pyramid(scales=scales, frames=frames, normals=normals.astype(np.float32))


@dataclass(frozen=True, eq=False)
class _Places:
    """Mean positions of nodes (V, 3), unit normals (V, 3), and lengths of the mean normals (V,), 1 where all agree."""

    positions: Doubles
    normals: Doubles
    agreement: Doubles


def _mean_place(sums: Doubles, ancestor: Ints, n_nodes: int) -> _Places:
    """Return the places of nodes from weighted positions, normals and weights of points (N, 7)."""
    columns = [np.bincount(ancestor, column, minlength=n_nodes) for column in sums.T]
    total = np.stack(columns, axis=1).astype(np.float64)
    mean = total[:, :6] / total[:, 6:]
    return _Places(mean[:, :3], _some_normals(mean[:, 3:]), np.linalg.norm(mean[:, 3:], axis=1))


def _heights(levels: list[Level], places: list[_Places], k: int) -> Doubles:
    """Return how high the nodes of a graph (V,) are over those of the next two that they belong to (V, 2)."""
    height = np.zeros((levels[k].graph.n_nodes, 2))
    owner = np.arange(len(height))
    for column, coarse in enumerate(range(k + 1, min(k + 3, len(levels)))):
        owner = np.asarray(levels[coarse - 1].cluster)[owner]
        away = places[k].positions - places[coarse].positions[owner]
        height[:, column] = np.einsum("vx,vx->v", places[coarse].normals[owner], away)
    return height


def _some_normals(sums: Doubles) -> Doubles:
    """Return unit normals (n, 3) along sums of normals, the z axis where these vanish."""
    normals = unit(sums)
    normals[~normals.any(axis=1)] = (0.0, 0.0, 1.0)
    return normals


def _scale(level: Level, heights: Doubles, place: _Places, ancestor: Ints, fine_frames: Doubles) -> Scale:
    """Return what is known of a graph whose nodes are at these places and heights (V, 2)."""
    graph, positions, normals = level.graph, place.positions, place.normals
    frames = tangent_frames(normals)
    i, j = graph.node, graph.neighbour
    way = positions[j] - positions[i]
    square = np.maximum((way**2).sum(axis=1), 1e-30)
    length = np.sqrt(square)
    bend = [sign * 2.0 * np.einsum("ex,ex->e", normals[k], way) / square for k, sign in ((i, -1), (j, 1))]
    turn = np.arcsinh(np.linalg.norm(normals[j] - normals[i], axis=1) / length)
    turns, turns_there = (_double_angle(np.einsum("ekx,ex->ek", frames[k], way)) for k in (i, j))
    duals = _dual_directions(graph, turns)
    fit = _node_sums(graph, duals * bend[0][:, None])  # mean curvature, and half the difference as a line
    half = np.linalg.norm(fit[:, 1:], axis=1)
    line = fit[:, 1:] / (half + _ROUND_SHARE * np.abs(fit[:, 0]) + _FLAT)[:, None]  # fades where there is no direction
    across = [np.einsum("ek,ek->e", line[k], seen) for k, seen in ((i, turns), (j, turns_there))]
    count = np.maximum(np.diff(graph.first), 1)
    mean_length = _node_sums(graph, length) / count
    small_bend = [np.arcsinh(values) for values in bend]
    along = np.stack([np.log(length / mean_length[i]), *small_bend, turn, *across, duals[:, 0] * count[i]], axis=1)
    mean_length = np.maximum(mean_length, 1e-6)
    columns = [*_spread(graph, small_bend[0]), *_spread(graph, turn)[::2], np.log(mean_length), place.agreement]
    columns += [*(_HEIGHT * heights / mean_length[:, None]).T, np.arcsinh(fit[:, 0]), np.arcsinh(half)]
    columns += [_TURNS * np.linalg.norm(_node_sums(graph, turns), axis=1) / count]
    return Scale(
        graph=Graph(first=graph.first, neighbour=graph.neighbour, along=along.astype(np.float32)),
        nodes=np.stack(columns, axis=1).astype(np.float32),
        fit=((np.arcsinh(half) / np.maximum(half, 1e-30))[:, None] * fit[:, 1:]).astype(np.float32),
        ways=way.astype(np.float32),
        turns=turns.astype(np.float32),
        duals=(duals[:, 1:] * count[i, None]).astype(np.float32),
        ties=_carry(frames[j], frames[i]).astype(np.float32),
        cluster=level.cluster,
        ancestor=ancestor,
        carry=_carry(frames[ancestor], fine_frames).astype(np.float32),
    )


def _dual_directions(graph: Graph, turns: Doubles) -> Doubles:
    """Return weights (E, 3) whose sum with values of the edges of a node is their fit a + b cos 2t + c sin 2t.

    The least squares fit over the directions t of the edges (E, 2), held back a little where these do not decide it.
    """
    basis = np.concatenate([np.ones((len(turns), 1)), turns], axis=1)
    products = _node_sums(graph, (basis[:, :, None] * basis[:, None, :]).reshape(-1, 9)).reshape(-1, 3, 3)
    count = np.maximum(np.diff(graph.first), 1)
    inverse = np.linalg.inv(products + (_HELD * count)[:, None, None] * np.eye(3))
    return np.asarray(np.einsum("eab,eb->ea", inverse[graph.node], basis))


def _node_sums(graph: Graph, values: Doubles) -> Doubles:
    """Return the sums of values (E,) or (E, K) over the edges of each node."""
    flat = values.reshape(len(values), math.prod(values.shape[1:]))
    sums = np.stack([np.bincount(graph.node, column, minlength=graph.n_nodes) for column in flat.T], axis=1)
    return np.asarray(sums.reshape(graph.n_nodes, *values.shape[1:]), dtype=np.float64)


def _spread(graph: Graph, values: Doubles) -> tuple[Doubles, Doubles, Doubles, Doubles]:
    """Return largest, smallest, mean and deviation (V,) of values (E,) over the edges of each node, 0 without any."""
    count = np.maximum(np.diff(graph.first), 1)
    mean = _node_sums(graph, values) / count
    deviation = np.sqrt(np.maximum(_node_sums(graph, values**2) / count - mean**2, 0.0))
    largest, smallest = np.zeros((2, graph.n_nodes))
    some = np.flatnonzero(np.diff(graph.first))
    if len(some):
        begin = graph.first[some]
        largest[some], smallest[some] = np.maximum.reduceat(values, begin), np.minimum.reduceat(values, begin)
    return largest, smallest, mean, deviation


def _double_angle(plane: Doubles) -> Doubles:
    """Return cosine and sine of twice the angle of vectors (n, 2), zeros for those without length."""
    x, y = plane.T
    square = np.maximum(x * x + y * y, 1e-30)
    return np.stack([(x * x - y * y) / square, 2.0 * x * y / square], axis=1)


def _carry(source: Doubles, target: Doubles) -> Doubles:
    """Return the rotation from frames to others (n, 2, 3), by the smallest rotation of one normal to the other."""
    from_normal, to_normal = (np.cross(frame[:, 0], frame[:, 1]) for frame in (source, target))
    cosine = np.einsum("nx,nx->n", from_normal, to_normal)
    carried = source[:, 0]
    lift = np.einsum("nx,nx->n", carried, to_normal) / np.maximum(1.0 + cosine, 1e-9)
    carried = carried - lift[:, None] * (from_normal + to_normal)
    return _double_angle(np.einsum("nx,nkx->nk", carried, target))
