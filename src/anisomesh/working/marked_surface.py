"""A surface on its way to better triangles: with marks on its edges, and how far it has moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh._arrays import EdgeLabels, FaceMask, FaceScalars
from anisomesh._kernels.triangulation import Triangulation
from anisomesh.mesh.surface import Surface


@dataclass(frozen=True, kw_only=True, eq=False)
class MarkedSurface:
    """A surface with marks on its edges, and how far it is from the surface that it was made from.

    Attributes
    ----------
    surface
        The surface.
    labels
        A label for each of its edges (E,): edges of another label than 0 are kept, up to the tolerance of a change.
    deviation
        Bound on the distance of each of its faces (F,) from the first surface, in model units.
    """

    surface: Surface
    labels: EdgeLabels
    deviation: FaceScalars

    @classmethod
    def unmoved(cls, surface: Surface, labels: EdgeLabels) -> MarkedSurface:
        """Return a surface that has not moved, with these labels of its edges (E,)."""
        return cls(surface=surface, labels=labels, deviation=np.zeros(surface.n_faces))

    @classmethod
    def of(cls, surface: Surface, mesh: Triangulation, faces: FaceMask) -> MarkedSurface:
        """Return a surface whose faces are the chosen ones of a triangulation, with their labels and deviation."""
        labels = np.zeros(len(surface.edges), dtype=mesh.labels.dtype)
        labels[surface.face_edges] = mesh.labels[faces]
        return cls(surface=surface, labels=labels, deviation=mesh.deviation[faces].copy())

    def triangulation(self, max_faces: int) -> Triangulation:
        """Return the surface in arrays with room for ``max_faces`` faces and as many points as they can have."""
        surface = self.surface
        max_points = surface.n_points + max_faces - surface.n_faces
        mesh = Triangulation(
            points=np.zeros((max_points, 3)),
            faces=np.empty((max_faces, 3), dtype=np.int32),
            neighbours=np.full((max_faces, 3), -1, dtype=np.int32),
            labels=np.zeros((max_faces, 3), dtype=self.labels.dtype),
            parents=np.zeros((max_points, 2), dtype=np.int32),
            deviation=np.zeros(max_faces),
            stack=np.empty(max_faces, dtype=np.int32),
        )
        mesh.points[: surface.n_points] = surface.points
        mesh.faces[: surface.n_faces] = surface.faces
        mesh.neighbours[: surface.n_faces] = surface.face_neighbours
        mesh.labels[: surface.n_faces] = self.labels[surface.face_edges]
        mesh.deviation[: surface.n_faces] = self.deviation
        return mesh
