"""Input of the default network: a hierarchy of graphs with features that no rigid motion of the mesh changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._kernels.graph_hierarchy import (
    edge_features,
    edge_geometry,
    edge_statistics,
    fit_normal_curvature,
    transport_to_points,
)
from anisomesh.learn.graphs.graph import CoarseningLevel, Graph, coarsen, mesh_graph
from anisomesh.mesh.geometry import sums_at_points, unit
from anisomesh.mesh.surface import Surface
from anisomesh.metric.tangent import replace_zero_normals, tangent_frames

N_NODE_FEATURES, N_EDGE_FEATURES = 13, 7
"""Numbers of input features of a node and of an edge."""

N_NORMAL_LEVELS = 3
"""Number of levels, from the finest, whose normals may contribute to the offset of a point."""

_LOG_LENGTH_COLUMN = 6  # node feature that is the logarithm of the mean length of the edges
_IMBALANCE_SCALE = 3.0  # feature scale, heuristic: brings the imbalance of directions to the order of 1
_HEIGHT_SCALE = 3.0  # feature scale, heuristic: brings heights over coarser nodes to the order of 1
_UMBILIC_SHARE = 0.1  # of the mean curvature: a difference of principal curvatures below it fades out (heuristic)
_FLAT_CURVATURE = 0.3  # at bounding-box diagonal 1: principal curvatures below it have no direction (heuristic)
_RIDGE_SHARE = 0.02  # regularisation of the curvature fit, over the number of edges (heuristic)

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]
Longs = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class HierarchyLevel:
    """A graph of V nodes and E edges with its features; all directions and rotations are at twice their angle.

    Attributes
    ----------
    graph
        The nodes and edges; the features of an edge are ``N_EDGE_FEATURES`` invariants.
    nodes
        Features of the nodes (V, N_NODE_FEATURES).
    curvature_line
        Fitted line of curvature of each node (V, 2); its length is arcsinh of half the difference of the principal
        curvatures.
    vectors
        Vector along each edge (E, 3).
    directions
        Direction of each edge in the tangent frame of its node, as cosine and sine (E, 2).
    fit_weights
        Weight of each edge in the least squares fit of a line to values of the edges of its node, times their number
        (E, 2).
    transport
        Rotation from the tangent frame of the neighbour to the frame of the node of each edge (E, 2).
    cluster
        Node of the next coarser level that each node belongs to (V,), None on the coarsest.
    ancestor
        Node of this level that each point of the mesh belongs to (N,).
    point_transport
        Rotation from the frame of that node to the frame of the point, as cosine and sine (N, 2).
    """

    graph: Graph
    nodes: Floats
    curvature_line: Floats
    vectors: Floats
    directions: Floats
    fit_weights: Floats
    transport: Floats
    cluster: Longs | None
    ancestor: Longs
    point_transport: Floats


@dataclass(frozen=True, eq=False)
class GraphHierarchy:
    """Levels of a mesh of N points from fine to coarse, and the frames and normals that turn with it.

    Attributes
    ----------
    levels
        The levels; the nodes of the first are the points.
    frames
        Tangent frames of the points (N, 2, 3).
    normals
        Unit normals of the ancestors of each point on the first levels, times the mean length of the edges at the point
        (N, N_NORMAL_LEVELS, 3).
    """

    levels: list[HierarchyLevel]
    frames: Doubles
    normals: Floats


@dataclass(frozen=True, eq=False)
class _Nodes:
    """Mean positions (V, 3), unit normals (V, 3) and lengths of the mean normals (V,), 1 where all normals agree."""

    positions: Doubles
    normals: Doubles
    agreement: Doubles


def graph_hierarchy(surface: Surface, n_levels: int) -> GraphHierarchy:
    """Return the hierarchy of graphs of a surface at bounding-box diagonal 1.

    Notes
    -----
    A node of a coarser level has the mean position and normal of its points, which noise moves less the more there are.
    Features of an edge: its length, the normal curvature along it at both ends, 2 n (p - q) / |p - q|^2, the change of
    the normal along it, its angle with the line of curvature at both ends, and its weight in the fitted mean curvature.
    Features of a node: maximum, minimum, mean and deviation of the curvature along its edges, change of the normals,
    mean length of the edges, agreement of the normals of its points, height over its ancestors on the next two levels
    in edge lengths, the fitted curvatures, and how unevenly the directions of its edges are spread. Curvatures are
    compressed by arcsinh, lengths by the logarithm. The z axis replaces the normal of a point that has none.
    """
    levels = coarsen(mesh_graph(surface), surface.points, n_levels)
    ancestors = [np.arange(surface.n_points)]
    for level in levels[:-1]:
        ancestors.append(np.asarray(level.cluster)[ancestors[-1]])
    sums = _weighted_points(surface)
    nodes = [_mean_nodes(sums, owner, level.graph.n_nodes) for owner, level in zip(ancestors, levels, strict=True)]
    frames = tangent_frames(nodes[0].normals)
    found = [
        _hierarchy_level(level, _heights(levels, nodes, k), nodes[k], ancestors[k], nodes[0].normals, frames)
        for k, level in enumerate(levels)
    ]
    length = np.exp(found[0].nodes[:, _LOG_LENGTH_COLUMN].astype(np.float64))
    near = [min(k, len(levels) - 1) for k in range(N_NORMAL_LEVELS)]
    normals = np.stack([nodes[k].normals[ancestors[k]] for k in near], axis=1) * length[:, None, None]
    return GraphHierarchy(levels=found, frames=frames, normals=normals.astype(np.float32))


def _weighted_points(surface: Surface) -> Doubles:
    """Return positions, normals and ones (N, 7), times the area of the faces at each point, which is positive."""
    n = surface.n_points
    weight = sums_at_points(surface.face_areas, surface.faces, n)
    weight = np.maximum(weight, 1e-12 * max(float(weight.max()), 1e-30))
    values = np.concatenate([surface.points, surface.point_normals, np.ones((n, 1))], axis=1)
    return np.asarray(weight[:, None] * values, dtype=np.float64)


def _mean_nodes(sums: Doubles, ancestor: Longs, n_nodes: int) -> _Nodes:
    """Return the means at nodes of weighted positions, normals and weights of points (N, 7)."""
    columns = [np.bincount(ancestor, column, minlength=n_nodes) for column in sums.T]
    total = np.stack(columns, axis=1).astype(np.float64)
    mean = total[:, :6] / total[:, 6:]
    return _Nodes(mean[:, :3], replace_zero_normals(unit(mean[:, 3:])), np.linalg.norm(mean[:, 3:], axis=1))


def _heights(levels: list[CoarseningLevel], nodes: list[_Nodes], k: int) -> Doubles:
    """Return the heights of the nodes of level k over their ancestors on the next two levels (V, 2)."""
    height = np.zeros((levels[k].graph.n_nodes, 2))
    owner = np.arange(len(height))
    for column, coarse in enumerate(range(k + 1, min(k + 3, len(levels)))):
        owner = np.asarray(levels[coarse - 1].cluster)[owner]
        away = nodes[k].positions - nodes[coarse].positions[owner]
        height[:, column] = np.einsum("vx,vx->v", nodes[coarse].normals[owner], away)
    return height


def _hierarchy_level(
    level: CoarseningLevel, heights: Doubles, nodes: _Nodes, ancestor: Longs, normals: Doubles, frames: Doubles
) -> HierarchyLevel:
    """Return a level with its features, for nodes at heights (V, 2) and points with normals and tangent frames."""
    first, neighbour = level.graph.first, level.graph.neighbour
    n, n_edges = level.graph.n_nodes, len(neighbour)
    own_frames = tangent_frames(nodes.normals)
    values, directions = np.empty((n_edges, 4)), np.empty((n_edges, 2, 2))
    vectors, transport = np.empty((n_edges, 3), dtype=np.float32), np.empty((n_edges, 2), dtype=np.float32)
    edge_geometry(first, neighbour, nodes.positions, nodes.normals, own_frames, values, directions, vectors, transport)
    fit_weights, fit, imbalance = np.empty((n_edges, 3)), np.empty((n, 3)), np.empty(n)
    fit_normal_curvature(first, directions, values[:, 1], _RIDGE_SHARE, fit_weights, fit, imbalance)
    half = np.linalg.norm(fit[:, 1:], axis=1)
    line = fit[:, 1:] / (half + _UMBILIC_SHARE * np.abs(fit[:, 0]) + _FLAT_CURVATURE)[:, None]
    values[:, 1:] = np.arcsinh(values[:, 1:])
    statistics, features = np.empty((n, 4, 4)), np.empty((n_edges, N_EDGE_FEATURES), dtype=np.float32)
    edge_statistics(first, values, statistics)
    length = statistics[:, 0, 2]
    edge_features(first, neighbour, values, directions, line, fit_weights, length, features)
    length = np.maximum(length, 1e-6)
    columns = [*statistics[:, 1].T, *statistics[:, 3, ::2].T, np.log(length), nodes.agreement]
    columns += [*(_HEIGHT_SCALE * heights / length[:, None]).T, np.arcsinh(fit[:, 0]), np.arcsinh(half)]
    columns += [_IMBALANCE_SCALE * imbalance]
    point_transport = np.empty((len(ancestor), 2), dtype=np.float32)
    transport_to_points(ancestor, own_frames, nodes.normals, frames, normals, point_transport)
    count = np.diff(first)[level.graph.node]
    return HierarchyLevel(
        graph=Graph(first=first, neighbour=neighbour, features=features),
        nodes=np.stack(columns, axis=1).astype(np.float32),
        curvature_line=((np.arcsinh(half) / np.maximum(half, 1e-30))[:, None] * fit[:, 1:]).astype(np.float32),
        vectors=vectors,
        directions=directions[:, 0].astype(np.float32),
        fit_weights=(fit_weights[:, 1:] * count[:, None]).astype(np.float32),
        transport=transport,
        cluster=level.cluster,
        ancestor=ancestor,
        point_transport=point_transport,
    )
