"""Thin walls keep their two faces apart: plates stay exact, shells keep their rim, other surfaces do not change."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

import anisomesh
from anisomesh.embedding.direct import embed
from anisomesh.features.detect import sharp_edges
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.geometry import even_edge_length, unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.metric.field import MetricField
from anisomesh.metric.sources import Curvature
from anisomesh.metric.thin_walls import separate_thin_walls
from anisomesh.shapes.analytic import box, cylinder, sphere
from anisomesh.shapes.parts import prism
from anisomesh.shapes.patches import grid_faces
from anisomesh.working.surface import working_surface

ANGLE = 40.0  # degrees, of creases


def at_unit_size(surface):
    return surface.with_points(unit_frame(surface.points).to_unit(surface.points))


def plate(thickness):
    return box((1.0, 1.0, thickness), n=1)


def wavy_shell(thickness, n=41):
    """Return a closed shell between the graph of .2 sin 3x over the unit square and the same one below it."""
    x, y = (table.ravel() for table in np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij"))
    upper = Surface(np.stack([x, y, 0.2 * np.sin(3.0 * x)], axis=1), grid_faces(n, n))
    if upper.face_normals[0, 2] < 0.0:
        upper = Surface(upper.points, upper.faces[:, ::-1])
    lower = upper.points - np.array([0.0, 0.0, thickness])
    sides = np.concatenate([upper.faces[:, [0, 1]], upper.faces[:, [1, 2]], upper.faces[:, [2, 0]]])
    rim = upper.edges[upper.edge_face_count == 1]
    both = {tuple(side) for side in sides.tolist()}
    a, b = np.array([side if tuple(side) in both else side[::-1] for side in rim.tolist()]).T
    m = upper.n_points
    walls = [np.stack([b, a, a + m], axis=1), np.stack([b, a + m, b + m], axis=1)]
    faces = np.concatenate([upper.faces, upper.faces[:, ::-1] + m, *walls])
    return Surface(np.concatenate([upper.points, lower]), faces.astype(np.int32))


def separated(surface, n):
    field = Curvature()(surface)
    return field, separate_thin_walls(field, surface, n, ANGLE)


def even(surface, n):
    surface = at_unit_size(surface)
    creases = sharp_edges(surface, 20.0)
    return working_surface(surface, n, creases=creases, tagged=np.zeros_like(creases)).surface


@pytest.mark.parametrize("thickness", [1e-2, 1e-3, 1e-5])
def test_the_embedding_of_a_thin_plate_moves_its_faces_apart_and_bends_neither(thickness):
    n = 400
    surface = even(plate(thickness), n)
    field, apart = separated(surface, n)
    points = embed(surface, apart.tensors, corner_tensors=apart.corner_tensors).points
    height = surface.points[:, 2]
    low, high = (np.flatnonzero(np.isclose(height, level, atol=1e-9)) for level in (height.min(), height.max()))
    spacing = even_edge_length(surface.area, n)
    distance = cKDTree(points[low]).query(points[high])[0]
    assert distance.min() > 0.35 * spacing
    flat = np.abs(surface.face_normals[:, 2]) > 0.9
    edges = np.unique(surface.face_edges[flat])
    ends = surface.edges[edges]
    lengths = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
    stretch = lengths / surface.edge_lengths[edges]
    assert np.median(stretch) == pytest.approx(1.0, abs=1e-2)
    assert np.percentile(stretch, 90) < 1.1
    np.testing.assert_array_equal(apart.corner_tensors[flat], field.corner_tensors[flat])


def test_the_metric_of_a_rim_changes_across_it_only():
    surface = even(prism([[np.cos(t), np.sin(t)] for t in np.linspace(0, 2 * np.pi, 65)[:-1]], 0.01), 300)
    field, apart = separated(surface, 300)
    rim = np.abs(surface.face_normals[:, 2]) < 0.5
    added = (apart.corner_tensors - field.corner_tensors)[rim]
    axis = np.array([0.0, 0.0, 1.0])
    size = np.einsum("x,fcxy,y->fc", axis, added, axis)
    assert size.min() > 0.0
    np.testing.assert_allclose(added, size[..., None, None] * np.outer(axis, axis), atol=1e-6 * size.max())
    np.testing.assert_array_equal(apart.corner_tensors[~rim], field.corner_tensors[~rim])
    assert (np.linalg.eigvalsh(apart.tensors) > 0.0).all()


@pytest.mark.parametrize(
    ("shape", "n"),
    [
        (sphere(), 200),
        (box(n=8), 200),
        (plate(0.2), 400),
        (prism([[0, 0], [1, 0], [1, 0.01], [2, 0.01], [2, 1], [0, 1]], 1.0), 400),  # a step, not a wall
        (cylinder(radius=0.5, height=1.0), 200),
    ],
)
def test_without_thin_walls_the_metric_stays_as_it_is(shape, n):
    field, apart = separated(even(shape, n), n)
    assert apart is field


def test_a_closed_smooth_component_beside_a_thin_plate_stays_as_it_is():
    """Regression: the infinite width of a patch without a rim was multiplied by zero."""
    ball, sheet = sphere(), plate(1e-3)
    both = Surface(
        np.concatenate([ball.points + 3.0, sheet.points]), np.concatenate([ball.faces, sheet.faces + ball.n_points])
    )
    surface = even(both, 400)
    with np.errstate(all="raise", under="ignore"):
        field, apart = separated(surface, 400)
    on_ball = surface.points[surface.faces][:, :, 2].min(axis=1) > surface.points[:, 2].mean()
    assert apart is not field
    np.testing.assert_array_equal(apart.corner_tensors[on_ball], field.corner_tensors[on_ball])


def test_a_wall_is_thin_for_few_vertices_only():
    surface = at_unit_size(box((1.0, 1.0, 0.05), n=20))
    assert separated(surface, 200)[1] is not separated(surface, 200)[0]
    field, apart = separated(surface, 20_000)
    assert apart is field


def test_a_metric_without_patches_gets_them_from_the_creases():
    surface = even(plate(1e-3), 400)
    identity = np.broadcast_to(np.eye(3), (surface.n_points, 3, 3)).copy()
    apart = separate_thin_walls(MetricField(tensors=identity), surface, 400, ANGLE)
    np.testing.assert_allclose(apart.corner_tensors, separated(surface, 400)[1].corner_tensors, rtol=1e-6, atol=1e-6)
    assert separate_thin_walls(MetricField(tensors=identity), surface, 400, 180.0).corner_tensors is None


def test_the_units_of_a_metric_do_not_matter():
    surface = even(plate(1e-3), 400)
    field = Curvature()(surface)
    scaled = MetricField(tensors=49.0 * field.tensors, corner_tensors=49.0 * field.corner_tensors, patch=field.patch)
    apart, apart_scaled = (separate_thin_walls(each, surface, 400, ANGLE) for each in (field, scaled))
    np.testing.assert_allclose(apart_scaled.corner_tensors, 49.0 * apart.corner_tensors, rtol=1e-9)


THIN = [
    (plate(1e-2), 400, 1e-3),
    (plate(1e-3), 400, 1e-3),
    (plate(1e-5), 300, 1e-3),
    pytest.param(wavy_shell(1e-2), 800, 2e-3, marks=pytest.mark.slow),
    (wavy_shell(1e-3), 800, 2e-3),
]
THIN_AND_FINE = [
    pytest.param(plate(1e-3), 1_200, 1e-3, marks=pytest.mark.slow),
    pytest.param(wavy_shell(1e-3), 2_000, 2e-3, marks=pytest.mark.slow),
]


@pytest.mark.slow
@pytest.mark.parametrize(("shape", "n", "tolerance"), THIN)
def test_thin_plates_and_shells_keep_their_outline_with_the_uniform_metric(shape, n, tolerance):
    assert_outline_is_kept(shape, n, tolerance, "uniform")


@pytest.mark.parametrize(("shape", "n", "tolerance"), [*THIN, *THIN_AND_FINE])
def test_thin_plates_and_shells_keep_their_outline(shape, n, tolerance):
    assert_outline_is_kept(shape, n, tolerance, "curvature")


def assert_outline_is_kept(shape, n, tolerance, metric):
    """Regression: the two creases of the rim shared their vertices, and the outline was cut by up to 2 %."""
    result = anisomesh.remesh(shape, n_vertices=n, metric=metric, embedding="direct", max_iterations=20)
    assert result.surface.n_points == n
    assert result.warnings == ()
    assert result.surface.area == pytest.approx(shape.area, rel=2e-3)
    samples = shape.points[shape.faces[:, 0]], shape.points[shape.edges].mean(axis=1)
    far = np.sqrt(ClosestPoints(result.surface).squared_distances(np.concatenate(samples)).max())
    assert far < tolerance * shape.diagonal
