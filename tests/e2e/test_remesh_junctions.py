"""Non-manifold junctions: the sheets of the result meet as the sheets of the input do."""

from dataclasses import replace

import numpy as np
import pytest
from junction_shapes import SHAPES, lengths_by_count, square
from scipy.spatial import cKDTree

import anisomesh
from anisomesh import starts
from anisomesh.attributes.model import Mesh, Regions
from anisomesh.delaunay.meshing import mesh_from_sites
from anisomesh.junctions import join
from anisomesh.junctions.cut import cut_at_junctions
from anisomesh.mesh.distance import surface_distance
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import connected_components, euler_characteristic

QUICK = [("wavy_fin", 0.3), ("two_boxes", 0.6), ("cubes_at_an_edge", 10.0), ("soap_films", 0.3)]
CASES = [(name, ratio * (30.0 if name == "cubes_at_an_edge" else 1.0)) for name in SHAPES for ratio in (0.15, 0.8)]
FEW = {"threads": 1, "max_iterations": 10}


def check_joined(surface, result, n):
    """Assert that the sheets of a result meet as in the surface, that it has n vertices, and is valid."""
    made, validity = result.surface, result.validity
    before, after = (lengths_by_count(each.points, each.faces) for each in (surface, made))
    assert not result.warnings
    assert made.n_points == n
    assert before.keys() == after.keys()
    for count, length in before.items():  # a chord is shorter than its curve
        assert 0.97 * length < after[count] < 1.001 * length, count
    assert euler_characteristic(made.faces) == euler_characteristic(surface.faces)
    assert connected_components(made.faces, n)[0] == connected_components(surface.faces, surface.n_points)[0]
    assert validity.inverted == validity.flat == validity.new_intersections == validity.duplicate_faces == 0
    assert validity.oriented
    assert validity.nonmanifold_edges > 0
    assert validity.nonmanifold_edges_input > 0
    assert "valid" in repr(result)


@pytest.mark.parametrize(
    ("name", "ratio"), [*QUICK, *(pytest.param(*case, marks=pytest.mark.slow) for case in CASES if case not in QUICK)]
)
def test_sheets_meet_as_in_the_input(name, ratio):
    surface = Surface(*SHAPES[name]())
    n = max(round(ratio * surface.n_points), 30)
    result = anisomesh.remesh(surface, n_vertices=n, **FEW)
    check_joined(surface, result, n)
    assert surface_distance(surface, result.surface, samples=5_000).hausdorff < 0.05


def test_ratio_counts_joined_vertices():
    surface = Surface(*SHAPES["book"]())
    result = anisomesh.remesh(surface, ratio=0.4, embedding="direct", **FEW)
    assert result.surface.n_points == round(0.4 * surface.n_points)
    assert result.prepared.n_points == surface.n_points


def test_shape_and_parts_of_a_joined_mesh_are_measured_against_the_input():
    surface = Surface(*SHAPES["cubes_at_an_edge"]())
    result = anisomesh.remesh(surface, n_vertices=100, embedding="direct", **FEW)
    measured = anisomesh.evaluate(surface, result.surface, samples=2_000)
    assert measured.features.crease_covered == 1.0
    assert measured.features.corners_kept == measured.features.corners
    assert measured.validity.components == measured.validity.components_input == 1
    assert measured.validity.euler == measured.validity.euler_input
    assert measured.distance.hausdorff < 1e-6


def test_regions_and_data_of_sheets_are_kept():
    points, faces = SHAPES["two_boxes"]()
    surface = Surface(points, faces)
    middle = points[faces].mean(axis=1)
    labels = np.where(np.abs(middle[:, 0] - 1.0) < 1e-9, 7, np.where(middle[:, 0] < 1.0, 1, 2))
    mesh = Mesh(surface=surface, regions={"material": Regions(labels)}, point_data={"x": points[:, 0]})
    result = anisomesh.remesh(mesh, n_vertices=120, embedding="direct", **FEW)
    check_joined(surface, result, 120)
    made, found = result.mesh.surface, result.mesh.regions["material"].labels
    for label in (1, 2, 7):
        expected = surface.face_areas[labels == label].sum()
        assert made.face_areas[found == label].sum() == pytest.approx(expected, rel=1e-6)
    assert np.allclose(result.mesh.point_data["x"], made.points[:, 0], atol=1e-6)


def test_sheets_that_cannot_be_joined_are_apart_and_it_is_said(monkeypatch):
    monkeypatch.setattr(join.JoinTask, "conforming", lambda self, mesh: None)
    surface = Surface(*SHAPES["tee"]())
    result = anisomesh.remesh(surface, n_vertices=120, embedding="direct", **FEW)
    assert [warning for warning in result.warnings if "separate in the result" in warning]
    assert result.surface.n_points == 120
    assert result.validity.nonmanifold_edges == 0


def test_sheets_that_cannot_be_joined_in_time_are_left_apart_and_it_is_said(monkeypatch):
    def too_late(self, mesh):
        self.task.deadline.start -= 2.0 * self.task.deadline.limit

    monkeypatch.setattr(join.JoinTask, "conforming", too_late)
    surface = Surface(*SHAPES["tee"]())
    result = anisomesh.remesh(surface, n_vertices=120, embedding="direct", **FEW, time_limit=1e4)
    assert [warning for warning in result.warnings if "separate in the result" in warning]
    assert result.surface.n_points == 120


@pytest.mark.parametrize("target", [{"max_error": 0.02}, {"edge_length": 0.3}])
def test_sheets_are_joined_for_every_target(target):
    surface = Surface(*SHAPES["tee"]())
    result = anisomesh.remesh(surface, embedding="direct", **FEW, **target)
    before, after = (lengths_by_count(each.points, each.faces) for each in (surface, result.surface))
    assert before.keys() == after.keys()
    assert after[3] == pytest.approx(before[3])
    if "max_error" in target:
        assert surface_distance(surface, result.surface, samples=5_000).hausdorff <= 0.02


@pytest.mark.parametrize("name", ["two_boxes", "soap_films"])
def test_points_to_keep_on_a_junction_are_vertices_of_all_its_sheets(name):
    surface = Surface(*SHAPES[name]())
    on_junction = np.unique(surface.edges[surface.edge_face_count > 2])
    kept = np.concatenate([on_junction[:: len(on_junction) // 3][:4], np.setdiff1d(range(100), on_junction)[::30]])
    n = 150
    result = anisomesh.remesh(surface, n_vertices=n, keep_points=kept, **FEW)
    check_joined(surface, result, n)
    found = (result.surface.points[:, None] == surface.points[kept]).all(axis=2)
    assert (found.sum(axis=0) == 1).all()


@pytest.mark.parametrize(
    ("name", "lock"),
    [("wavy_fin", "far"), ("tee", "at the junction"), ("book", "at the junction"), ("two_boxes", "far")],
)
def test_sheets_are_joined_beside_locked_faces_and_to_them(name, lock):
    """Junctions keep the edges at which locked faces are; all others are joined as without a lock."""
    surface = Surface(*SHAPES[name]())
    junction = surface.points[np.unique(surface.edges[surface.edge_face_count > 2])]
    middles = surface.points[surface.faces].mean(axis=1)
    away = cKDTree(junction).query(middles)[0]
    mask = away > 0.8 * away.max() if lock == "far" else away < 0.3 * away.max()
    n = round(0.8 * surface.n_points)
    result = anisomesh.remesh(surface, n_vertices=n, lock=mask, **FEW)
    check_joined(surface, result, n)
    assert not any("separate" in warning for warning in result.warnings)
    before, after = (
        {tuple(sorted(map(tuple, corners))) for corners in each.tolist()}
        for each in (surface.points[surface.faces[mask]], result.surface.points[result.surface.faces])
    )
    assert before <= after


@pytest.mark.parametrize(("name", "share"), [("grid_of_boxes", 0.5), ("soap_films", 0.5)])
def test_junctions_are_remeshed_where_no_locked_face_is_at_them(name, share):
    """Junctions that are connected to a locked face, all of these, kept all their edges."""
    surface = Surface(*SHAPES[name]())
    middles = surface.points[surface.faces].mean(axis=1)
    mask = middles[:, 0] < surface.points[:, 0].min() + 0.12 * np.ptp(surface.points[:, 0])
    n = round(share * surface.n_points)
    result = anisomesh.remesh(surface, n_vertices=n, lock=mask, embedding="direct", **FEW)
    check_joined(surface, result, n)
    corners = surface.points[surface.faces[mask]]  # of triangles that the repair may turn round
    found = result.surface.points[result.surface.faces[: mask.sum()]]
    before, after = ([sorted(map(tuple, each)) for each in rows.tolist()] for rows in (corners, found))
    assert before == after
    on_junction = surface.points[np.unique(surface.edges[surface.edge_face_count > 2])]
    free = {tuple(row) for row in on_junction.tolist()} - {tuple(row) for row in corners.reshape(-1, 3).tolist()}
    left = free & {tuple(row) for row in result.surface.points.tolist()}
    assert len(free) >= 30
    assert len(left) < 0.5 * len(free)


@pytest.mark.parametrize(("wrong_starts", "seed"), [(0, 0), (1, 1), (9, None)])
def test_joined_sheets_of_another_topology_are_made_anew_or_left_apart(monkeypatch, wrong_starts, seed):
    """Another start is tried, and sheets apart, whose topology is right, are better than joined ones with a handle."""
    check, seen = starts.check_validity, []

    def with_handle(surface, reference, whole=None):
        found = check(surface, reference, whole)
        seen.append(whole)
        return replace(found, euler=found.euler - 2) if whole is not None and len(seen) <= wrong_starts else found

    monkeypatch.setattr(starts, "check_validity", with_handle)
    result = anisomesh.remesh(Surface(*SHAPES["tee"]()), n_vertices=120, embedding="direct", **FEW)
    assert result.validity.euler == result.validity.euler_input
    assert ["separate in the result" in warning for warning in result.warnings] == [True] * (seed is None)
    assert seed is None or result.seed == seed


def test_a_locked_face_whose_side_is_split_at_a_junction_is_said_not_to_be_locked():
    """The edge at which two cubes meet gets a point in its middle, so the four faces there change."""
    surface = Surface(*SHAPES["cubes_at_an_edge"]())
    result = anisomesh.remesh(surface, n_vertices=40, lock=np.arange(surface.n_faces) < 12, **FEW)
    before, after = (
        {tuple(sorted(map(tuple, corners))) for corners in each.tolist()}
        for each in (surface.points[surface.faces[:12]], result.surface.points[result.surface.faces])
    )
    lost = len(before - after)
    assert 0 < lost < 12
    assert f"{lost} of 12 locked faces were changed by the repair and are not locked" in result.warnings
    assert result.validity.nonmanifold_edges > 0


@pytest.mark.parametrize("how", [{"n_vertices": 150}, {"max_error": 0.01}])
def test_a_prescribed_line_across_a_junction_is_followed(how):
    surface = Surface(*SHAPES["tee"]())
    on_line = (surface.points[:, 1] == 0.0) & (surface.points[:, 2] == 0.0)
    edges = surface.edges[on_line[surface.edges].all(axis=1)]
    result = anisomesh.remesh(Mesh(surface=surface, features=edges), embedding="direct", **FEW, **how)
    assert result.warnings == ()
    assert result.feature_distance < 1e-12
    ends = result.mesh.surface.points[result.mesh.features]
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(2.0, rel=1e-12)


def test_settling_ends_with_the_time_limit(monkeypatch):
    """The clock stands still until the first change of the number of vertices, and is past the limit from then on."""
    changes = []
    with_count = join._with_count

    def last_in_time(mesh, task, *more):
        changes.append(len(mesh.points))
        task.deadline.start -= 2.0 * task.deadline.limit
        return with_count(mesh, task, *more)

    monkeypatch.setattr(join, "_with_count", last_in_time)
    surface = Surface(*SHAPES["book"]())
    result = anisomesh.remesh(surface, n_vertices=120, embedding="direct", **FEW, time_limit=1e4)
    assert len(changes) == 1
    assert lengths_by_count(result.surface.points, result.surface.faces).keys() == {1, 5}


@pytest.mark.parametrize("name", ["grid_of_boxes", "cubes_at_an_edge", "disc_in_tube"])
def test_sheets_are_joined_with_more_vertices_than_asked_for_where_junctions_need_them(name):
    """Edges of several sheets would become one, again and again, if points beside the junctions were removed."""
    surface = Surface(*SHAPES[name]())
    result = anisomesh.remesh(surface, n_vertices=6, embedding="direct", **FEW)
    made = result.surface
    before, after = (lengths_by_count(each.points, each.faces) for each in (surface, made))
    assert before.keys() == after.keys()
    assert euler_characteristic(made.faces) == euler_characteristic(surface.faces)
    assert result.validity.faults == 0
    assert f"{made.n_points} vertices instead of 6" in " ".join(result.warnings)


def test_sheets_whose_dual_lacks_their_topology_are_given_up_before_it_is_coarsened(monkeypatch):
    """What the sheets have no cells for crowds vertices at junctions; the costly way is left to the sheets apart."""
    coarsened = []
    monkeypatch.setattr(starts, "mesh_of_dual", lambda task, sites: None)
    monkeypatch.setattr(
        starts, "mesh_from_sites", lambda task, sites: coarsened.append(task) or mesh_from_sites(task, sites)
    )
    result = anisomesh.remesh(Surface(*SHAPES["tee"]()), n_vertices=120, embedding="direct", **FEW)
    assert len(coarsened) == 1
    assert [warning for warning in result.warnings if "separate in the result" in warning]
    assert result.validity.faults == 0


def test_sheets_whose_junctions_are_points_for_the_result_are_remeshed_apart_at_once(monkeypatch):
    """A fin on an edge of .02, where vertices are .3 apart, or .004 with very many of them."""
    x = np.concatenate([np.linspace(-1.0, -0.01, 9), np.linspace(0.01, 1.0, 9)])
    points, faces = square(18, 17, lambda u, v: (np.broadcast_to(x[:, None], u.shape), 2 * v - 1, 0 * u))
    foot = np.flatnonzero((np.abs(points[:, 0]) < 0.02) & (points[:, 1] == 0.0))
    surface = Surface(np.vstack([points, [0.0, 0.0, 1.0]]), np.vstack([faces, [*foot, len(points)]]))
    junctions = cut_at_junctions(anisomesh.prepare(surface))
    assert not join.are_resolved(junctions, 60)
    assert join.are_resolved(junctions, 300_000)
    optimised = []
    optimise = starts.optimise_sites
    monkeypatch.setattr(starts, "optimise_sites", lambda *task, **how: optimised.append(task) or optimise(*task, **how))
    result = anisomesh.remesh(surface, n_vertices=60, embedding="direct", **FEW)
    assert len(optimised) == 1
    assert [warning for warning in result.warnings if "separate in the result" in warning]
    assert result.validity.faults == 0
