"""What a result says about what it has lost."""

import numpy as np
import pytest

import anisomesh
from anisomesh.caveats import losses_of_shape
from anisomesh.shapes import analytic as shapes

CORNERS = np.array([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
NO_CORNERS = np.zeros((0, 3))


def test_a_box_that_is_exact_has_lost_nothing():
    box = shapes.box(n=4)
    assert list(losses_of_shape(box, shapes.box(n=1), CORNERS)) == []


def test_corners_without_a_vertex_are_counted():
    box = shapes.box(n=4)
    cut = shapes.box(n=2)
    points = np.array(cut.points)
    points[np.isclose(points, 1.0).all(axis=1)] -= 0.05
    (sentence,) = losses_of_shape(box, cut.with_points(points), CORNERS)
    assert sentence == "1 of 8 corners have no vertex; ask for more vertices"


@pytest.mark.parametrize(("factor", "words"), [(1.03, "9% larger"), (0.97, "9% smaller"), (1.01, None)])
def test_a_change_of_volume_is_said(factor, words):
    sphere = shapes.sphere(3)
    found = list(losses_of_shape(sphere, sphere.with_points(factor * sphere.points), NO_CORNERS))
    assert len(found) == (words is not None)
    assert words is None or words in found[0]


def test_open_surfaces_have_no_volume():
    patch = shapes.open_patch(lambda x, y: x * y, n=5)
    assert patch.volume is None
    assert list(losses_of_shape(patch, patch.with_points(3.0 * patch.points), NO_CORNERS)) == []


def test_volumes_do_not_depend_on_the_place():
    box = shapes.box(extent=(1.0, 2.0, 3.0), n=3)
    for shift in (0.0, 1e6):
        assert box.with_points(box.points + shift).volume == pytest.approx(6.0, rel=1e-6)


def test_too_few_vertices_for_the_corners_are_said():
    teeth = anisomesh.Surface(*_comb(12))
    few = anisomesh.remesh(teeth, n_vertices=24, embedding="direct")
    assert any("corners have no vertex" in warning for warning in few.warnings)
    enough = anisomesh.remesh(teeth, n_vertices=200, embedding="direct")
    assert not any("corners" in warning for warning in enough.warnings)


def _comb(n):
    """Return points and faces of a closed strip of n teeth: four rows of points along x, joined by quadrilaterals."""
    x = np.arange(2 * n + 1, dtype=float)
    height, zero = 1.0 + x % 2, 0.0 * x
    rows = [(zero, zero), (zero + 1.0, zero), (zero + 1.0, height), (zero, height)]  # depth and height around the strip
    points = np.concatenate([np.stack([x, depth, up], axis=1) for depth, up in rows])
    m = len(x)
    quads = [
        (r * m + i, r * m + i + 1, (r + 1) % 4 * m + i + 1, (r + 1) % 4 * m + i) for r in range(4) for i in range(m - 1)
    ]
    quads += [(0, m, 2 * m, 3 * m), (4 * m - 1, 3 * m - 1, 2 * m - 1, m - 1)]
    faces = [(q[0], q[k + 1], q[k]) for q in quads for k in (1, 2)]
    return points, np.array(faces)
