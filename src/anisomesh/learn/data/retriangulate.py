"""The same shape with triangles that have nothing to do with its curvature."""

from __future__ import annotations

import numpy as np

from anisomesh.mesh.surface import Surface
from anisomesh.pipeline import remesh

RATIOS = (2.0, 5.0)
"""Least and largest stretch of the triangles."""

_SECONDS = 120.0  # for a remesh


def with_random_triangles(surface: Surface, n_vertices: int, rng: np.random.Generator) -> Surface:
    """Return a mesh of a surface of about so many vertices, its triangles stretched in a random direction."""
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    square = rng.uniform(*RATIOS) ** 2
    tensor = np.eye(3) + (square - 1.0) * np.outer(direction, direction)
    tensors = np.tile(tensor, (surface.n_points, 1, 1))
    return remesh(surface, n_vertices=n_vertices, metric=tensors, threads=1, time_limit=_SECONDS).surface
