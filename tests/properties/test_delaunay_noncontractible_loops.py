"""Noncontractible loops in non-disk cells: they are tight, and sites on them cut the cells open."""

import numpy as np
import pytest
from delaunay_cases import assert_closed_manifold, mesh_of

from anisomesh.delaunay.noncontractible_loops import points_on_noncontractible_loops
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.mesh.surface import Surface
from anisomesh.shapes import analytic as shapes
from anisomesh.shapes.patches import grid_faces
from anisomesh.voronoi.cells import cell_complex
from anisomesh.voronoi.restricted import RestrictedVoronoi


def spindle(height):
    """Return a cone on a disk, rings ever closer towards the apex, and its points as a function of radius and angle."""
    turn, radii = 2.0 * np.pi * np.arange(24) / 24, np.geomspace(1.0, 1e-4, 60)

    def at(radius, angle):
        return np.stack(
            np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle), height * (1.0 - radius)), axis=-1
        )

    wall = at(radii[:, None], turn).reshape(-1, 3)
    foot, tip, last = len(wall), len(wall) + 1, len(wall) - 24
    here, there = np.arange(24), (np.arange(24) + 1) % 24
    ends = [(np.full(24, foot), there, here), (last + here, last + there, np.full(24, tip))]
    faces = [grid_faces(60, 24, wrap_columns=True)[:, ::-1], *(np.stack(end, axis=1) for end in ends)]
    points = np.concatenate([wall, [[0.0, 0.0, 0.0], [0.0, 0.0, height]]])
    return Surface(points, np.concatenate(faces)), at


def loops_of(surface, sites, points=None):
    """Return the cells of these sites, and the points on noncontractible loops in them."""
    voronoi = RestrictedVoronoi(EmbeddedSurface(surface, surface.points if points is None else points))
    cells = cell_complex(voronoi.diagram(np.asarray(sites, dtype=float)))
    return cells, points_on_noncontractible_loops(cells)


TUBE = shapes.cylinder(radius=1.0, height=40.0, n_around=30, n_along=40, closed=False)
TORUS = shapes.torus(n_major=48, n_minor=20)


@pytest.mark.parametrize("angle", [0.0, 1.0, 3.0])
def test_two_points_divide_a_loop_around_a_tube_in_three_with_the_site(angle):
    site = np.array([np.cos(angle), np.sin(angle), 20.3])
    cells, points = loops_of(TUBE, [site])
    assert cells.euler.tolist() == [0]
    assert len(points) == 2
    turns = np.sort(np.mod(np.arctan2(points[:, 1], points[:, 0]) - angle, 2.0 * np.pi))
    np.testing.assert_allclose(turns, [2.0 * np.pi / 3.0, 4.0 * np.pi / 3.0], atol=0.3)
    assert np.abs(points[:, 2] - site[2]).max() < 1.0
    assert (loops_of(TUBE, np.concatenate([[site], points]))[0].euler == 1).all()


def test_the_loop_on_a_torus_is_the_short_one():
    cells, points = loops_of(TORUS, [[1.35, 0.0, 0.0]])
    assert cells.euler.tolist() == [0]
    assert len(points) == 2
    assert np.abs(np.arctan2(points[:, 1], points[:, 0])).max() < 0.2  # around the tube, at the angle of the site
    assert np.linalg.norm(points[0] - points[1]) > 0.4


def test_points_are_on_the_embedded_surface():
    rng = np.random.default_rng(3)
    embedded = np.column_stack([TORUS.points, rng.normal(scale=0.1, size=(TORUS.n_points, 5))])
    _, points = loops_of(TORUS, embedded[[0, 400]], embedded)
    assert len(points)
    corners = embedded[TORUS.faces]
    for point in points:  # barycentric coordinates by least squares in each face
        basis = corners[:, 1:] - corners[:, :1]
        share = np.einsum("fkd,fd->fk", np.linalg.pinv(basis.transpose(0, 2, 1)), point - corners[:, 0])
        off = np.linalg.norm(corners[:, 0] + np.einsum("fk,fkd->fd", share, basis) - point, axis=1)
        inside = (share >= -1e-9).all(axis=1) & (share.sum(axis=1) <= 1.0 + 1e-9)
        assert off[inside].min() < 1e-9


def test_the_loop_around_a_hole_far_from_the_site_is_tight():
    """Both points on a loop that leads to the hole and back would lie side by side."""
    sheet = shapes.open_patch(lambda x, y: 0.0)
    hole = np.array([0.6, 0.6, 0.0])
    near = np.linalg.norm(sheet.points[sheet.faces].mean(axis=1) - hole, axis=1) < 0.1
    used, faces = np.unique(sheet.faces[~near], return_inverse=True)
    holed = Surface(sheet.points[used], faces.reshape(-1, 3))
    cells, points = loops_of(holed, [[-0.7, -0.7, 0.0]])
    assert cells.euler.tolist() == [0]
    assert len(points) == 3
    assert np.linalg.norm(points - hole, axis=1).max() < 0.3
    assert np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1).min() > 0.1


@pytest.mark.parametrize(
    ("surface", "euler"),
    [(shapes.sphere(3), 2), (shapes.open_patch(lambda x, y: x * y, n=9), 1)],
    ids=["sphere", "disk"],
)
def test_cells_without_a_noncontractible_loop_get_no_points(surface, euler):
    cells, points = loops_of(surface, surface.points[:1])
    assert cells.euler.tolist() == [euler]
    assert points.shape == (0, 3)


def test_disks_get_no_points():
    cells, points = loops_of(TORUS, TORUS.points[::3])
    assert (cells.euler == 1).all()
    assert points.shape == (0, 3)


def test_a_cell_around_a_cone_does_not_attract_sites_to_the_apex():
    """Regression: new sites far from the old one approached the apex each round, and the input was coarsened."""
    surface, at = spindle(5.5)
    rings = [at(radius, k + 2.1 * np.arange(3)) for k, radius in enumerate(np.geomspace(0.2, 0.95, 8))]
    sites = np.concatenate([*rings, [[0.0, 0.0, 0.0]], at(np.array([0.1, 0.01]), np.array([0.0, 2.0]))])
    result = mesh_of(RestrictedVoronoi(EmbeddedSurface.in_space(surface)), sites)
    assert not result.from_input
    assert result.inserted < 10
    assert_closed_manifold(result.faces, 2)
    assert np.sqrt(ClosestPoints(surface).squared_distances(result.points)).max() < 0.1
