"""Prescribe the stretch of the triangles by a metric of your own.

A metric is one symmetric positive definite 3 x 3 matrix per point of the input as it is passed, in model units and
axes: an edge ``e`` counts as ``sqrt(e @ M @ e)`` long, and the result has triangles that are about equilateral in that
length. Only ratios of lengths matter, since ``n_vertices`` sets the size. Here edges along z count a third of their
length, so that the triangles become about three times as long along z as across.
"""

import numpy as np

import anisomesh


def stretched_along_z(surface: anisomesh.Surface, factor: float) -> np.ndarray:
    """Return a metric (V, 3, 3) in which lengths along z are divided by ``factor``."""
    return np.broadcast_to(np.diag([1.0, 1.0, 1.0 / factor**2]), (surface.n_points, 3, 3)).copy()


def cylinder(around: int = 96, along: int = 60, height: float = 4.0) -> anisomesh.Surface:
    """Return an open cylinder of radius 1 along z."""
    angle, z = np.meshgrid(2 * np.pi * np.arange(around) / around, np.linspace(0.0, height, along), indexing="ij")
    points = np.stack([np.cos(angle), np.sin(angle), z], axis=-1).reshape(-1, 3)
    index = np.arange(around * along).reshape(around, along)
    a, b = index[:, :-1], np.roll(index, -1, axis=0)[:, :-1]
    faces = [np.stack([a, b, b + 1], axis=-1), np.stack([a, b + 1, a + 1], axis=-1)]
    return anisomesh.Surface(points, np.concatenate(faces).reshape(-1, 3))


def main(n_vertices: int = 600, factor: float = 3.0) -> anisomesh.RemeshResult:
    surface = cylinder()
    metric = stretched_along_z(surface, factor)
    result = anisomesh.remesh(surface, n_vertices=n_vertices, metric=metric)
    edges = result.surface.points[result.surface.edges]
    size = np.abs(edges[:, 1] - edges[:, 0])
    print(f"mean extent of an edge along z: {size[:, 2].mean():.3f}, across: {np.hypot(*size[:, :2].T).mean():.3f}")
    return result


if __name__ == "__main__":
    main()
