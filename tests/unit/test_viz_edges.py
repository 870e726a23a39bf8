"""Edges fade as triangles get smaller on the screen, and disappear where they would cover everything."""

from itertools import pairwise

import numpy as np
import pytest

from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import box, sphere
from anisomesh.viz.camera import View, camera_axes, framed
from anisomesh.viz.edges import edge_style, in_view
from conftest import torus_arrays

SIZE = (400, 300)


def style(surface, view=None, size=SIZE, scale=1.0):
    axes = camera_axes(surface.points)
    return edge_style(surface, view or framed(surface.points, axes, size[0] / size[1]), size, scale)


def test_the_denser_the_mesh_the_paler_its_edges_until_there_are_none():
    styles = [style(sphere(level)) for level in range(1, 8)]
    drawn = [found for found in styles if found is not None]
    assert styles[: len(drawn)] == drawn
    assert 3 <= len(drawn) < len(styles)
    strength = [found.width * found.opacity for found in drawn]
    assert all(after < before for before, after in pairwise(strength[1:]))
    assert drawn[0].opacity > 0.8


@pytest.mark.parametrize("around", [20, 60, 120])
def test_edges_darken_no_more_than_a_quarter_of_the_picture(around):
    surface = Surface(*torus_arrays(around, around // 2))
    found = style(surface)
    view = framed(surface.points, camera_axes(surface.points), SIZE[0] / SIZE[1])
    pixels = 0.5 * SIZE[1] / view.half_height
    length = pixels * surface.edge_lengths.sum()
    assert found.width * found.opacity * length <= 0.25 * pixels**2 * surface.area


def test_what_counts_are_the_triangles_in_view():
    coarse, fine = box((1.0, 1.0, 0.1), 2), box((1.0, 1.0, 0.1), 90)
    points = np.concatenate([coarse.points - [1.5, 0, 0], fine.points])
    surface = Surface(points, np.concatenate([coarse.faces, fine.faces + coarse.n_points]))
    views = [View(centre=np.array([x, 0.5, 0.1]), axes=np.eye(3), half_height=0.4) for x in (-1.0, 0.5)]
    at_coarse, at_fine = (style(surface, view) for view in views)
    assert at_coarse.opacity > 2 * at_fine.opacity
    inside = in_view(surface, views[0], SIZE[0] / SIZE[1])
    assert inside.any()
    assert not inside[coarse.n_faces :].any()


def test_more_pixels_bring_edges_back():
    surface = sphere(6)
    assert style(surface) is None
    assert style(surface, size=(1600, 1200), scale=4) is not None


def test_a_mesh_without_area_has_no_edges_to_draw():
    surface = Surface(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    assert style(surface) is None
