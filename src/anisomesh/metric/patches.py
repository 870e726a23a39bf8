"""The smooth patches of a surface: the surface cut open along its creases, on which curvature is measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, FaceLabels, PointLabels, PointTensors
from anisomesh.features.creases import select_creases
from anisomesh.features.detect import sharp_edges
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import connected_components, corner_fans, side_pairs
from anisomesh.metric.field import MetricField, mean_at_points


@dataclass(frozen=True, eq=False)
class SmoothPatches:
    """A surface cut open along creases.

    Attributes
    ----------
    whole
        The surface.
    surface
        The same faces, with a point of its own (V',) for each fan of faces between creases; the surface itself without
        creases.
    source
        Point of the whole surface for each of these points (V',).
    """

    whole: Surface
    surface: Surface
    source: PointLabels

    @property
    def labels(self) -> FaceLabels:
        """Number of the patch of each face (F,)."""
        return connected_components(self.surface.faces, self.surface.n_points)[1]

    def field(self, tensors: PointTensors) -> MetricField:
        """Return tensors (V', 3, 3) on the patches as a metric field of the whole surface, averaged at its points."""
        if self.surface is self.whole:
            return MetricField(tensors=tensors)
        corners = tensors[self.surface.faces]
        return MetricField(tensors=mean_at_points(self.whole, corners), corner_tensors=corners, patch=self.labels)


def smooth_patches(surface: Surface, crease_angle: float, neighbourhood: int) -> SmoothPatches:
    """Return the smooth patches of a surface.

    Parameters
    ----------
    surface
        A manifold surface.
    crease_angle
        Edges whose dihedral angle deviates from flat by more degrees than this are on creases; 180 for none.
    neighbourhood
        Rings of edges over which curvature is fitted. Creases shorter than the neighbourhood, and short ones with loose
        ends as on rough scans, do not separate it and are ignored.
    """
    spacing = neighbourhood * float(surface.edge_lengths.mean())
    sharp = sharp_edges(surface, crease_angle)
    none = np.zeros_like(sharp)
    if sharp.any():
        creases = select_creases(surface.points, surface, sharp, required=none, spacing=spacing, max_length=np.inf)
        sharp = np.array(none)
        sharp[creases.edge] = True
    return cut_along(surface, sharp)


def cut_along(surface: Surface, edges: EdgeMask) -> SmoothPatches:
    """Return a surface cut open along edges (E,)."""
    if not edges.any():
        return SmoothPatches(surface, surface, np.arange(surface.n_points, dtype=np.int32))
    pairs = side_pairs(surface.faces)
    glued = pairs[~edges[surface.face_edges.ravel()[pairs[:, 0]]]]
    n_points, fan = corner_fans(surface.faces, glued)
    source: npt.NDArray[np.int32] = np.zeros(n_points, dtype=np.int32)
    source[fan] = surface.faces.ravel()
    return SmoothPatches(surface, Surface(surface.points[source], fan.reshape(-1, 3)), source)
