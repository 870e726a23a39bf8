"""The creases of a surface as polylines between corners, and which of them sites at a spacing can follow."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from anisomesh._arrays import EdgeMask, EmbeddedPoints
from anisomesh.features.detect import corners
from anisomesh.features.polylines import FeaturePolylines
from anisomesh.mesh.surface import Surface

# in site spacings; heuristics, chosen on procedural parts and training meshes
_MIN_LOOSE_END = 0.1  # a crease with a loose end that is shorter is dropped
_MIN_COMPONENT = 2.0  # length of a connected component of creases that is kept
_PER_LOOSE_END = 2.5  # and more for each of its loose ends
_PER_POLYLINE = 0.5  # or for each of its polylines, if that is more


def trace_creases(positions: EmbeddedPoints, surface: Surface, creases: EdgeMask) -> FeaturePolylines:
    """Return the creases of a surface as polylines from corner to corner, or closed ones without a corner.

    Parameters
    ----------
    positions
        Points in R^d (V, d), between which arc length is measured.
    surface
        The surface.
    creases
        Which of its edges (E,) are on a crease.
    """
    at_corner = corners(surface, creases)
    edge = np.flatnonzero(creases)
    ends = surface.edges[edge].astype(np.int64)
    halves = np.concatenate([ends, ends[:, ::-1]])  # half k goes along edge k % n
    n = len(edge)
    order = np.argsort(halves[:, 0], kind="stable")
    begins = np.searchsorted(halves[order, 0], np.arange(surface.n_points + 1))
    leaving, begins_list, heads = order.tolist(), begins.tolist(), halves[:, 1].tolist()
    ends_here = at_corner.tolist()
    left = [True] * n
    sides: list[int] = []
    sizes: list[int] = []
    closed: list[bool] = []
    from_corners = order[at_corner[halves[order, 0]]].tolist()
    for begin in [*from_corners, *range(n)]:
        half, before = begin, len(sides)
        while left[half % n]:
            left[half % n] = False
            sides.append(half)
            point = heads[half]
            if ends_here[point]:
                break
            one, other = leaving[begins_list[point] : begins_list[point + 1]]
            half = one if other % n == half % n else other
        if len(sides) > before:
            sizes.append(len(sides) - before)
            closed.append(not ends_here[heads[sides[-1]]])
    taken = np.array(sides, dtype=np.int64)
    face = surface.edge_faces[edge[taken % n], 0]
    corner = np.argmax(surface.face_edges[face] == edge[taken % n][:, None], axis=1)
    segment_of_side = np.full(surface.faces.shape, -1, dtype=np.int64)
    segment_of_side[face, corner] = np.arange(len(taken))
    return FeaturePolylines.of_segments(
        positions, halves[taken], sizes, closed, edge=edge[taken % n], segment_of_side=segment_of_side
    )


def select_creases(
    positions: EmbeddedPoints,
    surface: Surface,
    edges: EdgeMask,
    *,
    required: EdgeMask,
    spacing: float,
    max_length: float,
) -> FeaturePolylines:
    """Return the creases that sites at a spacing can follow.

    Parameters
    ----------
    positions
        The embedded points (V, d).
    surface
        The surface in space.
    edges
        Which of its edges (E,) are on a crease.
    required
        Which of these (E,) are kept in any case.
    spacing
        Distance between sites, in embedding units.
    max_length
        Largest total length of creases, in spacings.

    Notes
    -----
    The creases of a rough scan are many short polylines with loose ends, the creases of a machine part long ones that
    meet. Short loose ends are dropped first, then connected components that are short for their number of polylines
    and loose ends, then the shortest components until the total length is at most ``max_length``.
    """
    left = np.array(edges)
    while True:
        creases = trace_creases(positions, surface, left)
        if creases.n_polylines == 0:
            return creases
        length = np.diff(creases.limits, axis=1)[:, 0] / spacing
        ends = creases.ends
        valence = np.bincount(ends[ends >= 0], minlength=surface.n_points)
        loose = (ends >= 0) & (valence[ends] == 1) & ~surface.on_boundary[ends]
        short = loose.any(axis=1) & (length < _MIN_LOOSE_END)
        before = left.sum()
        left[creases.edge[short[creases.polyline]]] = False
        left |= required
        if left.sum() == before:
            break
    graph = coo_array((np.ones(len(creases.tail)), (creases.tail, creases.head)), shape=(surface.n_points,) * 2)
    component = connected_components(graph, directed=False)[1][creases.tail[creases.first[:-1]]]
    total = np.bincount(component, length)
    loose_ends = np.bincount(component, loose.sum(axis=1))
    wanted = total >= np.maximum(_MIN_COMPONENT + _PER_LOOSE_END * loose_ends, _PER_POLYLINE * np.bincount(component))
    order = np.argsort(-total, kind="stable")
    kept = np.zeros(len(total), dtype=bool)
    kept[order] = (np.cumsum((total * wanted)[order]) <= max_length) & wanted[order]
    left[creases.edge[~kept[component[creases.polyline]]]] = False
    left |= required
    return trace_creases(positions, surface, left)
