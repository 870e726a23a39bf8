"""The paper's sampled measures against closed forms: the floor, offset shapes, missing creases."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anisomesh.errors import OptionError
from anisomesh.evaluation.sampled import sampled_measures
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import box, sphere, torus


def unit(surface):
    return surface.with_points(unit_frame(surface.points).to_unit(surface.points))


@pytest.mark.parametrize("surface", [sphere(4), torus(1.0, 0.3, 64, 24), box((1.0, 0.7, 0.2), n=2)])
def test_the_floor_has_its_closed_form(surface):
    surface, n = unit(surface), 100_000
    floor = sampled_measures(surface, surface, samples=n)
    assert floor.chamfer == pytest.approx(2.0 * surface.area / (np.pi * n), rel=0.02)
    assert floor.f1 == pytest.approx(1.0 - np.exp(-np.pi * 0.004**2 * n / surface.area), rel=0.002)
    assert floor.hausdorff == pytest.approx(np.sqrt(surface.area * np.log(n) / (np.pi * n)), rel=0.25)
    assert floor.normal_consistency > 0.98


def test_spheres_at_a_distance():
    inner, d = sphere(5), 0.05
    outer = inner.with_points((1.0 + d) * inner.points)
    n = 100_000
    measures = sampled_measures(inner, outer, samples=n)
    sideways = (inner.area + outer.area) / (np.pi * n)  # the floor adds up with the distance at a right angle
    assert measures.chamfer == pytest.approx(2.0 * d**2 + sideways, rel=0.01)
    assert d <= measures.hausdorff < 1.2 * d
    assert measures.f1 == 0.0
    assert measures.normal_consistency == pytest.approx(1.0, abs=1e-3)


def test_a_cube_rotated_onto_itself_is_at_the_floor_and_at_45_degrees_is_not():
    cube = unit(box(n=2))
    turned = {
        angle: cube.with_points(Rotation.from_euler("z", angle, degrees=True).apply(np.array(cube.points)))
        for angle in (45, 90)
    }
    floor = sampled_measures(cube, cube, samples=20_000, seed=1)
    same = sampled_measures(cube, turned[90], samples=20_000, seed=2)
    other = sampled_measures(cube, turned[45], samples=20_000, seed=3)
    assert same.chamfer == pytest.approx(floor.chamfer, rel=0.03)
    assert same.edge_chamfer == pytest.approx(floor.edge_chamfer, rel=0.1)
    assert other.chamfer > 3.0 * floor.chamfer
    # the vertical edge of the turned cube is farthest: at (sqrt(2) - 1) / 2 sides from the nearest face
    assert other.hausdorff == pytest.approx((np.sqrt(2) - 1) / 2 / np.sqrt(3), abs=0.01)


def test_creases_of_a_shifted_box():
    cube, d = box(n=1), 0.02
    shifted = cube.with_points(cube.points + np.array([d, 0.0, 0.0]))
    measures = sampled_measures(cube, shifted, samples=50_000)
    # a third of the creases run along the shift and stay where they are
    assert measures.edge_chamfer == pytest.approx(2.0 * 2.0 / 3.0 * d**2, rel=0.03)
    assert measures.edge_f1 == pytest.approx(1.0 / 3.0, abs=0.03)


def test_surfaces_without_creases_have_stated_results():
    ball, cube = sphere(3), box(n=1)
    none = sampled_measures(ball, ball, samples=100)
    assert (none.edge_chamfer, none.edge_f1, none.edge_f1_wide) == (0.0, 1.0, 1.0)
    for pair in ((ball, cube), (cube, ball)):
        one = sampled_measures(*pair, samples=100)
        assert (one.edge_chamfer, one.edge_f1, one.edge_f1_wide) == (None, 0.0, 0.0)


def test_the_same_seed_gives_the_same_measures_and_one_sample_is_enough():
    cube = box(n=1)
    assert sampled_measures(cube, cube, samples=500) == sampled_measures(cube, cube, samples=500)
    assert sampled_measures(cube, cube, samples=500, seed=1) != sampled_measures(cube, cube, samples=500)
    single = sampled_measures(cube, cube, samples=1)
    assert all(np.isfinite(value) for value in single.as_dict().values())
    with pytest.raises(OptionError, match="samples is 0"):
        sampled_measures(cube, cube, samples=0)


def test_a_flat_and_a_degenerate_surface_have_finite_figures():
    line = Surface(np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]]), np.array([[0, 1, 2]]))
    measures = sampled_measures(line, box(n=1), samples=50)
    assert all(value is None or np.isfinite(value) for value in measures.as_dict().values())
