"""The cut of a prepared surface at its junctions, into sheets that have these as boundaries."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, PointLabels, PointMask
from anisomesh.junctions.graph import JunctionGraph, graph_of
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import corner_fans, edge_keys, edges_of, side_pairs
from anisomesh.meshops.change import apply_changes
from anisomesh.meshops.split import edge_split
from anisomesh.repair.prepare import Prepared
from anisomesh.resolve import is_designed


@dataclass(frozen=True, kw_only=True, eq=False)
class Junctions:
    """The junctions of a surface, and its sheets.

    Attributes
    ----------
    sheets
        The surface cut along all junctions, so that these are boundaries.
    source
        For every point of the sheets (V,) a point of the prepared surface: itself, or an end of the edge in the middle
        of which it was added.
    added
        Which points of the sheets (V,) were added.
    joined
        For every point of the sheets (V,) its number when the sheets are joined: the points that a point of a junction
        was cut into have the same one.
    graph
        The junctions as curves, and where the sheets have them.
    """

    sheets: Surface
    source: PointLabels
    added: PointMask
    joined: PointLabels
    graph: JunctionGraph

    @cached_property
    def on_several(self) -> PointMask:
        """Which points of the sheets (V,) are one with others when they are joined."""
        return np.asarray(np.bincount(self.joined)[self.joined] > 1)

    @cached_property
    def lengths(self) -> npt.NDArray[np.float64]:
        """The length of each curve (n,)."""
        where = np.zeros((int(self.joined.max()) + 1, 3))
        where[self.joined] = self.sheets.points
        return np.array([np.linalg.norm(np.diff(where[curve], axis=0), axis=1).sum() for curve in self.graph.curves])

    @cached_property
    def whole(self) -> Surface:
        """The sheets joined again."""
        first = np.unique(self.joined, return_index=True)[1]
        return Surface(self.sheets.points[first], self.joined[self.sheets.faces])


def cut_at_junctions(prepared: Prepared, fixed: PointMask | None = None) -> Junctions | None:
    """Return the sheets of a prepared surface, None if no edge of it was cut apart.

    Parameters
    ----------
    prepared
        The prepared surface.
    fixed
        Points (V,) that are nodes if they are on junctions.

    Notes
    -----
    :func:`~anisomesh.repair.prepare.prepare` glues faces in pairs where more than two meet, so that a junction is a
    boundary of some sheets and goes through the middle of others. Here it is cut out of these too: a boundary of a mesh
    is where it is wanted. An edge that the cut would leave whole, since it has the same ends on both sides, as a single
    edge at which two cubes meet, gets a point in its middle first.
    """
    surface, junction = prepared.surface, prepared.junctions
    if not junction.any():
        return None
    source, joined = np.arange(surface.n_points), _joined(surface, junction)
    corner_point = _cut(surface, junction)[1]
    side_edges = edges_of(corner_point.reshape(-1, 3))[1].ravel()
    whole = junction[surface.face_edges.ravel()] & (np.bincount(side_edges)[side_edges] > 1)
    if whole.any():
        keys = edge_keys(joined[surface.edges])
        split = np.isin(keys, keys[surface.face_edges.ravel()[whole]])
        ends = surface.edges[split]
        source = np.concatenate([source, ends[:, 0]])
        surface, junction = _with_middles(surface, junction, split)
        joined = _joined(surface, junction)
    n_points, corner_point = _cut(surface, junction)
    copied = np.zeros(n_points, dtype=np.int64)
    copied[corner_point] = surface.faces.ravel()
    order = np.argsort(copied, kind="stable")
    position = np.argsort(order, kind="stable")
    sheets = Surface(surface.points[copied[order]], position[corner_point].reshape(-1, 3))
    labels = joined[copied[order]]
    keys = np.unique(edge_keys(joined[surface.edges[junction]]))
    nodes = np.zeros(int(joined.max()) + 1, dtype=bool)
    if fixed is not None:
        nodes[joined[: len(fixed)][fixed]] = True
    graph = graph_of(sheets, labels, keys, nodes, turns_are_corners=is_designed(prepared.surface))
    added = copied[order] >= prepared.surface.n_points
    return Junctions(
        sheets=sheets, source=source[copied[order]].astype(np.int32), added=added, joined=labels, graph=graph
    )


def _joined(surface: Surface, junction: EdgeMask) -> PointLabels:
    """Return the number (V,) of each point when points of junctions at the same place are one."""
    label = np.arange(surface.n_points)
    on_junction = np.unique(surface.edges[junction])
    first, place = np.unique(surface.points[on_junction], axis=0, return_index=True, return_inverse=True)[1:]
    label[on_junction] = on_junction[first][place.reshape(-1)]
    return np.unique(label, return_inverse=True)[1].reshape(-1).astype(np.int32)


def _cut(surface: Surface, junction: EdgeMask) -> tuple[int, PointLabels]:
    """Return the number of points after a cut along edges (E,), and the point of each corner (3F,)."""
    pairs = side_pairs(surface.faces)
    return corner_fans(surface.faces, pairs[~junction[surface.face_edges.ravel()[pairs[:, 0]]]])


def _with_middles(surface: Surface, junction: EdgeMask, split: EdgeMask) -> tuple[Surface, EdgeMask]:
    """Return a surface with points in the middle of some junctions (E,), and which of its edges are junctions."""
    kept, ends = edge_keys(surface.edges[junction & ~split]), surface.edges[split]
    result = surface
    for pair in ends:
        edge = int(np.flatnonzero(edge_keys(result.edges) == edge_keys(pair[None]))[0])
        middle = surface.points[pair].mean(axis=0)
        result = Surface(*apply_changes(result, [edge_split(result, edge, middle)]))
    added = result.edges[:, 1] - surface.n_points
    halves = (added >= 0) & (ends[np.maximum(added, 0)] == result.edges[:, :1]).any(axis=1)
    return result, halves | np.isin(edge_keys(result.edges), kept)
