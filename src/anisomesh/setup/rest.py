"""The part of a prepared input that is not locked, with an outline where it is joined to the rest again."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from anisomesh._arrays import EdgeMask, FaceMask, PointMask
from anisomesh.attributes.model import Ints
from anisomesh.junctions.cut import Junctions
from anisomesh.junctions.graph import graph_of
from anisomesh.mesh.geometry import sums_at_points
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import corner_fans, edge_keys, side_pairs
from anisomesh.mesh.weld import coincident
from anisomesh.resolve import is_designed
from anisomesh.setup.inputs import PreparedInput

_FEWEST = 3  # vertices of a part that is one triangle
_APART = 1e-9  # of the size of the faces at a point: distance of copies of it from where it is, to tell them apart


class Rest(NamedTuple):
    """The part of an input that is remeshed, and how it belongs to the whole.

    Attributes
    ----------
    part
        The part.
    source
        Point of the whole input, its sheets apart, at each of its points (V',).
    """

    part: PreparedInput
    source: Ints


def rest_of(whole: PreparedInput, locked: FaceMask, *, connected: bool = False) -> Rest:
    """Return the part of an input that is not locked.

    Parameters
    ----------
    whole
        The input.
    locked
        Which faces (F,) of its sheets are locked; some are, and some are not.
    connected
        Whether all edges of junctions stay that are connected to locked faces.

    Notes
    -----
    Junctions keep the edges at which locked faces meet others, as the border does, and have a node at every vertex of
    these.
    """
    surface = whole.prepared.surface
    on_kept = np.zeros(len(surface.edges), dtype=bool)
    if whole.junctions is not None:
        on_kept = _kept_edges(whole.junctions, locked, surface, connected=connected)
    faces = surface.faces[~locked]
    n_fans, fan = corner_fans(faces, side_pairs(faces))
    source = np.empty(n_fans, dtype=np.int64)
    source[fan] = faces.ravel()
    order = np.argsort(source, kind="stable")
    position = np.empty(n_fans, dtype=np.int32)
    position[order] = np.arange(n_fans)
    source = source[order]
    part = Surface(surface.points[source], position[fan].reshape(-1, 3))
    edge = np.searchsorted(edge_keys(surface.edges), edge_keys(source[part.edges]))
    outline = (part.edge_face_count == 1) & ((surface.edge_face_count[edge] == 2) | on_kept[edge])
    border = np.zeros(n_fans, dtype=bool)
    border[part.edges[outline]] = True
    fixed = whole.fixed[source] | border
    part = _told_apart(part, border)
    junctions = None
    if whole.junctions is not None:
        held = np.union1d(surface.faces[locked], surface.edges[on_kept])
        held = np.unique(whole.junctions.joined[held])
        junctions = _junctions_of(part, source, whole.junctions, held, designed=is_designed(surface))
    n_fixed = np.count_nonzero(fixed) if junctions is None else len(np.unique(junctions.joined[fixed]))
    rest = replace(
        whole,
        prepared=replace(
            whole.prepared,
            surface=part,
            point_source=whole.prepared.point_source[source],
            junctions=whole.prepared.junctions[edge],
        ),
        junctions=junctions,
        tensors=None if whole.tensors is None else whole.tensors[source],
        density=None if whole.density is None else whole.density[source],
        sizes=None if whole.sizes is None else whole.sizes[source],
        tagged=whole.tagged[edge],
        borders=whole.borders[edge],
        seams=whole.seams[edge],
        fixed=fixed if junctions is None else fixed | junctions.graph.nodes,
        outline=outline,
        least=max(_FEWEST, int(n_fixed)),
    )
    return Rest(rest, source)


def _keys(junctions: Junctions) -> Ints:
    """Return the keys (n,) of the edges of junctions between joined points, ascending."""
    sides = [np.stack([curve[:-1], curve[1:]], axis=1) for curve in junctions.graph.curves]
    return np.unique(edge_keys(np.concatenate(sides)))


def _kept_edges(junctions: Junctions, locked: FaceMask, surface: Surface, *, connected: bool) -> EdgeMask:
    """Return which edges (E,) of the sheets are, when these are joined, on junctions and sides of locked faces (F,).

    If ``connected``, on junctions that are connected to vertices of locked faces.
    """
    keys, all_keys = edge_keys(junctions.joined[surface.edges]), _keys(junctions)
    if not connected:
        return np.isin(keys, np.intersect1d(keys[np.unique(surface.face_edges[locked])], all_keys))
    count, ends = int(junctions.joined.max()) + 1, np.stack([all_keys >> 32, all_keys & 0xFFFFFFFF], axis=1)
    graph = sparse.coo_matrix((np.ones(len(ends)), ends.T), shape=(count, count))
    component = connected_components(graph, directed=False)[1]
    on_locked = np.intersect1d(junctions.joined[surface.faces[locked]], ends)
    return np.isin(keys, all_keys[np.isin(component[ends[:, 0]], component[on_locked])])


def _junctions_of(part: Surface, source: Ints, whole: Junctions, held: Ints, *, designed: bool) -> Junctions | None:
    """Return the junctions of a part of some sheets, with nodes at held joined points (n,); None if it has none."""
    before = whole.joined[source].astype(np.int64)
    keys = np.intersect1d(_keys(whole), edge_keys(before[part.edges]))
    if len(keys) == 0:
        return None
    on_curves = np.unique([keys >> 32, keys & 0xFFFFFFFF])
    apart = ~np.isin(before, on_curves)
    before[apart] = len(whole.joined) + np.flatnonzero(apart)
    known, joined = np.unique(before, return_inverse=True)
    ends = np.searchsorted(known, np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1))
    nodes = np.isin(known, held)
    nodes[joined[whole.graph.nodes[source]]] = True
    labels = joined.reshape(-1).astype(np.int32)
    graph = graph_of(part, labels, np.sort(edge_keys(ends)), nodes, turns_are_corners=designed)
    return replace(
        whole, sheets=part, source=whole.source[source], added=whole.added[source], joined=labels, graph=graph
    )


def _told_apart(surface: Surface, border: PointMask) -> Surface:
    """Return a surface whose border points (V,) at the same place are moved into their faces by next to nothing."""
    label = coincident(surface.points)
    several = border & (np.bincount(label, minlength=surface.n_points) > 1)[label]
    if not several.any():
        return surface
    middle = surface.points[surface.faces].mean(axis=1)
    count = sums_at_points(np.ones(surface.n_faces), surface.faces, surface.n_points)
    inside = sums_at_points(middle, surface.faces, surface.n_points) / count[:, None]
    points = np.array(surface.points)
    points[several] += _APART * (inside - points)[several]
    return surface.with_points(points)
