"""Reduction of a dense input to what the vertices asked for can show, before anything is measured on it."""

from __future__ import annotations

import logging
import math
from dataclasses import replace

import numpy as np

from anisomesh._arrays import PointMask
from anisomesh.mesh.intersections import self_intersections
from anisomesh.mesh.topology import edge_keys
from anisomesh.meshops.held import points_near_faces
from anisomesh.meshops.reduction import Reduced, reduce_points
from anisomesh.options import RemeshOptions
from anisomesh.setup.inputs import PreparedInput

logger = logging.getLogger(__name__)

_POINTS_PER_VERTEX, _POINTS_PER_NEAREST = 16, 48  # of the reduced surface; the second if the distance is what counts
_LEAST_POINTS = 20_000  # of a reduced surface
_LEAST_FACTOR = 1.5  # points before over points after: where there are fewer, reducing saves next to nothing
_MAX_RETRIES = 2  # with points held where faces intersect
_LEAST_RINGS = 2
_TAGGED, _BORDER, _SEAM = 1, 2, 4  # bits of the labels of edges


def reduced(source: PreparedInput, n_vertices: int, options: RemeshOptions, *, nearest: bool = False) -> PreparedInput:
    """Return an input with fewer points where it has many more than a mesh of some vertices can show.

    Parameters
    ----------
    source
        The input.
    n_vertices
        Vertices of the mesh.
    options
        Where the metric, sizes or a density are prescribed, triangles can be much smaller than on average, and the
        input stays.
    nearest
        Whether the distance is all that counts, so that more points stay.

    Returns
    -------
    PreparedInput
        A surface of some of the points, about sixteen for each vertex or 20,000 in all: its distance from the input
        is a small part of the distance to be expected of the mesh, which falls with one over the vertices. Its topology
        is the same, fixed points and prescribed lines stay, and it intersects itself only where the input does. The
        input itself if it has less than half as many points again, or sheets that are to be joined.
    """
    surface = source.prepared.surface
    wanted = max(_LEAST_POINTS, (_POINTS_PER_NEAREST if nearest else _POINTS_PER_VERTEX) * n_vertices)
    is_dense = options.reduce and surface.n_points > _LEAST_FACTOR * wanted
    if not is_dense or source.junctions is not None or _prescribes(source, options):
        return source
    result = _reduced_surface(source, wanted)
    if result is None:
        logger.info("the input is not reduced, since it would intersect itself")
        return source
    logger.info("input reduced from %s to %s points", f"{surface.n_points:,}", f"{result.surface.n_points:,}")
    return _on_reduced(source, result)


def _prescribes(source: PreparedInput, options: RemeshOptions) -> bool:
    """Return whether a user says how large triangles are, which can be very different from place to place."""
    given = (source.tensors, source.density, source.solution, options.size_field)
    return any(each is not None for each in given) or not isinstance(options.metric, str)


def _reduced_surface(source: PreparedInput, wanted: int) -> Reduced | None:
    """Return the reduced surface, None if it intersects itself where the input does not."""
    surface = source.prepared.surface
    labels = _TAGGED * source.tagged + _BORDER * source.borders + _SEAM * source.seams
    held: PointMask = np.array(source.fixed)
    for repeat in range(_MAX_RETRIES + 1):
        result = reduce_points(surface, wanted, held=held, labels=labels.astype(np.int32))
        pairs = self_intersections(result.surface)
        if len(pairs) == 0 or (repeat == 0 and len(self_intersections(surface)) > 0):
            return result
        held |= points_near_faces(surface, result.surface, np.unique(pairs).astype(np.int32), rings=2 + 2 * repeat)
    return None


def _on_reduced(source: PreparedInput, result: Reduced) -> PreparedInput:
    """Return an input on a surface of some of its points.

    Curvature is fitted over fewer rings of the longer edges, so over about the same part of the surface.
    """
    surface, kept = result.surface, result.kept
    outline = edge_keys(source.prepared.surface.edges[source.outline])
    prepared = replace(
        source.prepared,
        surface=surface,
        point_source=source.prepared.point_source[kept],
        junctions=np.zeros(len(surface.edges), dtype=bool),
    )
    return replace(
        source,
        prepared=prepared,
        sizes=None if source.sizes is None else source.sizes[kept],
        tagged=(result.labels & _TAGGED) != 0,
        borders=(result.labels & _BORDER) != 0,
        seams=(result.labels & _SEAM) != 0,
        fixed=source.fixed[kept],
        outline=np.isin(edge_keys(kept[surface.edges]), outline),
        rings=max(_LEAST_RINGS, round(source.rings * math.sqrt(len(kept) / source.prepared.surface.n_points))),
    )
