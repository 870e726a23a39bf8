"""What the network sees of a mesh: independent sets of nodes, and invariants of the edges of each node."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from anisomesh._kernels.compiled import inlined, kernel

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Longs = npt.NDArray[np.int64]

_TINY = 1e-30
TAKEN = 2
_FREE, _OUT = 0, 1


@kernel
def independent_set(first: Ints, neighbour: Ints, order: Longs, state: npt.NDArray[np.int8], owner: Longs) -> None:
    """Write a maximal independent set, and which of its nodes each node belongs to.

    Parameters
    ----------
    first
        First edge of each node (V + 1,).
    neighbour
        Node at the other end of each edge (E,); every edge is there both ways.
    order
        The nodes, in the order in which they are taken (V,) if no neighbour was.
    state
        Zero (V,); becomes ``TAKEN`` for the nodes of the set.
    owner
        Room for the number, in the set, of the first neighbour in that order that is taken (V,); of a node that is
        taken, its own. Nodes of the set are numbered as they are in the graph.
    """
    for i in order:
        if state[i] == _FREE:
            state[i] = TAKEN
            for e in range(first[i], first[i + 1]):
                if state[neighbour[e]] == _FREE:
                    state[neighbour[e]] = _OUT
    count = 0
    for i in range(len(state)):
        if state[i] == TAKEN:
            owner[i] = count
            count += 1
    for i in order:
        if state[i] == TAKEN:
            for e in range(first[i], first[i + 1]):
                if state[neighbour[e]] == _OUT:
                    owner[neighbour[e]] = owner[i]
                    state[neighbour[e]] = _FREE


@inlined
def _dot(a: Doubles, b: Doubles) -> float:
    total = 0.0
    for x in range(3):
        total += a[x] * b[x]
    return total


@inlined
def _double_angle(x: float, y: float) -> tuple[float, float]:
    """Return cosine and sine of twice the angle of a vector, zeros for one without length."""
    square = max(x * x + y * y, _TINY)
    return (x * x - y * y) / square, 2.0 * x * y / square


@inlined
def _carry(source: Doubles, source_normal: Doubles, target: Doubles, target_normal: Doubles) -> tuple[float, float]:
    """Return cosine and sine of twice the angle from a frame (2, 3) to another, by the smallest rotation of normals."""
    lift = _dot(source[0], target_normal) / max(1.0 + _dot(source_normal, target_normal), 1e-9)
    along, across = 0.0, 0.0
    for x in range(3):
        carried = source[0, x] - lift * (source_normal[x] + target_normal[x])
        along += carried * target[0, x]
        across += carried * target[1, x]
    cosine, sine = _double_angle(along, across)
    return cosine, sine


@kernel
def carry_to_points(
    ancestor: Longs, frames: Doubles, normals: Doubles, point_frames: Doubles, point_normals: Doubles, carry: Floats
) -> None:
    """Write the rotation, at twice its angle, from the frame of the node that each point belongs to, to its own.

    Parameters
    ----------
    ancestor
        Node of each point (N,).
    frames, normals
        Of the nodes (V, 2, 3) and (V, 3).
    point_frames, point_normals
        Of the points (N, 2, 3) and (N, 3).
    carry
        Room for the result (N, 2).
    """
    for p in range(len(ancestor)):
        i = ancestor[p]
        carry[p] = _carry(frames[i], normals[i], point_frames[p], point_normals[p])


@kernel
def edge_geometry(
    first: Ints,
    neighbour: Ints,
    positions: Doubles,
    normals: Doubles,
    frames: Doubles,
    values: Doubles,
    turns: Doubles,
    ways: Floats,
    ties: Floats,
) -> None:
    """Write what is known of each edge from i to j by its two ends.

    Parameters
    ----------
    first, neighbour
        As in :func:`independent_set`.
    positions, normals, frames
        Of the nodes (V, 3), (V, 3) and (V, 2, 3).
    values
        Room for the length, the normal curvature at i and at j, and the turn of the normals over the length (E, 4).
    turns
        Room for the direction of the edge in the frames of i and of j, at twice its angle (E, 2, 2).
    ways
        Room for the vectors from i to j (E, 3).
    ties
        Room for the rotation from the frame of j to that of i, at twice its angle (E, 2).
    """
    for i in range(len(first) - 1):
        for e in range(first[i], first[i + 1]):
            j = neighbour[e]
            square, turn, rise, fall = 0.0, 0.0, 0.0, 0.0
            along, across, along_there, across_there = 0.0, 0.0, 0.0, 0.0
            for x in range(3):
                way = positions[j, x] - positions[i, x]
                ways[e, x] = way
                square += way * way
                turn += (normals[j, x] - normals[i, x]) ** 2
                rise += normals[i, x] * way
                fall += normals[j, x] * way
                along += frames[i, 0, x] * way
                across += frames[i, 1, x] * way
                along_there += frames[j, 0, x] * way
                across_there += frames[j, 1, x] * way
            square = max(square, _TINY)
            length = math.sqrt(square)
            values[e, 0], values[e, 1], values[e, 2] = length, -2.0 * rise / square, 2.0 * fall / square
            values[e, 3] = math.sqrt(turn) / length
            turns[e, 0] = _double_angle(along, across)
            turns[e, 1] = _double_angle(along_there, across_there)
            ties[e] = _carry(frames[j], normals[j], frames[i], normals[i])


@kernel
def fit_directions(
    first: Ints, turns: Doubles, bend: Doubles, held: float, duals: Doubles, fit: Doubles, imbalance: Doubles
) -> None:
    """Write the least squares fit a + b cos 2t + c sin 2t of values over the directions t of the edges of each node.

    Parameters
    ----------
    first
        First edge of each node (V + 1,).
    turns
        Directions of the edges at twice their angle (E, 2, 2), of which the first are used.
    bend
        The values (E,).
    held
        Share of the number of edges that is added to the squares, where directions do not decide the fit.
    duals
        Room for what each edge adds to a, b and c for each of its value (E, 3).
    fit
        Room for a, b and c (V, 3).
    imbalance
        Room for the length of the mean of the directions at twice their angle (V,).
    """
    for i in range(len(first) - 1):
        n = float(first[i + 1] - first[i])
        c, s, cc, cs, ss = 0.0, 0.0, held * n, 0.0, held * n
        for e in range(first[i], first[i + 1]):
            x, y = turns[e, 0, 0], turns[e, 0, 1]
            c += x
            s += y
            cc += x * x
            cs += x * y
            ss += y * y
        imbalance[i] = math.hypot(c, s) / max(n, 1.0)
        n += held * n
        nn, nc, ns = cc * ss - cs * cs, cs * s - c * ss, c * cs - cc * s
        xx, xy, yy = n * ss - s * s, c * s - n * cs, n * cc - c * c
        determinant = n * nn + c * nc + s * ns
        fit[i] = 0.0
        for e in range(first[i], first[i + 1]):
            x, y = turns[e, 0, 0], turns[e, 0, 1]
            duals[e, 0] = (nn + nc * x + ns * y) / determinant
            duals[e, 1] = (nc + xx * x + xy * y) / determinant
            duals[e, 2] = (ns + xy * x + yy * y) / determinant
            for k in range(3):
                fit[i, k] += duals[e, k] * bend[e]


@kernel
def edge_invariants(
    first: Ints,
    neighbour: Ints,
    values: Doubles,
    turns: Doubles,
    line: Doubles,
    duals: Doubles,
    mean_length: Doubles,
    along: Floats,
) -> None:
    """Write the values of each edge that the network sees.

    Parameters
    ----------
    first, neighbour, values, turns, duals
        As in :func:`edge_geometry` and :func:`fit_directions`.
    line
        Line of curvature of each node (V, 2).
    mean_length
        Of the edges of each node (V,).
    along
        Room (E, 7): logarithm of the length over the mean, the other three values, the cosine of twice the angle with
        the line of curvature at both ends, and the share of the edge in the mean curvature of its node over that of an
        edge in a plain mean.
    """
    for i in range(len(first) - 1):
        count = first[i + 1] - first[i]
        for e in range(first[i], first[i + 1]):
            j = neighbour[e]
            along[e, 0] = math.log(values[e, 0] / mean_length[i])
            for k in range(1, 4):
                along[e, k] = values[e, k]
            along[e, 4] = line[i, 0] * turns[e, 0, 0] + line[i, 1] * turns[e, 0, 1]
            along[e, 5] = line[j, 0] * turns[e, 1, 0] + line[j, 1] * turns[e, 1, 1]
            along[e, 6] = duals[e, 0] * count


@kernel
def spread_at_nodes(first: Ints, values: Doubles, spread: Doubles) -> None:
    """Write largest, smallest, mean and deviation (V, K, 4) of values (E, K) over the edges of each node, 0 if none."""
    spread[:] = 0.0
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
            spread[i, k, 0], spread[i, k, 1], spread[i, k, 2] = largest, smallest, mean
            spread[i, k, 3] = math.sqrt(square / count)
