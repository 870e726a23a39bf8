"""Topology of the procedural shapes, and the creases of the machine part."""

import numpy as np
import pytest

from anisomesh.errors import OptionError
from anisomesh.mesh import topology
from anisomesh.shapes import analytic as shapes

# Euler characteristic and number of boundary loops.
MADE = {
    "sphere": (shapes.sphere(1), 2, 0),
    "icosahedron": (shapes.sphere(0), 2, 0),
    "ellipsoid": (shapes.ellipsoid(subdivisions=2), 2, 0),
    "torus": (shapes.torus(n_major=9, n_minor=5), 0, 0),
    "knot": (shapes.trefoil_knot(n_along=60, n_around=6), 0, 0),
    "smallest torus": (shapes.torus(n_major=3, n_minor=3), 0, 0),
    "cylinder": (shapes.cylinder(n_around=20, n_along=3), 2, 0),
    "thin cylinder": (shapes.cylinder(n_around=3, n_along=1), 2, 0),
    "tube": (shapes.cylinder(n_around=20, n_along=3, closed=False), 0, 2),
    "box": (shapes.box((3, 2, 1), n=4), 2, 0),
    "cube": (shapes.box(n=1), 2, 0),
    "patch": (shapes.open_patch(lambda x, y: x * y, n=5), 1, 1),
    "one turn": (shapes.twisted_ring(half_turns=2), 0, 0),
    "half a turn": (shapes.twisted_ring(half_turns=1, n_major=30, n_section=(4, 2)), 0, 0),
    "no turn": (shapes.twisted_ring(half_turns=0, n_section=(1, 1)), 0, 0),
    **{f"part {n}": (shapes.cad_part(n), 0, 0) for n in (3, 4, 7, 12)},
    **{f"sample {name}": (shapes.sample(name), None, None) for name in shapes.SAMPLES},
}


@pytest.mark.parametrize("name", MADE)
def test_topology_is_as_promised(name):
    made, euler, n_loops = MADE[name]
    assert topology.count_nonmanifold_edges(made.faces) == 0
    assert topology.count_nonmanifold_points(made.faces) == 0
    assert topology.is_oriented(made.faces)
    assert topology.connected_components(made.faces, made.n_points)[0] == 1
    assert set(made.faces.ravel()) == set(range(made.n_points))
    assert made.face_areas.min() > 1e-3 * made.face_areas.max()
    if euler is not None:
        assert topology.euler_characteristic(made.faces) == euler
        assert len(topology.boundary_loops(made.faces)) == n_loops
    if (made.edge_face_count == 2).all():
        a, b, c = (made.points[made.faces[:, k]] for k in range(3))
        assert np.einsum("ij,ij->", a, np.cross(b, c)) > 0


def test_icosphere_and_torus_lie_on_their_surfaces():
    np.testing.assert_allclose(np.linalg.norm(shapes.sphere(3, radius=2.5).points, axis=1), 2.5, rtol=1e-14)
    x, y, z = shapes.torus(2, 0.3).points.T
    np.testing.assert_allclose(np.hypot(np.hypot(x, y) - 2, z), 0.3, rtol=1e-12)


def test_the_knot_has_the_volume_of_a_tube_around_its_centre_line():
    knot = shapes.trefoil_knot(0.3, 2000, 60)
    length = np.linalg.norm(np.diff(knot.points.reshape(2000, 60, 3).mean(axis=1), axis=0, append=0)[:-1], axis=1).sum()
    a, b, c = (knot.points[knot.faces[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
    section = 0.5 * 60 * np.sin(2 * np.pi / 60) * 0.3**2  # of the polygon of 60 corners
    assert volume == pytest.approx(section * length, rel=2e-3)


@pytest.mark.parametrize("n", [6, 12, 20])
def test_creases_of_the_part_are_exactly_the_edges_that_turn(n):
    part, features = shapes.cad_part(n), shapes.cad_features(n)
    normals = part.face_normals[part.edge_faces]
    turn = np.degrees(np.arccos(np.clip((normals[:, 0] * normals[:, 1]).sum(axis=1), -1, 1)))
    on_crease = (part.edges[:, None] == features.creases[None]).all(axis=2).any(axis=1)
    assert on_crease.sum() == len(features.creases)
    np.testing.assert_allclose(turn[on_crease][features.weak], 20, atol=1e-6)
    assert turn[on_crease][~features.weak].min() > 69.9
    # What is left are the flats, and the facets of boss and bore, which turn less the finer they are.
    steps = turn[~on_crease]
    assert np.all((steps < 1e-5) | np.isclose(steps, steps.max()) | np.isclose(steps, steps[steps > 1e-5].min()))
    assert steps.max() < 360 / (4 * (0.5 * np.pi * 0.28 * n - 0.5)) + 1e-6


@pytest.mark.parametrize("n", [3, 8])
def test_corners_of_the_part_are_where_three_creases_meet(n):
    features = shapes.cad_features(n)
    degree = np.bincount(features.creases.ravel())
    np.testing.assert_array_equal(np.flatnonzero(degree >= 3), features.corners)
    assert set(degree) == {0, 2, 3}
    assert len(features.corners) == 10
    assert features.weak.sum() == n


@pytest.mark.parametrize("n", [6, 12, 24])
def test_triangles_of_the_part_are_about_even(n):
    part = shapes.cad_part(n)
    assert part.edge_lengths.min() > 0.4 / n
    assert part.edge_lengths.max() < 2.5 / n


def test_unknown_sample_names_the_known_ones():
    with pytest.raises(OptionError, match=r"teapot.*torus"):
        shapes.sample("teapot")


def test_too_coarse_shapes_are_refused():
    for make in (
        lambda: shapes.torus(n_minor=2),
        lambda: shapes.box(n=0),
        lambda: shapes.cad_part(2),
        lambda: shapes.cylinder(n_along=0),
    ):
        with pytest.raises(OptionError, match="at least"):
            make()
