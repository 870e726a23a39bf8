"""Kernels of the graph hierarchy: maximal independent sets, and the rigid-motion invariants at nodes and edges."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from anisomesh._kernels.compiled import inlined, kernel

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Longs = npt.NDArray[np.int64]

_MIN_SQUARED_LENGTH = 1e-30  # at bounding-box diagonal 1: guards divisions by the length of a zero vector
_MIN_ONE_PLUS_COSINE = 1e-9  # opposite normals have no smallest rotation
IN_SET = 2  # state of a node of the independent set
_UNDECIDED, _EXCLUDED = 0, 1  # states of the other nodes


@kernel
def maximal_independent_set(
    first: Ints, neighbour: Ints, order: Longs, state: npt.NDArray[np.int8], owner: Longs
) -> None:
    """Compute a greedy maximal independent set and the cluster of each node.

    Parameters
    ----------
    first
        First edge of each node (V + 1,), the row pointers of compressed rows.
    neighbour
        Node at the other end of each edge (E,); every edge is stored in both directions.
    order
        Nodes (V,) in the order of the greedy algorithm: a node joins the set unless a neighbour already has.
    state
        Zeros (V,); set to ``IN_SET`` for the nodes of the set.
    owner
        Output (V,): index in the set of the first neighbour, in that order, that is in the set; for a node of the set
        its own index. Nodes of the set are numbered in the order of their indices in the graph.
    """
    for i in order:
        if state[i] == _UNDECIDED:
            state[i] = IN_SET
            for e in range(first[i], first[i + 1]):
                if state[neighbour[e]] == _UNDECIDED:
                    state[neighbour[e]] = _EXCLUDED
    count = 0
    for i in range(len(state)):
        if state[i] == IN_SET:
            owner[i] = count
            count += 1
    for i in order:
        if state[i] == IN_SET:
            for e in range(first[i], first[i + 1]):
                if state[neighbour[e]] == _EXCLUDED:
                    owner[neighbour[e]] = owner[i]
                    state[neighbour[e]] = _UNDECIDED


@inlined
def _dot(a: Doubles, b: Doubles) -> float:
    total = 0.0
    for x in range(3):
        total += a[x] * b[x]
    return total


@inlined
def _double_angle(x: float, y: float) -> tuple[float, float]:
    """Return cosine and sine of twice the angle of a vector; zeros for a zero vector."""
    square = max(x * x + y * y, _MIN_SQUARED_LENGTH)
    return (x * x - y * y) / square, 2.0 * x * y / square


@inlined
def _transport(source: Doubles, source_normal: Doubles, target: Doubles, target_normal: Doubles) -> tuple[float, float]:
    """Return cosine and sine of twice the angle between frames (2, 3), by the smallest rotation between normals."""
    lift = _dot(source[0], target_normal) / max(1.0 + _dot(source_normal, target_normal), _MIN_ONE_PLUS_COSINE)
    along, across = 0.0, 0.0
    for x in range(3):
        carried = source[0, x] - lift * (source_normal[x] + target_normal[x])
        along += carried * target[0, x]
        across += carried * target[1, x]
    cosine, sine = _double_angle(along, across)
    return cosine, sine


@kernel
def transport_to_points(
    ancestor: Longs, frames: Doubles, normals: Doubles, point_frames: Doubles, point_normals: Doubles, transport: Floats
) -> None:
    """Compute the rotation, at twice its angle, from the frame of each point's ancestor to the frame of the point.

    Parameters
    ----------
    ancestor
        Node of each point (N,).
    frames, normals
        Tangent frames (V, 2, 3) and unit normals (V, 3) of the nodes.
    point_frames, point_normals
        Tangent frames (N, 2, 3) and unit normals (N, 3) of the points.
    transport
        Output: cosine and sine (N, 2).
    """
    for p in range(len(ancestor)):
        i = ancestor[p]
        transport[p, 0], transport[p, 1] = _transport(frames[i], normals[i], point_frames[p], point_normals[p])


@kernel
def edge_geometry(
    first: Ints,
    neighbour: Ints,
    positions: Doubles,
    normals: Doubles,
    frames: Doubles,
    values: Doubles,
    directions: Doubles,
    vectors: Floats,
    transport: Floats,
) -> None:
    """Compute length, normal curvatures, direction and parallel transport of each edge from i to j.

    Parameters
    ----------
    first, neighbour
        As in :func:`maximal_independent_set`.
    positions, normals, frames
        Positions (V, 3), unit normals (V, 3) and tangent frames (V, 2, 3) of the nodes.
    values
        Output (E, 4): length, normal curvature at i and at j, norm of the difference of the normals over the length.
    directions
        Output (E, 2, 2): direction in the frames of i and of j, at twice its angle.
    vectors
        Output (E, 3): vector from i to j.
    transport
        Output (E, 2): rotation from the frame of j to the frame of i, at twice its angle.
    """
    for i in range(len(first) - 1):
        for e in range(first[i], first[i + 1]):
            j = neighbour[e]
            square, turn, rise, fall = 0.0, 0.0, 0.0, 0.0
            along, across, along_there, across_there = 0.0, 0.0, 0.0, 0.0
            for x in range(3):
                way = positions[j, x] - positions[i, x]
                vectors[e, x] = way
                square += way * way
                turn += (normals[j, x] - normals[i, x]) ** 2
                rise += normals[i, x] * way
                fall += normals[j, x] * way
                along += frames[i, 0, x] * way
                across += frames[i, 1, x] * way
                along_there += frames[j, 0, x] * way
                across_there += frames[j, 1, x] * way
            square = max(square, _MIN_SQUARED_LENGTH)
            length = math.sqrt(square)
            values[e, 0], values[e, 1], values[e, 2] = length, -2.0 * rise / square, 2.0 * fall / square
            values[e, 3] = math.sqrt(turn) / length
            directions[e, 0, 0], directions[e, 0, 1] = _double_angle(along, across)
            directions[e, 1, 0], directions[e, 1, 1] = _double_angle(along_there, across_there)
            transport[e, 0], transport[e, 1] = _transport(frames[j], normals[j], frames[i], normals[i])


@kernel
def fit_normal_curvature(
    first: Ints,
    directions: Doubles,
    curvature: Doubles,
    ridge: float,
    fit_weights: Doubles,
    fit: Doubles,
    imbalance: Doubles,
) -> None:
    """Fit a + b cos 2t + c sin 2t to the normal curvatures over the directions t of the edges of each node.

    Parameters
    ----------
    first
        First edge of each node (V + 1,).
    directions
        Directions of the edges at twice their angle (E, 2, 2); the first of the two is used.
    curvature
        Normal curvatures along the edges (E,).
    ridge
        Regularisation added to the diagonal of the normal equations, over the number of edges.
    fit_weights
        Output (E, 3): derivative of a, b and c with respect to the curvature along each edge.
    fit
        Output (V, 3): a, b and c.
    imbalance
        Output (V,): length of the mean direction at twice its angle; 0 where edges are spread evenly.
    """
    for i in range(len(first) - 1):
        n = float(first[i + 1] - first[i])
        c, s, cc, cs, ss = 0.0, 0.0, ridge * n, 0.0, ridge * n
        for e in range(first[i], first[i + 1]):
            x, y = directions[e, 0, 0], directions[e, 0, 1]
            c += x
            s += y
            cc += x * x
            cs += x * y
            ss += y * y
        imbalance[i] = math.hypot(c, s) / max(n, 1.0)
        n += ridge * n
        nn, nc, ns = cc * ss - cs * cs, cs * s - c * ss, c * cs - cc * s
        xx, xy, yy = n * ss - s * s, c * s - n * cs, n * cc - c * c
        determinant = n * nn + c * nc + s * ns
        fit[i] = 0.0
        for e in range(first[i], first[i + 1]):
            x, y = directions[e, 0, 0], directions[e, 0, 1]
            fit_weights[e, 0] = (nn + nc * x + ns * y) / determinant
            fit_weights[e, 1] = (nc + xx * x + xy * y) / determinant
            fit_weights[e, 2] = (ns + xy * x + yy * y) / determinant
            for k in range(3):
                fit[i, k] += fit_weights[e, k] * curvature[e]


@kernel
def edge_features(
    first: Ints,
    neighbour: Ints,
    values: Doubles,
    directions: Doubles,
    curvature_line: Doubles,
    fit_weights: Doubles,
    mean_length: Doubles,
    features: Floats,
) -> None:
    """Compute the input features of each edge.

    Parameters
    ----------
    first, neighbour, values, directions, fit_weights
        As in :func:`edge_geometry` and :func:`fit_normal_curvature`.
    curvature_line
        Line of curvature of each node (V, 2), at twice its angle.
    mean_length
        Mean length of the edges of each node (V,).
    features
        Output (E, 7): logarithm of the length over the mean length; the other three values; cosine of twice the angle
        with the line of curvature at either end; weight of the edge in the fitted mean curvature of its node, times the
        number of edges.
    """
    for i in range(len(first) - 1):
        count = first[i + 1] - first[i]
        for e in range(first[i], first[i + 1]):
            j = neighbour[e]
            features[e, 0] = math.log(values[e, 0] / mean_length[i])
            for k in range(1, 4):
                features[e, k] = values[e, k]
            features[e, 4] = curvature_line[i, 0] * directions[e, 0, 0] + curvature_line[i, 1] * directions[e, 0, 1]
            features[e, 5] = curvature_line[j, 0] * directions[e, 1, 0] + curvature_line[j, 1] * directions[e, 1, 1]
            features[e, 6] = fit_weights[e, 0] * count


@kernel
def edge_statistics(first: Ints, values: Doubles, statistics: Doubles) -> None:
    """Compute maximum, minimum, mean and deviation (V, K, 4) of edge values (E, K) at each node; 0 without edges."""
    statistics[:] = 0.0
    for i in range(len(first) - 1):
        count = first[i + 1] - first[i]
        for k in range(values.shape[1] if count else 0):
            largest, smallest, total = -math.inf, math.inf, 0.0
            for e in range(first[i], first[i + 1]):
                largest, smallest = max(largest, values[e, k]), min(smallest, values[e, k])
                total += values[e, k]
            mean, square = total / count, 0.0
            for e in range(first[i], first[i + 1]):
                square += (values[e, k] - mean) ** 2
            statistics[i, k, 0], statistics[i, k, 1], statistics[i, k, 2] = largest, smallest, mean
            statistics[i, k, 3] = math.sqrt(square / count)
