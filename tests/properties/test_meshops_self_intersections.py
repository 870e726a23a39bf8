"""Self-intersections are removed, except where the surface itself intersects."""

import numpy as np
import pytest
from delaunay_cases import assert_closed_manifold

from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.intersections import self_intersections
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import check_validity, new_intersections
from anisomesh.meshops.self_intersections import remove_self_intersections
from anisomesh.pipeline import remesh
from anisomesh.shapes.analytic import box, sphere


def both(a, b):
    return Surface(np.concatenate([a.points, b.points]), np.concatenate([a.faces, b.faces + a.n_points]))


def moved(surface, by):
    return surface.with_points(surface.points + np.asarray(by))


def sheets(n=6, gap=0.02):
    """Return two thin boxes, one above the other, so near that a small move of a point makes them intersect."""
    lower = box((1.0, 1.0, 0.1), n=n)
    return both(lower, moved(lower, [0.0, 0.0, 0.1 + gap]))


def dented(surface, seed, size, share=0.05):
    rng = np.random.default_rng(seed)
    points = surface.points.copy()
    chosen = rng.choice(len(points), max(1, int(share * len(points))), replace=False)
    points[chosen, 2] += rng.uniform(-size, size, len(chosen))
    return surface.with_points(points)


@pytest.mark.parametrize("seed", range(6))
def test_points_that_reach_into_another_sheet_come_back(seed):
    reference = sheets()
    broken = dented(reference, seed, 0.06)
    before = len(self_intersections(broken))
    points, faces, left = remove_self_intersections(broken.points, broken.faces, ClosestPoints(reference))
    assert left == len(self_intersections(Surface(points, faces)))
    assert left == 0 or left < before
    assert_closed_manifold(faces, 4)
    assert check_validity(Surface(points, faces), reference).inverted <= check_validity(broken, reference).inverted


def test_a_mesh_without_intersections_is_returned_as_it_is():
    reference = sheets()
    points, faces, left = remove_self_intersections(reference.points, reference.faces, ClosestPoints(reference))
    assert left == 0
    np.testing.assert_array_equal(points, reference.points)
    np.testing.assert_array_equal(faces, reference.faces)


def test_intersections_of_the_surface_itself_are_left():
    crossing = both(sphere(2), moved(sphere(2), [0.9, 0.1, 0.2]))
    assert len(self_intersections(crossing)) > 0
    points, faces, left = remove_self_intersections(crossing.points, crossing.faces, ClosestPoints(crossing))
    assert left == 0
    np.testing.assert_array_equal(points, crossing.points)
    np.testing.assert_array_equal(faces, crossing.faces)


def test_new_intersections_are_those_away_from_the_old_ones():
    crossing = both(sphere(2), moved(sphere(2), [1.5, 0.0, 0.0]))
    reference = ClosestPoints(crossing)
    assert len(new_intersections(crossing, reference)) == 0
    folded = crossing.points.copy()
    far = int(np.argmin(folded[:, 0]))  # on the other side of the first sphere
    folded[far] = [0.6, 0.0, 0.0]
    pairs = new_intersections(crossing.with_points(folded), reference)
    assert len(pairs) > 0
    assert np.isin(far, crossing.faces[pairs])
    assert ClosestPoints(sphere(1)).crossing_facets is None


def test_tries_are_bounded():
    reference = sheets()
    broken = dented(reference, 0, 0.06)
    _, faces, left = remove_self_intersections(broken.points, broken.faces, ClosestPoints(reference), max_tries=0)
    assert left == len(self_intersections(broken)) > 0
    np.testing.assert_array_equal(faces, broken.faces)


@pytest.mark.slow
@pytest.mark.parametrize("gap", [0.03, 0.003])
def test_a_remesh_of_sheets_close_together_has_no_intersection(gap):
    """Coarse triangles on curved shells as near to each other as a few per cent of their edges."""
    outer = sphere(4)
    inner = Surface((1.0 - gap) * outer.points, outer.faces[:, ::-1])
    result = remesh(both(outer, inner), n_vertices=300, max_iterations=30)
    assert result.validity.new_intersections == 0
    assert result.validity.euler == 4
