"""The fit of a mesh to a surface: it lowers error and improves triangles, and keeps topology, corners, what is held."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anisomesh._kernels import fit_moves, vectors
from anisomesh.features.detect import corners, sharp_edges
from anisomesh.fitting.fit import FitOptions, FitPlan, fit_mesh
from anisomesh.fitting.samples import sample_surface
from anisomesh.fitting.state import FitState
from anisomesh.fitting.target import FitTarget
from anisomesh.fitting.valid import fit_without_faults
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.distance import surface_distance
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import euler_characteristic, is_oriented
from anisomesh.mesh.validity import faulty_faces
from anisomesh.meshops.decimation import Decimated, decimate
from anisomesh.metric.field import MetricField
from anisomesh.metric.quality import anisotropic_quality
from anisomesh.metric.transfer import PlacedMetric
from anisomesh.shapes import analytic as shapes
from anisomesh.shapes.cad_part import cad_part
from conftest import examples

NO_EDGES = np.zeros((0, 2), dtype=np.int64)


def target_of(surface, tensor=None, crease_angle=40.0, count=20_000):
    """Return the target of fits to a surface in a metric that is the same everywhere."""
    tensors = np.tile(np.eye(3) if tensor is None else tensor, (surface.n_points, 1, 1))
    reference, sharp = ClosestPoints(surface), sharp_edges(surface, crease_angle)
    samples = sample_surface(
        surface,
        count,
        creases=sharp,
        metric=PlacedMetric(reference, MetricField(tensors=tensors)),
        rng=np.random.default_rng(1),
    )
    return FitTarget(
        reference=reference,
        samples=samples,
        corners=surface.points[corners(surface, sharp)],
        crease_angle=crease_angle,
    )


def shaken(surface, size, seed=0, chosen=None):
    """Return a surface with points moved by normally distributed vectors of this length over the mean edge length."""
    moves = np.random.default_rng(seed).normal(size=surface.points.shape) * size * surface.edge_lengths.mean()
    if chosen is not None:
        moves[~chosen] = 0.0
    return Surface(surface.points + moves, surface.faces)


coordinate = st.floats(-2.0, 2.0, width=32)
vector = st.tuples(coordinate, coordinate, coordinate)


@given(p=vector, a=vector, b=vector, c=vector)
def test_the_closest_point_of_a_triangle_is_nearer_than_any_other(p, a, b, c):
    corner = np.array([a, b, c])
    sides = corner[[1, 2]] - corner[0]
    if np.linalg.norm(np.cross(*sides)) < 1e-3:
        return
    weights = np.array(vectors.closest_weights(p, a, b, c))
    assert weights.sum() == pytest.approx(1.0)
    assert (weights >= -1e-12).all()
    steps = np.linspace(0.0, 1.0, 12)
    grid = np.array([(1.0 - u - v, u, v) for u in steps for v in steps if u + v <= 1.0])
    nearest = np.linalg.norm(grid @ corner - p, axis=1).min()
    assert np.linalg.norm(weights @ corner - p) <= nearest + 1e-9


@given(seed=st.integers(0, 10_000), shift=st.floats(0.1, 10.0))
def test_small_systems_are_solved(seed, shift):
    half = np.random.default_rng(seed).normal(size=(3, 3))
    matrix, right = half @ half.T, np.random.default_rng(seed + 1).normal(size=3)
    upper = tuple(float(matrix[i, j]) for i in range(3) for j in range(i, 3))
    step = vectors.solve_symmetric(upper, shift, tuple(right.tolist()))
    np.testing.assert_allclose(step, np.linalg.solve(matrix + shift * np.eye(3), right), rtol=1e-9, atol=1e-12)


def energy_by_search(state, samples, price):
    """Return the energy of a fit with the nearest of all triangles for each sample, and without kernels."""
    mesh, alive = state.fit.mesh, state.fit.mesh.faces[:, 0] >= 0
    faces, roots = mesh.faces[alive], state.fit.roots[alive]
    quality = anisotropic_quality(mesh.points, faces, np.repeat(roots[:, None], 3, axis=1))
    squared = ClosestPoints(Surface(mesh.points, faces)).squared_distances(samples.points)
    return (samples.weights * squared).sum() + price * (1 - quality).sum()


def assert_consistent(state):
    """Check neighbours and labels of faces, faces of points, and that each sample is on one list, of its face."""
    fit, mesh = state.fit, state.fit.mesh
    alive = np.flatnonzero(mesh.faces[:, 0] >= 0)
    listed = np.full(len(fit.samples.points), -1)
    for face in alive.tolist():
        for side in range(3):
            other = mesh.neighbours[face, side]
            x, y = mesh.faces[face, (side + 1) % 3], mesh.faces[face, (side + 2) % 3]
            if other >= 0:
                assert {x, y} < set(mesh.faces[other].tolist())
                back = int(np.flatnonzero(mesh.neighbours[other] == face)[0])
                assert mesh.labels[other, back] == mesh.labels[face, side]
        sample = fit.samples.first[face]
        while sample >= 0:
            assert listed[sample] == -1
            listed[sample] = face
            sample = fit.samples.following[sample]
    np.testing.assert_array_equal(listed, fit.samples.owner)
    used = np.unique(mesh.faces[alive])
    for point in used.tolist():
        assert point in mesh.faces[fit.face_at[point]]
    assert (np.delete(fit.face_at, used) == -1).all()


def passes(state, price):
    """Yield a name and a function for every kind of change."""

    def exchange():
        added = state.split(price, 10)
        assert added > 0
        assert_consistent(state)
        assert state.collapse(price, added) == added

    yield "moves", lambda: state.move(price)
    yield "flips", lambda: state.flip(price)
    yield "exchange", exchange
    yield "moves", lambda: state.move(price)


@pytest.mark.parametrize("surface", [shapes.ellipsoid(subdivisions=3), cad_part(6)], ids=["ellipsoid", "part"])
def test_every_pass_lowers_the_energy_and_leaves_consistent_arrays(surface):
    mesh = shaken(surface, 0.15, chosen=~corners(surface, sharp_edges(surface, 40.0)))
    target = target_of(surface)
    state = FitState(target.task(mesh, NO_EDGES), target.samples, n_spare=10)
    price = 0.3 * state.mean_triangle_error
    before = energy_by_search(state, target.samples, price)
    assert state.energy(price) == pytest.approx(before, rel=0.02)
    for name, work in passes(state, price):
        work()
        assert_consistent(state)
        after = energy_by_search(state, target.samples, price)
        assert after < before, name
        before = after


def test_what_was_saved_comes_back():
    surface = shapes.torus(n_major=30, n_minor=12)
    mesh, target = shaken(surface, 0.1), target_of(surface, count=3_000)
    state = FitState(target.task(mesh, NO_EDGES), target.samples, n_spare=20)
    price = state.mean_triangle_error
    saved, before, error = state.saved(), state.surface(), state.error
    state.sweep(price)
    state.split(0.1 * price, 20)
    assert state.surface().n_points > mesh.n_points
    state.restore(saved)
    assert_consistent(state)
    np.testing.assert_array_equal(state.surface().points, before.points)
    np.testing.assert_array_equal(state.surface().faces, before.faces)
    assert state.error == error


@pytest.mark.parametrize("n", [2, 3])
def test_spheres_come_near_to_the_best_piecewise_linear_surface(n):
    """A triangle of area A on a unit sphere has the mean squared distance A^2 / 180 at best."""
    sphere = shapes.sphere(5, radius=0.3)
    mesh = shapes.sphere(n, radius=0.3)
    fitted = fit_without_faults(mesh, target_of(sphere, count=60_000), crease_edges=NO_EDGES)
    bound = sphere.area / mesh.n_faces / 0.3 / np.sqrt(180.0)
    rms, before = surface_distance(sphere, fitted).rms, surface_distance(sphere, mesh).rms
    assert 0.95 * bound < rms < 1.15 * bound
    assert rms < 0.6 * before


def test_a_box_with_moved_points_in_its_faces_is_exact_and_gets_even_triangles():
    box = shapes.box(n=6)
    at_faces = (np.isclose(box.points, 0.0) | np.isclose(box.points, 1.0)).sum(axis=1)
    inside = at_faces == 1
    moves = 0.4 / 6 * np.random.default_rng(3).uniform(-1, 1, box.points.shape)
    moves[np.isclose(box.points, 0.0) | np.isclose(box.points, 1.0)] = 0.0
    mesh = Surface(box.points + np.where(inside[:, None], moves, 0.0), box.faces)
    fitted = fit_without_faults(mesh, target_of(box), crease_edges=NO_EDGES)
    distance = surface_distance(box, fitted, samples=10_000)
    assert distance.hausdorff < 1e-9
    even = np.tile(np.eye(3), (box.n_points, 1, 1))
    quality = [anisotropic_quality(m.points, m.faces, even).mean() for m in (mesh, fitted)]
    assert quality[1] > quality[0] + 0.05
    corner = at_faces == 3
    np.testing.assert_array_equal(fitted.points[corner], box.points[corner])


def test_triangles_get_the_shape_that_the_metric_asks_for():
    plate = shapes.box(extent=(1.0, 1.0, 0.2), n=8)
    mesh = shaken(plate, 0.0)
    target = target_of(plate, tensor=np.diag([1.0, 9.0, 1.0]))
    fitted = fit_without_faults(mesh, target, crease_edges=NO_EDGES)
    roots = np.tile(np.diag([1.0, 3.0, 1.0]), (plate.n_points, 1, 1))
    before, after = (anisotropic_quality(m.points, m.faces, roots).mean() for m in (mesh, fitted))
    assert after > before + 0.01


def test_what_is_held_or_kept_stays():
    patch = shapes.open_patch(lambda x, y: 0.2 * x * x - 0.1 * y * y, n=12)
    mesh = shaken(patch, 0.1, chosen=~patch.on_boundary)
    target = dataclasses.replace(target_of(patch), holds_creases=True)
    edges = mesh.edges[::7].astype(np.int64)
    task = target.task(mesh, edges)
    np.testing.assert_array_equal(np.unique(edges), np.flatnonzero(task.held))
    task = dataclasses.replace(task, held=np.arange(mesh.n_points) % 5 == 0)
    fitted = fit_mesh(task, target.samples, FitOptions(rounds=0))
    still = task.held | mesh.on_boundary
    np.testing.assert_array_equal(fitted.points[still], mesh.points[still])
    assert (fitted.points[~still] != mesh.points[~still]).any()
    kept = {tuple(sorted(edge)) for edge in edges.tolist()}
    assert kept <= {tuple(sorted(edge)) for edge in fitted.edges.tolist()}
    assert (fitted.on_boundary == mesh.on_boundary).all()


@examples(40)
@given(seed=st.integers(0, 1_000), size=st.floats(0.0, 0.35))
def test_a_fit_keeps_the_topology_and_adds_no_fault(seed, size):
    surface = cad_part(5)
    mesh = shaken(surface, size, seed)
    target = target_of(surface, count=5_000)
    fitted = fit_without_faults(mesh, target, crease_edges=NO_EDGES)
    assert euler_characteristic(fitted.faces) == euler_characteristic(mesh.faces)
    assert (fitted.edge_face_count == 2).all()
    assert is_oriented(fitted.faces)
    assert len(faulty_faces(fitted, target.reference)) <= len(faulty_faces(mesh, target.reference))


def test_a_mesh_that_is_exact_stays_as_it_is_where_it_cannot_be_better():
    box = shapes.box(n=1)
    fitted = fit_without_faults(box, target_of(box, count=2_000), crease_edges=NO_EDGES)
    np.testing.assert_array_equal(fitted.points, box.points)
    assert surface_distance(box, fitted, samples=2_000).hausdorff < 1e-12


def test_a_fit_gives_the_same_bits_again():
    surface = shapes.ellipsoid(subdivisions=3)
    mesh, target = shaken(surface, 0.1), target_of(surface, count=5_000)
    first, second = (fit_without_faults(mesh, target, crease_edges=NO_EDGES) for _ in range(2))
    np.testing.assert_array_equal(first.points, second.points)
    np.testing.assert_array_equal(first.faces, second.faces)


def test_more_collapses_than_are_looked_at_first_leave_consistent_arrays(monkeypatch):
    """Sides of faces that earlier collapses have removed are still on the list."""
    monkeypatch.setattr("anisomesh.fitting.state._CHEAP_FACTOR", 1)
    surface = shapes.ellipsoid(subdivisions=3)
    target = target_of(surface, count=5_000)
    state = FitState(target.task(surface, NO_EDGES), target.samples, n_spare=1)
    count = surface.n_points // 2
    assert state.collapse(state.mean_triangle_error, count) == count
    assert_consistent(state)
    mesh = state.surface()
    assert mesh.n_points == surface.n_points - count
    assert (mesh.edge_face_count == 2).all()
    assert euler_characteristic(mesh.faces) == 2


def test_a_fit_that_leaves_faults_gives_the_mesh_itself(monkeypatch):
    surface = shapes.ellipsoid(subdivisions=3)
    mesh, target = shaken(surface, 0.1), target_of(surface, count=5_000)
    before = faulty_faces(mesh, target.reference)

    def with_a_fault(one, reference):
        return before if one is mesh else np.arange(len(before) + 1)

    monkeypatch.setattr("anisomesh.fitting.valid.faulty_faces", with_a_fault)
    assert fit_without_faults(mesh, target, crease_edges=NO_EDGES) is mesh


def test_a_decimation_is_fitted_where_the_options_say_so_and_faults_leave_the_mesh(monkeypatch):
    part = cad_part(8)
    mesh = shaken(decimate(part, 200, held=corners(part, sharp_edges(part, 40.0))).surface, 0.0)
    target = target_of(part)
    plan = FitPlan(decimation=FitOptions(price=10.0, min_quality=0.75))
    nearest = dataclasses.replace(target, plan=plan)
    fitted = fit_without_faults(mesh, nearest, crease_edges=NO_EDGES)
    alone = fit_without_faults(mesh, target, crease_edges=NO_EDGES)
    assert fitted.n_points == alone.n_points == 200
    assert not np.array_equal(fitted.points, alone.points)
    undecimated = Decimated(surface=part, crease_edges=NO_EDGES)
    monkeypatch.setattr("anisomesh.fitting.valid.decimate", lambda surface, n_points, **_: undecimated)
    again = fit_without_faults(mesh, nearest, crease_edges=NO_EDGES)
    np.testing.assert_array_equal(again.points, alone.points)


def test_only_points_and_edges_on_lines_are_held():
    part = shapes.box((1.0, 1.0, 1.0), n=4)
    ends = part.points[part.edges]
    sharp = part.edges[sharp_edges(part, 40.0)].astype(np.int64)
    lines = part.edges[(ends[..., 0] == 0.0).all(axis=1) & (ends[..., 2] == 0.0).all(axis=1)].astype(np.int64)
    target = dataclasses.replace(target_of(part), lines=lines)
    task = target.task(part, sharp)
    expected = target.at_corners(part.points)
    expected[lines] = True
    np.testing.assert_array_equal(task.held, expected)
    np.testing.assert_array_equal(part.edges[task.kept], np.unique(np.sort(lines, axis=1), axis=0))


def test_the_price_rises_until_the_triangles_are_good_enough():
    surface = shapes.ellipsoid(subdivisions=4)
    start = decimate(surface, 200).surface
    target = target_of(surface)
    task = target.task(start, NO_EDGES)
    wanted = (0.0, 0.95)
    fitted = [fit_mesh(task, target.samples, FitOptions(price=1.0, min_quality=quality)) for quality in wanted]
    states = [FitState(target.task(mesh, NO_EDGES), target.samples, n_spare=0) for mesh in fitted]
    assert states[0].mean_quality < states[1].mean_quality
    assert states[0].error < states[1].error


def test_a_fit_gives_the_same_bits_with_any_number_of_threads(monkeypatch):
    monkeypatch.setattr("anisomesh.fitting.state._MIN_ITEMS", 32)  # so that exchanges are looked at in parts, too
    surface = shapes.ellipsoid(subdivisions=4)
    mesh, target = shaken(surface, 0.1), target_of(surface, count=20_000)
    results = [fit_mesh(target.task(mesh, NO_EDGES), target.samples, threads=n) for n in (1, 2, 3)]
    for result in results[1:]:
        np.testing.assert_array_equal(result.points, results[0].points)
        np.testing.assert_array_equal(result.faces, results[0].faces)


def test_neighbours_have_different_colours():
    surface = cad_part(8)
    target = target_of(surface, count=5_000)
    state = FitState(target.task(surface, NO_EDGES), target.samples, n_spare=5)
    state.fit.active[::3] = 0
    colours = np.empty(len(state.fit.freedom), dtype=np.int32)
    count = fit_moves.colour_points(state.fit, colours)
    assert 3 < count < 20
    moved = (state.fit.active == 1) & (state.fit.freedom > 0) & (state.fit.face_at >= 0)
    np.testing.assert_array_equal(colours >= 0, moved)
    first, second = colours[surface.edges].T
    assert ((first != second) | (first < 0)).all()
