"""Edges of the dual: chains of bisector segments between two vertices of the diagram."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from anisomesh.voronoi.diagram import Diagram


def dual_edges(diagram: Diagram) -> npt.NDArray[np.int32]:
    """Return the dual edge that each polygon edge belongs to (Q,), -1 for edges on a side of a facet.

    Notes
    -----
    On a facet the cells of two sites share at most one segment, and on a mesh edge their bisector has at most one
    point. So a segment is identified by facet and pair of sites, and is continued across a mesh edge by the segment
    with the same pair. Two sites can share several chains of segments; each is a separate edge of the dual.
    """
    face_edges = diagram.embedded.surface.face_edges
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
    continued = np.flatnonzero((name[1:] == name[:-1]).all(axis=1))
    pair = which[crossing][order]
    links = coo_array(
        (np.ones(len(continued), dtype=np.int8), (pair[continued], pair[continued + 1])), shape=(len(segments),) * 2
    )
    result = np.full(len(label), -1, dtype=np.int32)
    result[segments] = connected_components(links, directed=False)[1]
    result[diagram.twin[segments]] = result[segments]
    return result
