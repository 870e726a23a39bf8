"""Hessians of functions on surfaces, and the metric that adapts a mesh to them, against closed forms."""

import numpy as np
import pytest

from anisomesh.conformance import check_metric_source
from anisomesh.errors import MetricError, OptionError
from anisomesh.io.meshes import mesh_of
from anisomesh.mesh.surface import Surface
from anisomesh.metric.solution.hessian import recovered_hessians
from anisomesh.metric.solution.source import SolutionMetric, optimal_metric
from anisomesh.options import RemeshOptions
from anisomesh.setup.inputs import prepared_input
from anisomesh.shapes.analytic import cylinder, open_patch, sphere
from anisomesh.working.subdivision import split_long_edges

QUADRATIC = np.array([[3.0, 1.0], [1.0, -2.0]])


def sheet(seed=0):
    """A flat sheet with irregular triangles, 2 wide around the origin."""
    surface = open_patch(lambda x, y: 0.0 * x)
    jitter = 0.3 * surface.edge_lengths.min() * np.random.default_rng(seed).uniform(-1, 1, surface.points.shape)
    jitter[surface.on_boundary] = 0.0
    jitter[:, 2] = 0.0
    return surface.with_points(surface.points + jitter)


def quadratic(points, matrix=QUADRATIC):
    """1 + x - 2 y + x^t A x / 2."""
    xy = points[:, :2]
    return 1.0 + xy @ [1.0, -2.0] + 0.5 * np.einsum("vi,ij,vj->v", xy, matrix, xy)


def relative_error(found, exact):
    return np.sqrt(((found - exact) ** 2).sum() / (exact**2).sum())


@pytest.mark.parametrize("stretch", [1.0, 200.0])
def test_quadratics_are_recovered_exactly_on_flat_parts_up_to_the_boundary(stretch):
    surface, values = sheet(), quadratic(sheet().points)
    rotation = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    squeeze = rotation @ np.diag([1.0, 1.0 / stretch, 1.0])
    exact = np.zeros((3, 3))
    exact[:2, :2] = QUADRATIC
    exact = rotation @ np.diag([1.0, stretch, 1.0]) @ exact @ np.diag([1.0, stretch, 1.0]) @ rotation.T
    found = recovered_hessians(surface.with_points(surface.points @ squeeze.T), values)
    np.testing.assert_allclose(found, np.broadcast_to(exact, found.shape), atol=1e-9 * np.abs(exact).max())


def sphere_error(subdivisions):
    """Error for sin(3 z) on the unit sphere: P (Hess F) P - (grad F . n) P, P the projection to the tangent plane."""
    surface = sphere(subdivisions)
    jitter = 0.25 * surface.edge_lengths.mean() * np.random.default_rng(0).uniform(-1, 1, surface.points.shape)
    normals = surface.points + jitter
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    z, tangent = normals[:, 2], np.eye(3) - normals[:, :, None] * normals[:, None, :]
    straight = -9.0 * np.sin(3 * z)[:, None, None] * np.diag([0.0, 0.0, 1.0])
    exact = tangent @ straight @ tangent - (3.0 * np.cos(3 * z) * z)[:, None, None] * tangent
    return relative_error(recovered_hessians(surface.with_points(normals), np.sin(3 * z)), exact)


def test_hessians_on_a_sphere_of_irregular_triangles_converge_to_the_covariant_ones():
    errors = [sphere_error(k) for k in (3, 4, 5)]
    assert errors[0] > 1.8 * errors[1] > 3.2 * errors[2]
    assert errors[2] < 0.03


def test_hessians_on_a_cylinder_are_the_ones_of_the_unrolled_function():
    surface = cylinder(radius=0.5, height=2.0, n_around=96, n_along=60, closed=False)
    x, y, z = surface.points.T
    angle = np.arctan2(y, x)
    around = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    second = -4.0 * np.cos(2 * angle) / 0.5**2
    exact = second[:, None, None] * around[:, :, None] * around[:, None, :] + np.diag([0.0, 0.0, 2.0])
    assert relative_error(recovered_hessians(surface, np.cos(2 * angle) + z**2), exact) < 0.03


def test_points_without_enough_neighbours_get_no_arbitrary_derivatives():
    square = Surface(
        np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [5, 5, 5.0]]), np.array([[0, 1, 2], [0, 2, 3]])
    )
    hessians = recovered_hessians(square, np.array([0.0, 1.0, 2.0, 1.0, 7.0]))
    np.testing.assert_allclose(hessians, 0.0, atol=1e-12)


@pytest.mark.parametrize("norm", [1.0, 2.0, np.inf])
def test_the_metric_is_the_closed_form(norm):
    """On two sheets with constant Hessians, det^(-1 / (2 p + 2)) |H|, up to one factor."""
    one = sheet()
    both = Surface(
        np.concatenate([one.points, one.points + 5.0]), np.concatenate([one.faces, one.faces + one.n_points])
    )
    matrices = np.repeat([np.diag([4.0, -1.0, 0.0]), np.diag([-9.0, 25.0, 0.0])], one.n_points, axis=0)
    found = optimal_metric(both, matrices, norm=norm, max_size=1e3, min_size=1e-3)
    exact = [np.prod(pair) ** (-1.0 / (2.0 * norm + 2.0)) * np.array(pair) for pair in ([4.0, 1.0], [9.0, 25.0])]
    found = found / found[0, 1, 1] * exact[0][1]
    for tensors, values in zip(np.split(found, 2), exact, strict=True):
        np.testing.assert_allclose(tensors, np.broadcast_to(np.diag([*values, values.min()]), tensors.shape), atol=1e-9)


def test_bounds_on_stretch_and_size():
    """A layer in one direction: no stretch above the bound, the largest size as stated, the smallest in proportion."""
    surface = sheet()
    for low in (1e-3, 0.5):
        field = SolutionMetric(surface.points[:, 0] ** 8, max_stretch=3.0, min_size=low, max_size=2.0)(surface)
        values = np.linalg.eigvalsh(field.tensors)[:, 1:]
        assert (values[:, 1] / values[:, 0]).max() < 9.0 + 1e-9
        assert values.max() / values.min() < (2.0 / low) ** 2 + 1e-9
        if low == 1e-3:
            density = np.sqrt(values.prod(axis=1))
            even = float(surface.face_areas @ density[surface.faces].mean(axis=1)) / surface.area
            np.testing.assert_allclose(values.min(), even / 4.0, rtol=1e-3)


def test_derivatives_are_not_recovered_across_creases():
    """On the two wings of a fold, each a plane, the function bends by 4 across one and by 1 along the other."""
    flat = sheet()
    x, y, _ = flat.points.T
    fold = np.array(flat.points)
    fold[x > 1e-9, 0], fold[x > 1e-9, 2] = 0.0, x[x > 1e-9]
    at_fold = np.abs(x) < 0.02
    fold[at_fold, 0] = fold[at_fold, 2] = 0.0
    left = (flat.points[flat.faces, 0].mean(axis=1)) < 0
    surface = Surface(fold, flat.faces)
    values = np.where(fold[:, 2] > 0, 0.5 * y**2, 2.0 * fold[:, 0] ** 2 + 0.5 * y**2)
    field = SolutionMetric(values, norm=np.inf, max_size=1e3, min_size=1e-3)(surface)
    assert field.corner_tensors is not None
    across = field.corner_tensors[left][:, :, 0, 0] / field.corner_tensors[left][:, :, 1, 1]
    np.testing.assert_allclose(across, 4.0, rtol=1e-6)
    beyond = field.corner_tensors[~left][:, :, 2, 2] / field.corner_tensors[~left][:, :, 1, 1]
    np.testing.assert_allclose(beyond, 1.0 / 400.0, rtol=1e-6)


@pytest.mark.parametrize("values", [np.full(1681, 7.3), quadratic(sheet().points, np.zeros((2, 2)))])
def test_values_that_do_not_bend_give_even_triangles_and_say_so(values):
    field = SolutionMetric(values)(sheet())
    np.testing.assert_array_equal(field.tensors, np.broadcast_to(np.eye(3), field.tensors.shape))
    assert "second derivatives" in field.remarks[0]


def test_scaling_values_or_adding_a_linear_function_changes_nothing():
    surface = sheet()
    values = np.sin(3 * surface.points[:, 0]) * surface.points[:, 1]
    one = SolutionMetric(values)(surface).tensors
    other = SolutionMetric(-1e6 * (values + surface.points[:, 1]) + 5.0)(surface).tensors
    np.testing.assert_allclose(other, one, rtol=1e-6)


def test_it_is_a_metric_source():
    values = sphere(3).points[:, 2] ** 2
    check_metric_source(SolutionMetric(values), sphere(3))


def test_values_belong_to_the_vertices_of_the_input_before_repair():
    """Reversed, with a point that no face uses and one that is there twice."""
    surface = sheet()
    values = quadratic(surface.points)
    points = np.concatenate([[[9.0, 9.0, 9.0]], surface.points, surface.points[:1]])
    faces = surface.faces + 1
    faces[0][faces[0] == 1] = len(points) - 1
    given = np.concatenate([[np.pi], values, values[:1]])
    options = RemeshOptions(metric=SolutionMetric(given))
    found = prepared_input(mesh_of(points, faces), options).solution
    np.testing.assert_allclose(found.values, quadratic(found.surface.points))


def test_a_solution_on_another_mesh_of_the_surface():
    """Its metric is found at the closest points."""
    coarse, fine = sheet(), split_long_edges(sheet(1), 0.03, max_faces=100_000).surface
    found = SolutionMetric(quadratic(coarse.points), surface=coarse)(fine)
    expected = SolutionMetric(quadratic(coarse.points))(coarse).tensors[0]
    np.testing.assert_allclose(found.tensors, np.broadcast_to(expected, found.tensors.shape), rtol=1e-6)


def test_a_solution_on_another_surface_is_refused():
    options = RemeshOptions(metric=SolutionMetric(quadratic(sheet().points), surface=sheet()))
    with pytest.raises(MetricError, match="same surface"):
        prepared_input(mesh_of(sphere(2)), options)


def test_wrong_values_are_named():
    surface = sphere(1)
    with pytest.raises(MetricError, match=r"shape \(3,\); expected \(42,\)"):
        SolutionMetric(np.zeros(3))(surface)
    with pytest.raises(MetricError, match=r"shape \(3,\); expected \(42,\)"):
        prepared_input(mesh_of(surface), RemeshOptions(metric=SolutionMetric(np.zeros(3))))
    values = np.zeros(42)
    values[7] = np.nan
    with pytest.raises(MetricError, match=r"\[7\] = nan \(1 of 42"):
        SolutionMetric(values)
    with pytest.raises(MetricError, match="real numbers"):
        SolutionMetric(["a", "b"])


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("norm", 0.5),
        ("norm", np.nan),
        ("max_stretch", 0.9),
        ("max_size", 1.0),
        ("min_size", 1.0),
        ("crease_angle", -1.0),
    ],
)
def test_parameters_out_of_range(name, value):
    with pytest.raises(OptionError, match=f"{name} = "):
        SolutionMetric(np.zeros(3), **{name: value})


def test_an_edge_length_has_no_unit():
    with pytest.raises(OptionError, match="no unit"):
        RemeshOptions(metric=SolutionMetric(np.zeros(3)), edge_length=1.0)
