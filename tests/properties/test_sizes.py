"""Sizes that a metric asks for, against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import anisomesh
from anisomesh.caveats import unfollowed_sizes
from anisomesh.embedding.density import area_factors, density_of_sizes
from anisomesh.errors import OptionError
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.metric.conformity import MetricExtent, conformity, lengths_in_metric
from anisomesh.metric.field import MetricField
from anisomesh.metric.sizes import limited_sizes
from anisomesh.metric.tensors import uniform_metric
from anisomesh.metric.transfer import PlacedMetric
from anisomesh.shapes.analytic import box, open_patch, sphere, torus
from anisomesh.shapes.patches import grid_faces

FACTOR = 10.0


def flat(n=40):
    return open_patch(lambda x, y: 0.0 * x, n)


def place(points, surface):
    low = surface.points[:, 0].min()
    return (points[:, 0] - low) / np.ptp(surface.points[:, 0])


def tensors_of(sizes):
    return np.eye(3) / sizes[:, None, None] ** 2


@pytest.mark.parametrize(
    ("make", "fit"),
    [(flat, True), (lambda: sphere(4), True), (torus, True), (torus, False)],
    ids=["flat", "sphere", "torus", "torus without a fit"],
)
def test_a_tenfold_size_is_followed_at_both_ends(make, fit):
    surface = make()

    def size(points):
        return FACTOR ** place(points, surface)

    result = anisomesh.remesh(surface, n_vertices=800, metric=tensors_of(size(surface.points)), fit=fit)
    edges = result.surface.points[result.surface.edges]
    middle = edges.mean(axis=1)
    length = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1) / size(middle)
    length /= np.median(length)
    for end in (place(middle, surface) < 0.25, place(middle, surface) > 0.75):
        assert length[end].mean() == pytest.approx(1.0, abs=0.1)


def test_the_density_is_the_fourth_power_of_the_size_where_the_embedding_is_the_surface():
    surface = flat(60)
    size = 1.0 + place(surface.points, surface)
    density = density_of_sizes(surface, tensors_of(size), surface.points) * size**4
    assert np.ptp(density) < 0.05 * density.mean()
    np.testing.assert_allclose(area_factors(surface, tensors_of(size)) ** 2 * size**4, density, rtol=1e-12)


def test_the_density_is_constant_where_the_embedding_is_exact():
    surface = torus()
    stretch = np.array([1.0, 2.0, 3.0])
    tensors = np.broadcast_to(np.diag(stretch**2), (surface.n_points, 3, 3))
    np.testing.assert_allclose(density_of_sizes(surface, tensors, surface.points * stretch), 1.0, rtol=1e-9)


def rows_of_equilateral_triangles(n, m, side=1.0):
    """Return an open parallelogram of (n + 1) (m + 1) points with all edges of one length."""
    i, j = (table.ravel() for table in np.meshgrid(np.arange(n + 1), np.arange(m + 1), indexing="ij"))
    points = side * np.stack([i - 0.5 * j, 0.5 * np.sqrt(3.0) * j, 0.0 * i], axis=1)
    return anisomesh.Surface(points, grid_faces(n + 1, m + 1))


@given(n=st.integers(1, 12), m=st.integers(1, 12), side=st.floats(0.01, 100.0))
def test_equilateral_triangles_have_the_count_of_their_length(n, m, side):
    mesh = rows_of_equilateral_triangles(n, m, side)
    extent = MetricExtent.of(mesh, MetricField(tensors=uniform_metric(mesh)))
    assert extent.count(side) == mesh.n_points
    assert extent.length(mesh.n_points) == pytest.approx(side, rel=1e-9)


def test_edges_of_the_length_that_the_metric_asks_for_conform():
    mesh = rows_of_equilateral_triangles(9, 7, 0.25)
    field = MetricField(tensors=16.0 * uniform_metric(mesh))
    found = conformity(mesh, PlacedMetric(ClosestPoints(mesh), field), MetricExtent.of(mesh, field))
    np.testing.assert_allclose([found.mean, found.median, found.of_count, *found.quantiles], 1.0, rtol=1e-6)
    assert found.share == 1.0
    assert list(unfollowed_sizes(found)) == []


def test_edges_that_do_not_follow_a_size_are_said():
    mesh = rows_of_equilateral_triangles(20, 20)
    field = MetricField(tensors=tensors_of(1.0 + 9.0 * place(mesh.points, mesh)))
    found = conformity(mesh, PlacedMetric(ClosestPoints(mesh), field), MetricExtent.of(mesh, field))
    assert found.off_share > 0.5
    (sentence,) = unfollowed_sizes(found)
    assert "do not have the lengths" in sentence


def test_lengths_are_integrals_along_the_edges():
    n = 400  # the reference resolves the size; the mesh has one edge along x
    reference = open_patch(lambda x, y: 0.0 * x, n)
    roots = np.exp(reference.points[:, 0])[:, None, None] * np.eye(3)
    triangle = anisomesh.Surface(np.array([[-0.9, 0.0, 0.0], [0.8, 0.0, 0.0], [0.0, 0.7, 0.0]]), np.array([[0, 1, 2]]))
    metric = PlacedMetric(ClosestPoints(reference), MetricField(tensors=roots @ roots))
    along = lengths_in_metric(triangle, metric)[np.ptp(triangle.points[triangle.edges][:, :, 1], axis=1) == 0.0]
    assert along == pytest.approx(np.exp(0.8) - np.exp(-0.9), rel=1e-3)


@pytest.mark.parametrize(
    ("make", "length"),
    [(lambda: sphere(4), 0.2), (torus, 0.2), (lambda: box(n=1), 0.13)],
    ids=["sphere", "torus", "box of 12 triangles"],
)
def test_edges_have_the_length_asked_for(make, length):
    surface = make()
    scaled = surface.with_points(1000.0 * surface.points)
    result = anisomesh.remesh(scaled, edge_length=1000.0 * length, metric="uniform")
    assert np.median(result.surface.edge_lengths) == pytest.approx(1000.0 * length, rel=0.05)
    assert result.conformity.asked == 1000.0 * length
    assert result.report()["conformity"]["median"] == pytest.approx(1000.0 * length, rel=0.05)


def test_a_linear_size_of_a_function_is_followed_and_gives_the_count():
    surface = box(n=1)  # its points alone would not show how the size varies

    def size(points):
        return 0.08 + 0.16 * points[:, 2]

    result = anisomesh.remesh(surface, metric="uniform", size_field=size)
    edges = result.surface.points[result.surface.edges]
    length = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1) / size(edges.mean(axis=1))
    height = edges.mean(axis=1)[:, 2]
    for part in (height < 0.3, (height > 0.3) & (height < 0.7), height > 0.7):
        assert length[part].mean() == pytest.approx(1.0, abs=0.1)
    assert result.warnings == ()


def test_only_ratios_of_sizes_count_with_a_number_of_vertices():
    surface = sphere(3)
    sizes = 1.0 + place(surface.points, surface)
    first, second = (
        anisomesh.remesh(surface, n_vertices=150, metric="uniform", size_field=factor * sizes, max_iterations=5)
        for factor in (1.0, 8.0)
    )
    assert first.surface.n_points == 150
    assert second.conformity.of_count == pytest.approx(first.conformity.of_count / 8.0, rel=1e-6)
    assert first.conformity.asked is None


def test_a_density_changes_the_lengths_asked_for():
    surface = torus()
    given = {"metric": tensors_of(np.ones(surface.n_points)), "density": 16.0 ** place(surface.points, surface)}
    result = anisomesh.remesh(surface, n_vertices=500, **given)
    middles = result.surface.points[result.surface.edges].mean(axis=1)
    lengths, at = result.surface.edge_lengths, place(middles, surface)
    assert lengths[at < 0.1].mean() / lengths[at > 0.9].mean() == pytest.approx(2.0 * 16.0**-0.025, rel=0.1)
    assert result.conformity.share > 0.9


def test_lengths_that_hardly_any_triangle_has_are_said():
    result = anisomesh.remesh(sphere(2), edge_length=10.0, metric="uniform", max_iterations=5)
    assert any("do not have the lengths" in warning for warning in result.warnings)


@given(seed=st.integers(0, 1000), gradation=st.floats(0.05, 2.0))
def test_sizes_grow_no_faster_than_the_gradation(seed, gradation):
    surface = torus(n_major=12, n_minor=8)
    sizes = np.exp(np.random.default_rng(seed).normal(size=surface.n_points))
    limited = limited_sizes(surface, sizes, gradation=gradation)
    first, second = surface.edges.T
    step = gradation * surface.edge_lengths
    assert (np.abs(limited[first] - limited[second]) <= step * (1.0 + 1e-9)).all()
    expected = sizes.copy()  # the largest such sizes, by relaxation of all edges
    for _ in range(surface.n_points):
        np.minimum.at(expected, first, expected[second] + step)
        np.minimum.at(expected, second, expected[first] + step)
    np.testing.assert_allclose(limited, expected, rtol=1e-9)


def test_sizes_are_kept_within_bounds():
    surface = sphere(2)
    sizes = np.linspace(0.1, 3.0, surface.n_points)
    limited = limited_sizes(surface, sizes, low=0.5, high=2.0)
    np.testing.assert_array_equal(limited, np.clip(sizes, 0.5, 2.0))
    np.testing.assert_array_equal(limited_sizes(surface, sizes), sizes)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"size_field": np.r_[np.ones(160), -1.0, 0.0], "metric": "uniform"},
            r"size_field\[160\] is -1 at \(.*, and 2 of",
        ),
        (
            {"size_field": lambda points: points[:, 0] - 9.0, "metric": "uniform"},
            r"size_field is -.* at \(.* sizes are",
        ),
        ({"size_field": np.ones(7), "metric": "uniform"}, "size_field has 7 values; expected 162"),
        ({"size_field": np.full(162, 1e9), "metric": "uniform"}, "size_field is at least 1e.09 everywhere"),
        ({"size_field": np.ones(162)}, "metric='uniform', and the metric is 'curvature'"),
        ({"size_field": np.ones(162), "metric": "uniform", "edge_length": 1.0}, "leave one out"),
        ({"size_field": np.ones(162), "metric": "uniform", "min_size": 2.0, "max_size": 1.0}, "above max_size"),
        ({"edge_length": 0.1, "gradation": 0.3}, "gradation limits a size_field"),
        ({"edge_length": 0.0}, "edge_length = 0.0; expected a positive finite number"),
        ({"edge_length": 0.1, "metric": "approximation"}, "no unit"),
        ({"edge_length": 0.1, "n_vertices": 100}, "give one of"),
        ({"edge_length": 0.1, "density": np.ones(162)}, "density and an edge_length or size_field"),
    ],
)
def test_sizes_that_make_no_sense_are_refused(options, words):
    with pytest.raises(OptionError, match=words):
        anisomesh.remesh(sphere(2), **options)
