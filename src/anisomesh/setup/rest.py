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
    kept
        Points (n,) of the whole, its sheets joined, on the junctions that locked faces touch: these stay as they are.
    """

    part: PreparedInput
    source: Ints
    kept: Ints


def rest_of(whole: PreparedInput, locked: FaceMask) -> Rest:
    """Return the part of an input that is not locked.

    Parameters
    ----------
    whole
        The input.
    locked
        Which faces (F,) of its sheets are locked; some are, and some are not.

    Notes
    -----
    Connected junctions that a locked face touches keep all their edges, as the border does. Sheets are joined there
    together with the locked faces, and at other junctions as without these.
    """
    surface = whole.prepared.surface
    kept, on_kept = _kept_junctions(whole.junctions, locked, surface)
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
        junctions = _junctions_of(part, source, whole.junctions, kept, designed=is_designed(surface))
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
    return Rest(rest, source, kept)


def _keys(junctions: Junctions) -> Ints:
    """Return the keys (n,) of the edges of junctions between joined points, ascending."""
    sides = [np.stack([curve[:-1], curve[1:]], axis=1) for curve in junctions.graph.curves]
    return np.unique(edge_keys(np.concatenate(sides)))


def _kept_junctions(junctions: Junctions | None, locked: FaceMask, surface: Surface) -> tuple[Ints, EdgeMask]:
    """Return the joined points (n,) on junctions that locked faces (F,) touch, and which edges (E,) are on these."""
    if junctions is None:
        return np.zeros(0, dtype=np.int64), np.zeros(len(surface.edges), dtype=bool)
    keys, count = _keys(junctions), int(junctions.joined.max()) + 1
    ends = np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1)
    graph = sparse.coo_matrix((np.ones(len(ends)), ends.T), shape=(count, count))
    component = connected_components(graph, directed=False)[1]
    on_locked = np.unique(junctions.joined[surface.faces[locked]])
    touched = np.isin(component[ends[:, 0]], component[np.intersect1d(on_locked, ends)])
    edges = np.isin(edge_keys(junctions.joined[surface.edges]), keys[touched])
    return np.unique(ends[touched]).astype(np.int64), np.asarray(edges)


def _junctions_of(part: Surface, source: Ints, whole: Junctions, kept: Ints, *, designed: bool) -> Junctions | None:
    """Return the junctions of a part of some sheets, except at kept joined points (n,); None if there are no others."""
    keys = _keys(whole)
    keys = keys[~np.isin(keys >> 32, kept)]
    if len(keys) == 0:
        return None
    on_curves = np.unique([keys >> 32, keys & 0xFFFFFFFF])
    before = whole.joined[source].astype(np.int64)
    apart = ~np.isin(before, on_curves)
    before[apart] = len(whole.joined) + np.flatnonzero(apart)
    known, joined = np.unique(before, return_inverse=True)
    ends = np.searchsorted(known, np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1))
    nodes = np.zeros(len(known), dtype=bool)
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
