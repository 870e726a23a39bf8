"""The outlines of Voronoi cells are closed and lie between different cells."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

import anisomesh
from anisomesh.mesh.surface import Surface
from anisomesh.viz.cells import CellPolygons, voronoi_cells
from conftest import torus_arrays


def squares(n, labels, shared):
    """Return a grid of n x n unit squares as cells, with shared points or points of their own."""
    i, j = np.divmod(np.arange(n * n), n)
    corners = np.stack([i * (n + 1) + j, (i + 1) * (n + 1) + j, (i + 1) * (n + 1) + j + 1, i * (n + 1) + j + 1], axis=1)
    x, y = np.divmod(np.arange((n + 1) ** 2), n + 1)
    points = np.stack([x, y, 0 * x], axis=1).astype(float)
    if not shared:
        points, corners = points[corners.ravel()], np.arange(4 * n * n)
    return CellPolygons(
        points=points, offsets=4 * np.arange(n * n + 1), corners=corners.ravel(), labels=np.asarray(labels)
    )


@pytest.mark.parametrize("shared", [True, False])
def test_two_halves_have_their_own_rims(shared):
    n = 6
    cells = squares(n, np.arange(n * n) // n < n // 2, shared)
    lengths = np.linalg.norm(np.diff(cells.points[cells.outlines()], axis=1)[:, 0], axis=1)
    assert cells.n_cells == 2
    assert lengths.sum() == pytest.approx(2 * (2 * n + 2 * n / 2))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_the_outline_of_real_cells_is_closed_and_shared_by_two_cells(seed):
    surface = Surface(*torus_arrays(24, 12))
    result = anisomesh.remesh(surface, n_vertices=60, seed=seed, threads=1)
    cells = voronoi_cells(result.polygons())
    ends = cells.points[cells.outlines()].reshape(-1, 3)
    near = cKDTree(ends).query_ball_point(ends, 1e-6)  # rounding would part places at the limit
    place = np.array([min(points) for points in near]).reshape(-1, 2)
    assert (np.bincount(place.ravel()) % 2 == 0).all()
    _, count = np.unique(np.sort(place, axis=1), axis=0, return_counts=True)
    assert (count == 2).all()
    assert cells.n_cells >= 60
