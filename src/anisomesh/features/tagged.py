"""Tagged edges: features that the user lists, found again on the prepared surface."""

from __future__ import annotations

from typing import Any, Literal

import igl
import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from anisomesh._arrays import EdgeEnds, EdgeMask, Floats, Points
from anisomesh.errors import OptionError
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.repair.near_points import weld_distance
from anisomesh.repair.t_junctions import ON_SIDE

_MAX_SAGITTA = 0.1  # distance of the middle of an edge along a line from it, over the length of the edge; heuristic
_MIN_SEARCH_RADIUS = 1e-12  # times the diagonal of the input: rounding of copied points


def tagged_edges(
    input_mesh: Surface, pairs: npt.ArrayLike, prepared: Surface, tolerance: float | Literal["auto"]
) -> EdgeMask:
    """Return which edges (E,) of the prepared surface are tagged.

    Parameters
    ----------
    input_mesh
        The mesh of the user.
    pairs
        Indices (n, 2) of the end points of the tagged edges of the input mesh.
    prepared
        The surface after repair, in the same coordinates.
    tolerance
        Weld tolerance of the repair, in model units or ``"auto"``.

    Raises
    ------
    OptionError
        If the pairs are not integers (n, 2) in range, or not edges of the input mesh.

    Notes
    -----
    Repair merges and duplicates points, so the ends of the edges are found again by their positions. It splits edges at
    points that lie on them, so the edges along one that is gone are its parts.
    """
    ends = checked_pairs(input_mesh, pairs)
    if len(ends) == 0:
        return np.zeros(len(prepared.edges), dtype=bool)
    tree = cKDTree(prepared.points)
    keys = edge_keys(prepared.edges)
    radius = search_radius(input_mesh, tolerance)
    copies = [tree.query_ball_point(input_mesh.points[column], radius) for column in ends.T]
    wanted = [
        (a, b, k)
        for k, (first, second) in enumerate(zip(*copies, strict=True))
        for a in first
        for b in second
        if a != b
    ]
    table = np.array(wanted, dtype=np.int64).reshape(-1, 3)
    wanted_keys = edge_keys(table[:, :2])
    gone = np.ones(len(ends), dtype=bool)
    gone[table[np.isin(wanted_keys, keys), 2]] = False
    lines = input_mesh.points[ends[gone]]
    limit = max(radius, ON_SIDE * input_mesh.diagonal)
    parts = _along(prepared, lines[(lines[:, 0] != lines[:, 1]).any(axis=1)], limit)
    return np.asarray(np.isin(keys, wanted_keys) | parts)


def _along(surface: Surface, lines: npt.NDArray[np.float64], limit: float) -> EdgeMask:
    """Return which edges (E,) have both ends and the middle within a distance of line segments (n, 2, 3)."""
    found = np.zeros(len(surface.edges), dtype=bool)
    if len(lines) == 0:
        return found
    segments = np.arange(2 * len(lines)).reshape(-1, 2)

    def are_near(places: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
        squares = igl.point_mesh_squared_distance(places, lines.reshape(-1, 3), segments)[0]
        return np.asarray(squares <= limit**2)

    chosen = np.flatnonzero(are_near(surface.points)[surface.edges].all(axis=1))
    if len(chosen):
        found[chosen] = are_near(surface.points[surface.edges[chosen]].mean(axis=1))
    return found


def search_radius(input_mesh: Surface, tolerance: float | Literal["auto"]) -> float:
    """Return the distance up to which a point of the prepared surface is a point of the input, in model units."""
    return max(weld_distance(input_mesh, tolerance), _MIN_SEARCH_RADIUS * input_mesh.diagonal)


def checked_pairs(input_mesh: Surface, pairs: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """Return the pairs as integers (n, 2) after validation."""
    try:
        values: npt.NDArray[Any] = np.asarray(pairs)
    except ValueError as error:
        raise OptionError(f"features has rows of different lengths ({error}); expected (n, 2)") from error
    if values.size == 0:
        return np.zeros((0, 2), dtype=np.int64)
    if values.ndim != 2 or values.shape[1] != 2:
        raise OptionError(f"features has shape {values.shape}; expected (n, 2), two points of the mesh for each edge")
    if values.dtype.kind not in "iuf":
        raise OptionError(f"features has type {values.dtype}; expected whole numbers, two points for each edge")
    whole = np.isfinite(values) & (values == np.floor(values)) & (values >= 0) & (values < input_mesh.n_points)
    ends = np.where(whole, values, -1).astype(np.int64)
    if not whole.all():
        raise OptionError(
            f"features has points from {values.min()} to {values.max()}; expected whole numbers from 0 to "
            f"{input_mesh.n_points - 1}"
        )
    missing = ~np.isin(edge_keys(ends), edge_keys(input_mesh.edges))
    if missing.any():
        a, b = ends[np.argmax(missing)]
        raise OptionError(
            f"{missing.sum():,} of the {len(ends):,} pairs in features are not edges of the mesh, the first {a} - {b}"
        )
    return ends


def distance_to_crease_edges(
    surface: Surface, tagged: EdgeMask, mesh: Surface, crease_edges: npt.NDArray[np.int64]
) -> float:
    """Return the largest distance from tagged edges to edges of a mesh on creases or its boundary, 0 if none is tagged.

    Parameters
    ----------
    surface
        The surface.
    tagged
        Its tagged edges (E,), of which the ends and middles are measured: on the boundary to the boundary of the mesh,
        elsewhere to its edges along creases.
    mesh
        A mesh near the surface, in the same units.
    crease_edges
        Ends of the edges of the mesh that are known to be along creases inside it (n, 2). Others that lie on tagged
        edges count too, as of a mesh that is the input; infinite if there are none of both for edges inside.
    """
    boundary, outline = surface.edge_face_count == 1, mesh.edges[mesh.edge_face_count == 1]
    inside = tagged & ~boundary
    if inside.any():
        crease_edges = np.concatenate([crease_edges, _edges_on(surface, inside, mesh)])
    lines = ((inside, crease_edges), (tagged & boundary, outline))
    return max(_largest_distance(surface.points[surface.edges[of]], mesh, edges) for of, edges in lines)


def _edges_on(surface: Surface, tagged: EdgeMask, mesh: Surface) -> EdgeEnds:
    """Return the edges of a mesh (n, 2) with both ends on tagged edges (E,) of a surface, and the middle near them."""

    def distance(places: Points) -> Floats:
        squares, _, _ = igl.point_mesh_squared_distance(places, surface.points, surface.edges[tagged].astype(np.int64))
        return np.asarray(np.sqrt(squares))

    on_line = distance(mesh.points) <= ON_SIDE * surface.diagonal
    found = on_line[mesh.edges].all(axis=1)
    edges: EdgeEnds = mesh.edges[found].astype(np.int64)
    if len(edges) == 0:
        return edges
    is_along = distance(mesh.points[edges].mean(axis=1)) <= _MAX_SAGITTA * mesh.edge_lengths[found]
    return np.asarray(edges[is_along])


def _largest_distance(ends: npt.NDArray[np.float64], mesh: Surface, edges: npt.NDArray[np.integer]) -> float:
    """Return the largest distance of the ends and middles of segments (n, 2, 3) from edges (m, 2) of a mesh."""
    if len(ends) == 0:
        return 0.0
    if len(edges) == 0:
        return float("inf")
    places = np.concatenate([ends[:, 0], ends[:, 1], ends.mean(axis=1)])
    squares, _, _ = igl.point_mesh_squared_distance(places, mesh.points, np.asarray(edges, dtype=np.int64))
    return float(np.sqrt(squares.max()))
