"""Lines on sheets that end at nodes of junctions: the edges from their last vertices to the nodes."""

from __future__ import annotations

import igl
import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeEnds, Faces, PointMask, Points
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.meshops.edge_recovery import recover_edges

_MAX_EDGES_BETWEEN = 3  # edges between a node and the last vertex of a line that ends there
_MAX_SAG = 0.1  # of the length of an edge, from its middle to the line that it follows

Ints = npt.NDArray[np.int64]


def with_ends_at_nodes(
    points: Points,
    faces: Faces,
    crease_edges: EdgeEnds,
    nodes: Ints,
    lines: npt.NDArray[np.float64],
    reference: ClosestPoints,
) -> tuple[Faces, EdgeEnds]:
    """Return faces and edges along lines in which the lines that end at nodes have an edge to there.

    Parameters
    ----------
    points, faces
        A mesh of sheets (V, 3), (F, 3) with vertices at the nodes of its junctions.
    crease_edges
        Ends of its edges along lines (n, 2).
    nodes
        The vertices at nodes (m,).
    lines
        The segments (s, 2, 3) of all lines.
    reference
        The surface that the mesh approximates.

    Notes
    -----
    The dual links vertices on lines, but a node of a junction becomes a vertex of each sheet only when the sheets are
    made to conform. An edge that is missing is made by flips if a neighbour of both vertices is in its way.
    """
    starts = nodes[_are_ends(points[nodes], lines)]
    if len(starts) == 0:
        return faces, crease_edges
    degree = np.bincount(np.asarray(crease_edges, dtype=np.int64).ravel(), minlength=len(points))
    surface = Surface(points, faces)
    found = (_link(points, int(v), np.flatnonzero((degree == 1) & _around(surface, int(v))), lines) for v in starts)
    wanted = [pair for pair in found if pair]
    if not wanted:
        return faces, crease_edges
    links = np.array(wanted, dtype=np.int64)
    missing = ~np.isin(edge_keys(links), edge_keys(surface.edges))
    paths = [path for path in (_path(surface, pair) for pair in links[missing].tolist()) if path]
    if paths:
        faces = recover_edges(points, faces, paths, reference)
    made = np.isin(edge_keys(links), edge_keys(Surface(points, faces).edges))
    return faces, np.concatenate([crease_edges, links[made]])


def _are_ends(places: Points, lines: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Return which places (n, 3) are an end of a segment (s, 2, 3)."""
    ends = {end.tobytes() for end in lines.reshape(-1, 3) + 0.0}
    return np.array([place.tobytes() in ends for place in places + 0.0], dtype=bool)


def _around(surface: Surface, point: int) -> PointMask:
    """Return which points (V,) are few edges away from a point."""
    near = np.zeros(surface.n_points, dtype=bool)
    near[point] = True
    for _ in range(_MAX_EDGES_BETWEEN):
        near[surface.edges[near[surface.edges].any(axis=1)]] = True
    return near


def _link(points: Points, node: int, loose: Ints, lines: npt.NDArray[np.float64]) -> tuple[int, int] | None:
    """Return a node and the nearest of some points (n,) from which an edge to it follows the lines, None for none."""
    loose = loose[loose != node]
    length = np.linalg.norm(points[loose] - points[node], axis=1)
    loose, length = loose[length > 0.0], length[length > 0.0]
    if len(loose) == 0:
        return None
    segments = np.arange(2 * len(lines)).reshape(-1, 2)
    middles = np.ascontiguousarray(0.5 * (points[loose] + points[node]))
    squares = igl.point_mesh_squared_distance(middles, lines.reshape(-1, 3), segments)[0]
    near = np.flatnonzero(squares <= (_MAX_SAG * length) ** 2)
    return (node, int(loose[near[np.argmin(length[near])]])) if len(near) else None


def _path(surface: Surface, pair: list[int]) -> list[int]:
    """Return the ends of an edge to be made and the neighbour of both that is nearest to its middle, empty for none."""
    first, second = (surface.edges[(surface.edges == end).any(axis=1)].ravel() for end in pair)
    common = np.setdiff1d(np.intersect1d(first, second), pair)
    if len(common) == 0:
        return []
    offset = surface.points[common] - surface.points[pair].mean(axis=0)
    return [pair[0], int(common[np.argmin(np.linalg.norm(offset, axis=1))]), pair[1]]
