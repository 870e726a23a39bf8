"""What the network sees of a mesh: graphs of several scales with numbers that no motion of the mesh changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh.learn.graph import Graph, graph_of, hierarchy
from anisomesh.metric.tangent import tangent_frames
from anisomesh.surface.geometry import unit
from anisomesh.surface.mesh import Surface

N_NODE, N_EDGE = 8, 4
"""Numbers of values of a node and of an edge."""

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
    turns
        Direction of each edge in the tangent frame of its node, at twice its angle, as cosine and sine (E, 2).
    cluster
        Node of the next coarser graph that each belongs to (V,), None on the coarsest.
    ancestor
        Node of this graph that each point of the mesh belongs to (N,).
    carry
        Rotation from the frame of that node to the frame of the point, at twice its angle, as cosine and sine (N, 2).
    """

    graph: Graph
    nodes: Floats
    turns: Floats
    cluster: Ints | None
    ancestor: Ints
    carry: Floats


@dataclass(frozen=True, eq=False)
class Pyramid:
    """Scales of a mesh from fine to coarse, and the tangent frames of its points (N, 2, 3)."""

    scales: list[Scale]
    frames: Doubles


def pyramid(surface: Surface, n_scales: int) -> Pyramid:
    """Return what the network sees of a surface at bounding-box diagonal 1.

    Notes
    -----
    The nodes of a coarser graph have the mean of the positions and normals of the points that belong to them, which
    noise moves less the more there are. Of an edge the network sees its length, the normal curvature along it,
    2 n (p - q) / |p - q|^2, at both ends, and how much the normals turn along it; of a node the largest, smallest and
    mean curvature along its edges, their spread, the turn of the normals, the length of the edges, and how much the
    normals within it agree. Curvatures are compressed by arcsinh, lengths by the logarithm. A point without a normal
    has that of the z axis.
    """
    n = surface.n_points
    start, end = np.concatenate([surface.edges, surface.edges[:, ::-1]]).T
    base = graph_of(n, start, end, np.zeros((len(start), 1), dtype=np.float32))
    weight = np.bincount(surface.faces.ravel(), np.repeat(surface.face_areas, 3), minlength=n)
    weight = np.maximum(weight, 1e-12 * max(float(weight.max()), 1e-30))
    sums = np.concatenate([surface.points, surface.point_normals, np.ones((n, 1))], axis=1) * weight[:, None]
    ancestor = np.arange(n)
    frames = tangent_frames(_some_normals(surface.point_normals))
    scales = []
    for level in hierarchy(base, surface.points, n_scales):
        total = np.stack([np.bincount(ancestor, column, minlength=level.graph.n_nodes) for column in sums.T], axis=1)
        mean = total[:, :6] / total[:, 6:]
        scales.append(_scale(level.graph, mean, level.cluster, ancestor, frames))
        ancestor = level.cluster[ancestor] if level.cluster is not None else ancestor
    return Pyramid(scales=scales, frames=frames)


def _some_normals(sums: Doubles) -> Doubles:
    """Return unit normals (n, 3) along sums of normals, the z axis where these vanish."""
    normals = unit(sums)
    normals[~normals.any(axis=1)] = (0.0, 0.0, 1.0)
    return normals


def _scale(graph: Graph, mean: Doubles, cluster: Ints | None, ancestor: Ints, fine_frames: Doubles) -> Scale:
    """Return what is known of a graph whose nodes have these mean positions and normals (V, 6)."""
    positions, normals, agreement = mean[:, :3], _some_normals(mean[:, 3:]), np.linalg.norm(mean[:, 3:], axis=1)
    frames = tangent_frames(normals)
    i, j = graph.node, graph.neighbour
    way = positions[j] - positions[i]
    square = np.maximum((way**2).sum(axis=1), 1e-30)
    length = np.sqrt(square)
    bend = [np.arcsinh(sign * 2.0 * np.einsum("ex,ex->e", normals[k], way) / square) for k, sign in ((i, -1), (j, 1))]
    turn = np.arcsinh(np.linalg.norm(normals[j] - normals[i], axis=1) / length)
    n = graph.n_nodes
    count = np.maximum(np.diff(graph.first), 1)
    mean_length = np.bincount(i, length, minlength=n) / count
    along = np.stack([np.log(length / mean_length[i]), *bend, turn], axis=1).astype(np.float32)
    mean_bend = np.bincount(i, bend[0], minlength=n) / count
    spread = np.sqrt(np.maximum(np.bincount(i, bend[0] ** 2, minlength=n) / count - mean_bend**2, 0.0))
    some = np.flatnonzero(np.diff(graph.first))
    largest, smallest, most_turn = np.zeros((3, n))
    if len(some):
        begin = graph.first[some]
        largest[some], smallest[some] = np.maximum.reduceat(bend[0], begin), np.minimum.reduceat(bend[0], begin)
        most_turn[some] = np.maximum.reduceat(turn, begin)
    mean_turn = np.bincount(i, turn, minlength=n) / count
    scale = np.log(np.maximum(mean_length, 1e-6))
    nodes = np.stack([largest, smallest, mean_bend, spread, most_turn, mean_turn, scale, agreement], axis=1)
    return Scale(
        graph=Graph(first=graph.first, neighbour=graph.neighbour, along=np.ascontiguousarray(along)),
        nodes=nodes.astype(np.float32),
        turns=_double_angle(np.einsum("ekx,ex->ek", frames[i], way)),
        cluster=cluster,
        ancestor=ancestor,
        carry=_carry(frames[ancestor], fine_frames),
    )


def _double_angle(plane: Doubles) -> Floats:
    """Return cosine and sine of twice the angle of vectors (n, 2), zeros for those without length."""
    x, y = plane.T
    square = np.maximum(x * x + y * y, 1e-30)
    return np.stack([(x * x - y * y) / square, 2.0 * x * y / square], axis=1).astype(np.float32)


def _carry(source: Doubles, target: Doubles) -> Floats:
    """Return the rotation from frames to others (n, 2, 3), by the smallest rotation of one normal to the other."""
    from_normal, to_normal = (np.cross(frame[:, 0], frame[:, 1]) for frame in (source, target))
    cosine = np.einsum("nx,nx->n", from_normal, to_normal)
    carried = source[:, 0]
    lift = np.einsum("nx,nx->n", carried, to_normal) / np.maximum(1.0 + cosine, 1e-9)
    carried = carried - lift[:, None] * (from_normal + to_normal)
    return _double_angle(np.einsum("nx,nkx->nk", carried, target))
