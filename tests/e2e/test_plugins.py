"""Metric sources, embedders, energies and densities of a user's own in a whole remesh."""

import numpy as np
import pytest
from polygon_functions import plain

import anisomesh
from anisomesh import MetricField, NormalMetric, OptionError
from anisomesh.shapes.analytic import ellipsoid, open_patch

SURFACE = ellipsoid(subdivisions=3)
DIRECT = {"embedding": "direct", "max_iterations": 20}


def same(a, b):
    return np.array_equal(a.surface.points, b.surface.points) and np.array_equal(a.surface.faces, b.surface.faces)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("short", "long"),
    [
        ({"metric": "curvature", "embedding": "direct"}, {"metric": anisomesh.Curvature()}),
        ({"metric": "uniform"}, {"metric": anisomesh.Uniform(), "embedding": anisomesh.Direct()}),
        ({"embedding": "direct", "sharpness": 3.0}, {"embedding": "direct", "energy": NormalMetric(3.0)}),
        ({"embedding": "direct", "embedding_iterations": 2}, {"embedding": anisomesh.Direct(iterations=2)}),
    ],
)
def test_short_forms_are_the_objects_that_they_stand_for(short, long):
    runs = [anisomesh.remesh(SURFACE, n_vertices=80, max_iterations=10, **options) for options in (short, long)]
    assert same(*runs)
    assert [run.embedding_name for run in runs] == ["direct", "direct"]


def test_a_metric_source_of_ones_own_sets_the_stretch():
    def along_x(surface):
        return MetricField(tensors=np.tile(np.diag([1.0, 9.0, 9.0]), (surface.n_points, 1, 1)))

    flat = open_patch(lambda x, y: 0.0 * x, 12)
    result = anisomesh.remesh(flat, n_vertices=200, metric=along_x, **DIRECT)
    inner = result.surface.edges[~result.surface.on_boundary[result.surface.edges].any(axis=1)]
    edges = np.abs(result.surface.points[inner[:, 1]] - result.surface.points[inner[:, 0]])
    assert edges[:, 0].max() == pytest.approx(3.0 * edges[:, 1].max(), rel=0.35)
    assert result.embedding_name == "along_x"
    assert result.tensors.shape == (result.working.n_points, 3, 3)


def test_a_source_may_move_the_points_and_bring_extra_coordinates():
    def shrunk(surface):
        tensors = np.tile(np.eye(3), (surface.n_points, 1, 1))
        return MetricField(tensors=tensors, points=0.5 * surface.points, extra=np.zeros((surface.n_points, 5)))

    result = anisomesh.remesh(SURFACE, n_vertices=100, metric=shrunk, **{**DIRECT, "embedding": "auto"})
    assert result.surface.diagonal == pytest.approx(0.5 * SURFACE.diagonal, rel=0.05)
    assert result.embedding.points.shape[1] == 8


@pytest.mark.slow
def test_an_energy_of_ones_own_gives_what_the_built_in_one_gives():
    own, built_in = (
        anisomesh.remesh(SURFACE, n_vertices=80, energy=energy, metric="uniform", **DIRECT)
        for energy in (anisomesh.energy_from_kernel(plain), NormalMetric(1.0))
    )
    assert own.energy == pytest.approx(built_in.energy, rel=0.03)
    assert all("volume" in warning for warning in own.warnings)  # it is not fitted


def test_an_embedder_of_ones_own_is_used():
    def with_normals(surface, field):
        embedding = anisomesh.Direct(iterations=1)(surface, field)
        points = np.concatenate([surface.points, 0.2 * surface.point_normals], axis=1)
        return anisomesh.Embedding(
            points=points, scale=1.0, residual=0.0, iterations=0, status=embedding.status, stretch=embedding.stretch
        )

    result = anisomesh.remesh(SURFACE, n_vertices=100, embedding=with_normals, max_iterations=20)
    assert result.embedding.points.shape[1] == result.sites.shape[1] == 6
    assert result.validity.closed


@pytest.mark.slow
def test_triangles_are_smaller_where_the_density_is_larger():
    flat = open_patch(lambda x, y: 0.0 * x, 20)
    density = np.where(flat.points[:, 0] > 0.0, 16.0, 1.0)
    result = anisomesh.remesh(flat, n_vertices=400, metric="uniform", density=density, sharpness=1.0, **DIRECT)
    x = result.surface.points[result.surface.faces].mean(axis=1)[:, 0]
    areas = [np.median(result.surface.face_areas[side]) for side in (x > 0.2, x < -0.2)]
    assert areas[1] / areas[0] == pytest.approx(4.0, rel=0.25)  # the square root of 16


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"density": np.ones(3)}, "density has 3 values; expected"),
        ({"density": -np.ones(SURFACE.n_points)}, "positive"),
        ({"energy": 7.0}, "expected an object with evaluate"),
        ({"energy": NormalMetric(3.0), "sharpness": 5.0}, "sharpness belongs to the built-in energy"),
        ({"energy": NormalMetric(3.0), "final_sharpness": 30.0}, "in place of yours"),
        ({"energy": NormalMetric}, "is a class"),
        ({"embedding": 3}, "expected a name or an embedder"),
    ],
)
def test_wrong_plug_ins_are_refused(options, message):
    with pytest.raises(OptionError, match=message):
        anisomesh.remesh(SURFACE, n_vertices=100, **options)
