"""Meshes whose triangles are unrelated to the curvature of the shape."""

from __future__ import annotations

import numpy as np

from anisomesh.learn.data.remesher import REMESH_SECONDS, Remesher
from anisomesh.mesh.surface import Surface

STRETCH_RANGE = (2.0, 5.0)
"""Least and largest stretch of the triangles."""


def with_random_triangles(surface: Surface, n_vertices: int, rng: np.random.Generator, remesher: Remesher) -> Surface:
    """Return a mesh of a surface with about ``n_vertices`` vertices, its triangles stretched in a random direction."""
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    square = rng.uniform(*STRETCH_RANGE) ** 2
    tensor = np.eye(3) + (square - 1.0) * np.outer(direction, direction)
    tensors = np.tile(tensor, (surface.n_points, 1, 1))
    return remesher(surface, n_vertices=n_vertices, metric=tensors, threads=1, time_limit=REMESH_SECONDS).surface
