"""The whole report: a mesh against itself, against shapes with known answers, in any units, from any library."""

import json

import numpy as np
import pytest

import anisomesh
from anisomesh.errors import MeshError
from anisomesh.evaluation.report import evaluate
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import box, cad_part, open_patch, sphere, torus


def numbers(value):
    """Yield every number in nested dictionaries."""
    for item in value.values() if isinstance(value, dict) else [value]:
        if isinstance(item, dict):
            yield from numbers(item)
        elif item is not None:
            yield item


@pytest.mark.parametrize(
    "surface", [sphere(3), cad_part(6), open_patch(lambda x, y: 0.3 * x * y, n=10)], ids=["sphere", "part", "open"]
)
def test_a_mesh_against_itself(surface):
    evaluation = evaluate(surface, surface, samples=20_000)
    assert evaluation.distance.rms < 1e-7
    assert evaluation.vertex_max < 1e-7
    assert evaluation.sampled.chamfer == pytest.approx(evaluation.floor.chamfer, rel=0.05)
    assert evaluation.features.crease_covered == 1.0
    assert evaluation.features.corners_kept == evaluation.features.corners
    assert evaluation.validity.euler == evaluation.validity.euler_input
    assert evaluation.validity.inverted == 0
    assert evaluation.validity.self_intersections == evaluation.validity.self_intersections_input == 0
    assert all(np.isfinite(number) for number in numbers(evaluation.as_dict()))
    json.dumps(evaluation.as_dict(), allow_nan=False)


def test_an_offset_sphere_is_at_its_distance():
    inner, d = sphere(5), 0.03
    outer = inner.with_points((1.0 + d) * inner.points)
    evaluation = evaluate(inner, outer, samples=5_000)
    expected = d / inner.diagonal  # at bounding-box diagonal 1 of the reference
    assert evaluation.distance.rms == pytest.approx(expected, rel=0.01)
    assert evaluation.vertex_rms == pytest.approx(expected, rel=0.01)
    assert evaluation.vertex_max == pytest.approx(expected, rel=0.02)


def test_figures_do_not_depend_on_units_and_place():
    reference, result = torus(1.0, 0.3, 48, 20), torus(1.0, 0.3, 24, 10)

    def moved(surface):
        return surface.with_points(1000.0 * surface.points + np.array([5e4, -2e4, 1e4]))

    here = evaluate(reference, result, samples=3_000)
    there = evaluate(moved(reference), moved(result), samples=3_000)
    assert here.distance.rms == pytest.approx(there.distance.rms, rel=1e-6)
    assert here.shape.g_mean == pytest.approx(there.shape.g_mean, rel=1e-6)
    assert here.sampled.chamfer == pytest.approx(there.sampled.chamfer, rel=1e-6)


def test_the_same_seed_gives_the_same_figures():
    reference, result = box(n=3), box(n=2)
    assert evaluate(reference, result, samples=500) == evaluate(reference, result, samples=500)
    assert evaluate(reference, result, samples=500) != evaluate(reference, result, samples=500, seed=1)


def test_defects_of_the_result_are_found():
    reference = sphere(3)
    turned = reference.faces.copy()
    turned[5] = turned[5, ::-1]
    inverted = evaluate(reference, Surface(reference.points, turned), samples=100)
    assert not inverted.validity.oriented
    assert inverted.validity.inverted == 1
    opened = evaluate(reference, Surface(reference.points, reference.faces[1:]), samples=100)
    assert (opened.validity.closed, opened.validity.boundary_loops) == (False, 1)
    pushed = reference.points.copy()
    pushed[0] *= -1.2  # through the other side
    assert evaluate(reference, Surface(pushed, reference.faces), samples=100).validity.self_intersections > 0


def test_a_reference_that_needs_repair_is_repaired():
    clean = box(n=3)
    soup = Surface(clean.points[clean.faces].reshape(-1, 3), np.arange(3 * clean.n_faces).reshape(-1, 3))
    evaluation = evaluate(soup, clean, samples=500)
    assert evaluation.validity.euler_input == 2
    assert evaluation.distance.rms < 1e-7


def test_meshes_of_other_libraries_and_the_public_name():
    trimesh = pytest.importorskip("trimesh")
    surface = sphere(2)
    other = trimesh.Trimesh(surface.points, surface.faces, process=False)
    assert anisomesh.evaluate is evaluate
    assert isinstance(anisomesh.evaluate(other, surface, samples=10), anisomesh.Evaluation)


def test_an_empty_result_is_refused():
    with pytest.raises(MeshError, match="no face"):
        evaluate(sphere(1), Surface(np.zeros((3, 3)), np.zeros((0, 3), dtype=int)))
    with pytest.raises(MeshError, match="cannot read a mesh"):
        evaluate(sphere(1), 3.0)
