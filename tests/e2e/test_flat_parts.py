"""Parts with flat faces and straight creases: corners exactly kept, flat faces exactly flat, creases but for little."""

import igl
import numpy as np
import pytest

import anisomesh
from anisomesh.surface.features import corners, points_along, sharp_edges
from anisomesh.surface.mesh import Surface
from anisomesh.surface.shapes import box


def bracket():
    """Return an L-shaped bar of twelve corners, with the fewest triangles."""
    outline = np.array([[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [0, 2.0]])
    lower, upper = (np.pad(outline, ((0, 0), (0, 1)), constant_values=z) for z in (0.0, 0.5))
    cap = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    k, after = np.arange(6), np.roll(np.arange(6), -1)
    walls = [np.stack([k, after, after + 6], axis=1), np.stack([k, after + 6, k + 6], axis=1)]
    return Surface(np.concatenate([lower, upper]), np.concatenate([cap[:, ::-1], cap + 6, *walls]))


PARTS = {
    "cube of twelve triangles": (lambda: box(n=1), 200),
    "cube at a fifth": (lambda: box(n=4), 20),
    "slab": (lambda: box((3.0, 2.0, 0.2), n=3), 200),
    "rod": (lambda: box((0.3, 0.3, 4.0), n=2), 120),
    "bracket": (bracket, 200),
}


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", PARTS)
def test_corners_and_planes_are_exact_and_creases_covered(name, seed):
    make, n = PARTS[name]
    part = make()
    result = anisomesh.remesh(part, n_vertices=n, seed=seed)
    new, size = result.surface, part.diagonal
    sharp = sharp_edges(part, 45.0)
    at_corner = part.points[corners(part, sharp)]
    nearest = np.linalg.norm(new.points[:, None] - at_corner[None], axis=2).min(axis=0)
    assert nearest.max() < 1e-6 * size
    off = np.sqrt(igl.point_mesh_squared_distance(new.points, part.points, part.faces.astype(np.int64))[0])
    assert off.max() < 1e-6 * size
    bent = new.edges[sharp_edges(new, 22.5)].astype(np.int64)
    along = np.ascontiguousarray(points_along(part, sharp, 1e-3 * size))
    tree = igl.AABB()
    tree.init(new.points, bent)
    from_crease = np.sqrt(tree.squared_distance(new.points, bent, along)[0])
    # a cell that reaches into two creases, but not to the corner between them, can leave one of them cut off
    assert (from_crease < 1e-6 * size).mean() > 0.97
    assert new.n_points == n
    assert result.validity.euler == 2
    assert result.validity.flipped == 0
