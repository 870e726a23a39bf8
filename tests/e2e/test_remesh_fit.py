"""The fit at the end of a remesh: nearer to the input, better triangles, as valid as without it."""

from functools import cache

import numpy as np
import pytest

import anisomesh
from anisomesh.bench.methods import METHODS
from anisomesh.shapes import analytic as shapes
from anisomesh.shapes.cad_part import cad_part

SHAPES = {
    "ellipsoid": (lambda: shapes.ellipsoid(subdivisions=3), 100),
    "part": (lambda: cad_part(8), 300),
    "open patch": (lambda: shapes.open_patch(lambda x, y: 0.3 * np.sin(4 * x) * y, n=24), 100),
}


@cache
def remeshed(name, **options):
    """Return the remesh of a shape and its evaluation."""
    make, n = SHAPES[name]
    shape = make()
    result = anisomesh.remesh(shape, n_vertices=n, embedding="direct", max_iterations=20, **options)
    return result, anisomesh.evaluate(shape, result.surface, samples=5_000)


@pytest.mark.parametrize(
    "name", [name if name == "part" else pytest.param(name, marks=pytest.mark.slow) for name in SHAPES]
)
def test_a_fit_lowers_the_error_and_improves_triangles(name):
    (plain, before), (fitted, after), n = remeshed(name, fit=False), remeshed(name), SHAPES[name][1]
    assert after.distance.rms < 0.85 * before.distance.rms
    assert after.shape.g_mean > before.shape.g_mean
    assert after.features.crease_covered >= before.features.crease_covered - 0.01
    assert after.features.corners_kept >= before.features.corners_kept
    assert fitted.surface.n_points == plain.surface.n_points == n
    for fault in ("flat", "inverted", "new_intersections", "nonmanifold_edges", "nonmanifold_vertices"):
        assert getattr(fitted.validity, fault) <= getattr(plain.validity, fault)
    assert fitted.validity.euler == plain.validity.euler
    assert fitted.seconds["fit"] > 0.0


def test_prescribed_edges_stay_on_their_lines():
    sheet = shapes.open_patch(lambda x, y: 0.0 * x, n=20)
    line = np.flatnonzero(np.abs(sheet.points[:, 0] - np.median(np.unique(sheet.points[:, 0]))) < 1e-9)
    line = line[np.argsort(sheet.points[line, 1])]
    pairs = np.stack([line[:-1], line[1:]], axis=1)
    result = anisomesh.remesh(sheet, n_vertices=80, embedding="direct", features=pairs, max_iterations=20)
    ends = result.surface.points[result.surface.edges]
    on_line = (np.abs(ends[:, :, 0] - sheet.points[line[0], 0]) < 1e-9).all(axis=1)
    covered = np.linalg.norm(ends[on_line, 0] - ends[on_line, 1], axis=1).sum()
    whole = np.ptp(sheet.points[line, 1])
    assert covered == pytest.approx(whole, rel=1e-6)


@pytest.mark.slow
def test_the_weight_of_the_shape_trades_distance_for_quality():
    assert anisomesh.RemeshOptions().shape_weight == 1.0
    weights = ({"shape_weight": 0.1}, {}, {"shape_weight": 10.0})
    found = [remeshed("open patch", **weight)[1] for weight in weights]
    assert found[0].distance.rms < found[1].distance.rms < found[2].distance.rms
    assert found[0].shape.g_mean < found[2].shape.g_mean


@pytest.mark.parametrize("weight", [0.0, -1.0, float("nan"), float("inf")])
def test_a_weight_of_the_shape_that_is_not_positive_is_refused(weight):
    with pytest.raises(anisomesh.OptionError, match="shape_weight"):
        anisomesh.RemeshOptions(shape_weight=weight)


@pytest.mark.parametrize("fit", ["yes", 1, None])
def test_another_value_of_fit_is_refused(fit):
    with pytest.raises(anisomesh.OptionError, match="fit"):
        anisomesh.RemeshOptions(fit=fit)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ellipsoid", "part"])
def test_the_metric_for_the_least_distance_is_nearer(name):
    rms = [found.distance.rms for _, found in (remeshed(name), remeshed(name, metric="approximation"))]
    assert rms[1] < 0.95 * rms[0] + 1e-9


@pytest.mark.slow
def test_parts_are_about_as_near_as_by_quadric_decimation_with_better_triangles():
    part = cad_part(8)
    result = anisomesh.remesh(part, n_vertices=200, metric="approximation", max_iterations=30)
    other = METHODS["vtk-quadric"].run(part, 200, 0, {}).surface
    mine, theirs = (anisomesh.evaluate(part, mesh, samples=5_000) for mesh in (result.surface, other))
    assert mine.distance.rms < 1.5 * theirs.distance.rms + 1e-9
    assert mine.shape.g_mean > theirs.shape.g_mean + 0.05
    assert result.surface.n_points == 200
    assert result.validity.inverted == result.validity.new_intersections == result.validity.flat == 0


@pytest.mark.slow
def test_the_tip_of_a_needle_is_not_drawn_out():
    """Beyond a tip the planes of the samples go on; a vertex was 3.6 radii outside."""
    sphere = shapes.sphere(3)
    needle = sphere.with_points(sphere.points * [1.0, 0.003, 0.003])
    result = anisomesh.remesh(needle, n_vertices=200, embedding="direct", max_iterations=20)
    assert np.abs(result.surface.points[:, 0]).max() < 1.006
