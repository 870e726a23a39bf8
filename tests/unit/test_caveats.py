"""What a result says about what it has lost."""

import numpy as np
import pytest

import anisomesh
from anisomesh import Mesh, Regions
from anisomesh.attributes.lost import losses_of_attributes
from anisomesh.caveats import losses_of_shape, unused_metric
from anisomesh.setup.inputs import prepared_input
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


def test_lines_that_are_not_followed_are_called_what_they_are():
    """Regression: seams of charts were called prescribed edges."""
    plane = shapes.open_patch(lambda x, y: 0.0 * x, n=20)
    corners = plane.points[plane.faces]
    inside = (np.abs(corners.mean(axis=1)[:, :2]) < 0.3).all(axis=1)
    uv = corners[..., :2] + np.where(inside, 5.0, 0.0)[:, None, None]
    for carried, words in (
        ({"corner_data": {"uv": uv}}, "seams of corner data"),
        ({"regions": {"part": Regions(inside.astype(int))}}, "borders between regions"),
    ):
        mesh = Mesh(surface=plane, **carried)
        lines = prepared_input(mesh, anisomesh.RemeshOptions()).features_at(40, plane)
        assert lines.words == words
        assert lines.edges.any()
        said = list(losses_of_shape(plane, plane, NO_CORNERS, 1.0, lines.words))
        assert said == [f"not all {words} are edges of the result; ask for more vertices"]


@pytest.mark.parametrize("offset", [0.0, 300.0])
@pytest.mark.parametrize("weld_tolerance", [0.0, "auto"])
def test_rounding_of_point_data_makes_no_seam(offset, weld_tolerance):
    """Regression: data that differ by rounding at nearly equal points counted as seams."""
    surface = shapes.box(n=4)
    soup = anisomesh.Surface(
        surface.points[surface.faces].reshape(-1, 3), np.arange(3 * surface.n_faces).reshape(-1, 3)
    )
    noise = np.random.default_rng(0).uniform(-1.0, 1.0, soup.n_points)
    points = soup.points + (0.0 if weld_tolerance == 0.0 else 1e-7) * noise[:, None]
    values = offset + soup.points[:, 0] + 1e-6 * noise
    mesh = Mesh(surface=anisomesh.Surface(points, soup.faces), point_data={"t": values})
    result = anisomesh.remesh(mesh, n_vertices=60, weld_tolerance=weld_tolerance)
    assert result.warnings == ()
    np.testing.assert_allclose(result.mesh.point_data["t"], offset + result.surface.points[:, 0], atol=1e-5)


def test_a_jump_of_point_data_is_a_seam():
    surface = shapes.box(n=4)
    soup = anisomesh.Surface(
        surface.points[surface.faces].reshape(-1, 3), np.arange(3 * surface.n_faces).reshape(-1, 3)
    )
    values = np.where((soup.face_normals[:, 2] > 0.5).repeat(3), 1e-2, 0.0) + soup.points[:, 0]
    result = anisomesh.remesh(Mesh(surface=soup, point_data={"t": values}), n_vertices=60)
    top = result.surface.face_normals[:, 2] > 0.5
    expected = result.surface.points[result.surface.faces][..., 0] + np.where(top, 1e-2, 0.0)[:, None]
    np.testing.assert_allclose(result.mesh.corner_data["t"], expected, atol=1e-9)


def test_a_fixed_point_that_no_face_uses_asks_for_no_vertices():
    box = shapes.box(n=4)
    surface = anisomesh.Surface(np.concatenate([box.points, [[9.0, 9.0, 9.0]]]), box.faces)
    before = Mesh(surface=surface, fixed_points=[0, box.n_points])
    after = Mesh(surface=box, fixed_points=[0])
    assert list(losses_of_attributes(before, after)) == ["fixed points that no face uses are left out: 1"]
    lost = list(losses_of_attributes(before, Mesh(surface=box)))
    assert "1 of 1 fixed points have no vertex of the result; ask for more vertices" in lost


@pytest.mark.parametrize(
    "asked",
    [{"edge_length": 1e9}, {"edge_length": 1e9, "metric": "uniform"}, {"max_error": 1e9}, {"size_field": 9.0}],
)
def test_a_length_larger_than_the_model_is_said(asked):
    ball = shapes.sphere(2)
    if "size_field" in asked:
        asked = {"size_field": np.full(ball.n_points, 9.0), "metric": "uniform"}
    result = anisomesh.remesh(ball, embedding="direct", **asked)
    assert any("is larger than the whole mesh" in line for line in result.warnings)
    for fine in ({"edge_length": 0.5}, {"size_field": np.full(ball.n_points, 9.0), "n_vertices": 50}):
        result = anisomesh.remesh(ball, embedding="direct", metric="uniform", **fine)
        assert not any("larger than" in line for line in result.warnings)


def test_a_distance_that_is_asked_for_together_with_sizes_or_tensors_is_said_to_count_alone():
    options = anisomesh.RemeshOptions(size_field=np.ones(4), metric="uniform")
    assert list(unused_metric(options)) == [
        "with max_error only the distance counts: edges do not have the lengths that the sizes ask for"
    ]
    assert "tensors" in next(unused_metric(anisomesh.RemeshOptions(metric=np.tile(np.eye(3), (4, 1, 1)))))
    assert not list(unused_metric(anisomesh.RemeshOptions()))
