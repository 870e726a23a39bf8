"""Embedded surfaces of bare arrays."""

from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.mesh.surface import Surface


def embedded_surface(points, faces, scale=1.0):
    """Return the surface of points (V, d) and faces (F, 3) whose first three coordinates are space times ``scale``."""
    return EmbeddedSurface(Surface(points[:, :3] / scale, faces), points, scale=scale)
