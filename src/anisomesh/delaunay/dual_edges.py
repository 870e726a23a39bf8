"""Edges of the dual: the chains of bisector segments between two vertices of the diagram."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from anisomesh._arrays import FaceIndices
from anisomesh.voronoi.diagram import Diagram


def chains(diagram: Diagram, face_edges: FaceIndices) -> npt.NDArray[np.int32]:
    """Return the chain that each polygon edge belongs to (Q,), -1 for edges on a side of a facet.

    Parameters
    ----------
    diagram
        The diagram.
    face_edges
        Mesh edge opposite each corner (F, 3) of the faces of the diagram.

    Notes
    -----
    On a facet the cells of two sites share at most one segment, and on a mesh edge their bisector has at most one
    point: so a segment is named by facet and pair, and goes on across a mesh edge in the segment with the same
    pair. Two sites can share several chains; each is an edge of the dual on its own.
    """
    own = diagram.site[diagram.polygon_of].astype(np.int64)
    label = diagram.label.astype(np.int64)
    segments = np.flatnonzero(label > own)
    ends = np.concatenate([segments, diagram.following[segments]])
    side = np.concatenate([diagram.label[diagram.previous[segments]], diagram.label[diagram.following[segments]]])
    which = np.tile(np.arange(len(segments)), 2)
    crossing = np.flatnonzero(side < 0)
    facet = diagram.facet[diagram.polygon_of[ends[crossing]]]
    mesh_edge = face_edges[facet, -1 - side[crossing]]
    segment = segments[which[crossing]]
    order = np.lexsort((label[segment], own[segment], mesh_edge))
    name = np.stack([mesh_edge, own[segment], label[segment]], axis=1)[order]
    same = np.flatnonzero((name[1:] == name[:-1]).all(axis=1))
    pair = which[crossing][order]
    links = coo_array((np.ones(len(same), dtype=np.int8), (pair[same], pair[same + 1])), shape=(len(segments),) * 2)
    chain = np.full(len(label), -1, dtype=np.int32)
    chain[segments] = connected_components(links, directed=False)[1]
    chain[diagram.twin[segments]] = chain[segments]
    return chain
