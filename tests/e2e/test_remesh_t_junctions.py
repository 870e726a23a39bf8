"""Borders, seams and prescribed edges are followed where the two sides of a line are cut at different points."""

import numpy as np
import pytest

import anisomesh
from anisomesh import Mesh, Regions, Surface


def grid(low, high, n):
    """Points and faces of the rectangle from x = low to high and y = 0 to 1, with n cells along y."""
    x, y = np.meshgrid(np.linspace(low, high, 9), np.linspace(0.0, 1.0, n + 1), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))])
    return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1), faces


def sheet(*cells):
    """Two rectangles that meet at x = 1, cut into numbers of cells along this line, and the one of each face."""
    (left, first), (right, second) = grid(0.0, 1.0, cells[0]), grid(1.0, 2.0, cells[1])
    surface = Surface(np.concatenate([left, right]), np.concatenate([first, second + len(left)]))
    return surface, np.repeat([1, 2], [len(first), len(second)])


def crossing(surface):
    """The number of faces on both sides of x = 1."""
    x = surface.points[surface.faces][..., 0]
    return np.count_nonzero((x.min(axis=1) < 1.0 - 1e-9) & (x.max(axis=1) > 1.0 + 1e-9))


def with_a_flat_face():
    """A square of two regions, with a face without area between the long side of one and the two sides of the other."""
    points = [(0, 0, 0), (2, 0, 0), (1, 0, 0), (2, 1, 0), (0, 1, 0), (2, -1, 0), (0, -1, 0)]
    faces = [(0, 1, 3), (0, 3, 4), (0, 2, 1), (6, 2, 0), (6, 5, 2), (5, 1, 2)]
    return Surface(np.array(points, dtype=float), np.array(faces)), np.array([1, 1, 2, 2, 2, 2])


@pytest.mark.parametrize("cells", [(5, 10), (10, 5), (4, 7)])
@pytest.mark.parametrize("metric", ["curvature", "approximation"])
def test_the_border_of_a_region_is_followed(cells, metric):
    surface, labels = sheet(*cells)
    mesh = Mesh(surface=surface, regions={"part": Regions(labels)})
    result = anisomesh.remesh(mesh, n_vertices=150, metric=metric)
    assert result.prepare_report.sides_split > 0
    assert crossing(result.surface) == 0
    areas = np.bincount(result.mesh.regions["part"].labels, result.surface.face_areas)
    np.testing.assert_allclose(areas, [0.0, 1.0, 1.0], atol=1e-9)
    assert result.warnings == ()


@pytest.mark.parametrize("given_as", ["mesh", "option"])
def test_prescribed_edges_are_followed(given_as):
    surface, _ = sheet(5, 10)
    on_line = (surface.points[surface.edges][..., 0] == 1.0).all(axis=1)
    lines = surface.edges[on_line & (surface.edges < 9 * 6).all(axis=1)]  # of the left rectangle
    assert len(lines) == 5
    if given_as == "mesh":
        result = anisomesh.remesh(Mesh(surface=surface, features=lines), n_vertices=150)
        ends = result.surface.points[result.mesh.features]
        np.testing.assert_allclose(np.linalg.norm(np.diff(ends, axis=1), axis=2).sum(), 1.0)
    else:
        result = anisomesh.remesh(surface, n_vertices=150, features=lines)
    assert crossing(result.surface) == 0
    assert result.warnings == ()


def test_a_border_beside_a_face_without_area_is_followed():
    surface, labels = with_a_flat_face()
    for of_flat_face in (1, 2):
        labels[2] = of_flat_face
        result = anisomesh.remesh(Mesh(surface=surface, regions={"part": Regions(labels)}), n_vertices=60)
        areas = np.bincount(result.mesh.regions["part"].labels, result.surface.face_areas)
        np.testing.assert_allclose(areas, [0.0, 2.0, 2.0], atol=1e-9)
    result = anisomesh.remesh(Mesh(surface=surface, features=[[0, 1]]), n_vertices=60)
    ends = result.surface.points[result.mesh.features]
    np.testing.assert_allclose(np.linalg.norm(np.diff(ends, axis=1), axis=2).sum(), 2.0)


@pytest.mark.parametrize("jump", [0.0, 3.0])
def test_texture_coordinates_are_exact_with_and_without_a_seam(jump):
    surface, labels = sheet(4, 7)

    def uv(of, side):
        return of.points[of.faces][..., :2] + np.where(side == 2, jump, 0.0)[:, None, None]

    mesh = Mesh(surface=surface, corner_data={"uv": uv(surface, labels)})
    result = anisomesh.remesh(mesh, n_vertices=150)
    side = np.where(result.surface.points[result.surface.faces][..., 0].mean(axis=1) > 1.0, 2, 1)
    assert crossing(result.surface) == 0 if jump else crossing(result.surface) > 0
    np.testing.assert_allclose(result.mesh.corner_data["uv"], uv(result.surface, side), atol=1e-9)
