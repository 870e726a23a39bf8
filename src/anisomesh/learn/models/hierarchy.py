"""What the network sees of a mesh: graphs of several scales with numbers that no motion of the mesh changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._kernels.pyramid import carry_to_points, edge_geometry, edge_invariants, fit_directions, spread_at_nodes
from anisomesh.learn.models.graph import Graph, Level, graph_of, hierarchy
from anisomesh.mesh.geometry import sums_at_points, unit
from anisomesh.mesh.surface import Surface
from anisomesh.metric.tangent import or_z_axis, tangent_frames

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
        _scale(level, _heights(levels, places, k), places[k], ancestors[k], places[0], frames)
        for k, level in enumerate(levels)
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
    return _Places(mean[:, :3], or_z_axis(unit(mean[:, 3:])), np.linalg.norm(mean[:, 3:], axis=1))


def _heights(levels: list[Level], places: list[_Places], k: int) -> Doubles:
    """Return how high the nodes of a graph (V,) are over those of the next two that they belong to (V, 2)."""
    height = np.zeros((levels[k].graph.n_nodes, 2))
    owner = np.arange(len(height))
    for column, coarse in enumerate(range(k + 1, min(k + 3, len(levels)))):
        owner = np.asarray(levels[coarse - 1].cluster)[owner]
        away = places[k].positions - places[coarse].positions[owner]
        height[:, column] = np.einsum("vx,vx->v", places[coarse].normals[owner], away)
    return height


def _scale(level: Level, heights: Doubles, place: _Places, ancestor: Ints, points: _Places, frames: Doubles) -> Scale:
    """Return what is known of a graph whose nodes are at these places and heights (V, 2)."""
    first, neighbour = level.graph.first, level.graph.neighbour
    n, n_edges = level.graph.n_nodes, len(neighbour)
    own_frames = tangent_frames(place.normals)
    values, turns = np.empty((n_edges, 4)), np.empty((n_edges, 2, 2))
    ways, ties = np.empty((n_edges, 3), dtype=np.float32), np.empty((n_edges, 2), dtype=np.float32)
    edge_geometry(first, neighbour, place.positions, place.normals, own_frames, values, turns, ways, ties)
    duals, fit, imbalance = np.empty((n_edges, 3)), np.empty((n, 3)), np.empty(n)
    fit_directions(first, turns, values[:, 1], _HELD, duals, fit, imbalance)
    half = np.linalg.norm(fit[:, 1:], axis=1)
    line = fit[:, 1:] / (half + _ROUND_SHARE * np.abs(fit[:, 0]) + _FLAT)[:, None]  # fades where there is no direction
    values[:, 1:] = np.arcsinh(values[:, 1:])
    spread, along = np.empty((n, 4, 4)), np.empty((n_edges, N_EDGE), dtype=np.float32)
    spread_at_nodes(first, values, spread)
    mean_length = spread[:, 0, 2]
    edge_invariants(first, neighbour, values, turns, line, duals, mean_length, along)
    mean_length = np.maximum(mean_length, 1e-6)
    columns = [*spread[:, 1].T, *spread[:, 3, ::2].T, np.log(mean_length), place.agreement]
    columns += [*(_HEIGHT * heights / mean_length[:, None]).T, np.arcsinh(fit[:, 0]), np.arcsinh(half)]
    columns += [_TURNS * imbalance]
    carry = np.empty((len(ancestor), 2), dtype=np.float32)
    carry_to_points(ancestor, own_frames, place.normals, frames, points.normals, carry)
    count = np.diff(first)[level.graph.node]
    return Scale(
        graph=Graph(first=first, neighbour=neighbour, along=along),
        nodes=np.stack(columns, axis=1).astype(np.float32),
        fit=((np.arcsinh(half) / np.maximum(half, 1e-30))[:, None] * fit[:, 1:]).astype(np.float32),
        ways=ways,
        turns=turns[:, 0].astype(np.float32),
        duals=(duals[:, 1:] * count[:, None]).astype(np.float32),
        ties=ties,
        cluster=level.cluster,
        ancestor=ancestor,
        carry=carry,
    )
