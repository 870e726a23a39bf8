"""Nothing that a mesh carries is lost by remeshing."""

import numpy as np
import pytest

import anisomesh
from anisomesh import Mesh, Regions, Surface
from anisomesh.shapes.analytic import box, sphere

BOX = box((1.0, 0.7, 0.5), n=6)


def sides_of(surface):
    """The side of a box, 0 to 5, that each face is on."""
    return np.argmax(np.concatenate([surface.face_normals, -surface.face_normals], axis=1), axis=1)


def atlas(surface):
    """Texture coordinates (F, 3, 2) of a box with a chart for each of its sides."""
    side, corners = sides_of(surface), surface.points[surface.faces]
    axes = np.array([[1, 2], [0, 2], [0, 1]])[side % 3]
    across = np.take_along_axis(corners, axes[:, None, :].repeat(3, axis=1), axis=2)
    return np.stack([(0.1 + side[:, None] + 0.8 * across[..., 0]) / 6.0, across[..., 1]], axis=2)


def areas(surface, labels):
    return np.bincount(labels, surface.face_areas, minlength=8)


def colour(points):
    return 0.5 + 0.5 * np.sin(points @ [2.0, 1.0, -1.5])


@pytest.fixture(scope="module")
def divided_box():
    """A box with seven regions, two of them on one side, texture coordinates, and data of all kinds."""
    labels = sides_of(BOX)
    labels[(labels == 2) & (BOX.points[BOX.faces][..., 0].mean(axis=1) > 0.5)] = 6
    mesh = Mesh(
        surface=BOX,
        point_data={"t": BOX.points @ [1.0, 2.0, 3.0], "k": np.arange(BOX.n_points)},
        face_data={"load": np.where(labels == 6, 2.5, 0.0)},
        corner_data={"uv": atlas(BOX)},
        regions={"group": Regions(labels, {6: "load"})},
        materials={"steel": 7.85},
    )
    return mesh, anisomesh.remesh(mesh, n_vertices=150)


def test_regions_of_a_part_are_exact(divided_box):
    mesh, result = divided_box
    labels = result.mesh.regions["group"].labels
    expected = areas(BOX, mesh.regions["group"].labels)
    np.testing.assert_allclose(areas(result.surface, labels), expected, atol=1e-9)
    assert result.mesh.regions["group"].names == {6: "load"}
    np.testing.assert_array_equal(result.mesh.face_data["load"], np.where(labels == 6, 2.5, 0.0))
    assert result.surface.n_points == 150
    assert result.warnings == ()


def test_data_and_textures_of_a_part_are_exact(divided_box):
    _, result = divided_box
    np.testing.assert_allclose(result.mesh.point_data["t"], result.surface.points @ [1.0, 2.0, 3.0], atol=1e-9)
    np.testing.assert_allclose(result.mesh.corner_data["uv"], atlas(result.surface), atol=1e-9)
    assert set(result.mesh.point_data["k"]) <= set(range(BOX.n_points))
    assert result.mesh.surface is result.surface
    assert result.mesh.materials == {"steel": 7.85}
    assert 0.0 < result.seconds["attributes"] < 0.5 * result.seconds["total"]


@pytest.mark.slow
def test_without_regions_no_edge_is_held_and_without_attributes_nothing_is_carried(divided_box):
    mesh, _ = divided_box
    plain = anisomesh.remesh(BOX, n_vertices=150)
    free = anisomesh.remesh(mesh, n_vertices=150, regions=False)
    bare = anisomesh.remesh(mesh, n_vertices=150, attributes=False)
    for result in (free, bare):
        np.testing.assert_array_equal(result.surface.points, plain.surface.points)
        np.testing.assert_array_equal(result.surface.faces, plain.surface.faces)
    assert "group" in free.mesh.regions
    assert bare.mesh.is_bare
    assert plain.mesh.is_bare


def test_a_decimation_keeps_the_borders_of_regions(divided_box):
    mesh, _ = divided_box
    result = anisomesh.remesh(mesh, n_vertices=60, metric="approximation")
    expected = areas(BOX, mesh.regions["group"].labels)
    np.testing.assert_allclose(areas(result.surface, result.mesh.regions["group"].labels), expected, atol=1e-9)


def test_a_border_is_held_where_short_edges_of_the_input_are_collapsed():
    plate = box((2.0, 1.0, 0.2), n=8)
    labels = sides_of(plate)
    labels[(labels == 2) & (plate.points[plate.faces][..., 0].mean(axis=1) > 1.0)] = 6
    result = anisomesh.remesh(Mesh(surface=plate, regions={"r": Regions(labels)}), n_vertices=100)
    np.testing.assert_allclose(areas(result.surface, result.mesh.regions["r"].labels), areas(plate, labels), atol=1e-9)


def test_faces_that_the_repair_reverses_keep_what_they_carry(divided_box):
    mesh, _ = divided_box
    reversed_faces = np.arange(BOX.n_faces) % 5 == 0
    faces, uv = BOX.faces.copy(), mesh.corner_data["uv"].copy()
    faces[reversed_faces], uv[reversed_faces] = faces[reversed_faces][:, ::-1], uv[reversed_faces][:, ::-1]
    given = Mesh(surface=Surface(BOX.points, faces), corner_data={"uv": uv}, regions=mesh.regions)
    result = anisomesh.remesh(given, n_vertices=100)
    assert result.prepare_report.faces_flipped > 0
    np.testing.assert_allclose(result.mesh.corner_data["uv"], atlas(result.surface), atol=1e-9)


@pytest.mark.slow
def test_borders_on_a_scan_are_kept_and_cost_little():
    ball = sphere(4)
    height = ball.points[ball.faces].mean(axis=1) @ [0.0, 0.6, 0.8]
    labels = np.digitize(height, [-0.6, 0.5])
    result = anisomesh.remesh(Mesh(surface=ball, regions={"r": Regions(labels)}), n_vertices=900)
    free = anisomesh.remesh(ball, n_vertices=900)
    found, expected = (
        areas(*each) / each[0].area for each in ((result.surface, result.mesh.regions["r"].labels), (ball, labels))
    )
    np.testing.assert_allclose(found, expected, atol=0.005)
    stretch = [each.report()["stretch"]["mean"] for each in (result, free)]
    assert stretch[0] < 1.1 * stretch[1]


@pytest.mark.slow
def test_a_texture_looks_the_same_across_its_seam():
    ball = sphere(4)
    corners = ball.points[ball.faces]
    middle = np.arctan2(*corners.mean(axis=1)[:, 1::-1].T)
    angle = np.arctan2(corners[..., 1], corners[..., 0])
    angle += 2.0 * np.pi * np.round((middle[:, None] - angle) / (2.0 * np.pi))
    uv = np.stack([angle, np.arcsin(np.clip(corners[..., 2], -1.0, 1.0))], axis=2)
    result = anisomesh.remesh(Mesh(surface=ball, corner_data={"uv": uv}), n_vertices=700)
    middle_uv = result.mesh.corner_data["uv"].mean(axis=1)
    around, up = middle_uv.T
    looked_up = colour(np.stack([np.cos(around) * np.cos(up), np.sin(around) * np.cos(up), np.sin(up)], axis=1))
    places = result.surface.points[result.surface.faces].mean(axis=1)
    seen = colour(places / np.linalg.norm(places, axis=1, keepdims=True))
    assert np.abs(looked_up - seen).mean() < 0.02


def test_features_and_fixed_points_of_the_mesh_stay():
    surface = BOX
    line = surface.edges[
        (np.abs(surface.points[surface.edges][..., 1] - 0.35) < 1e-9).all(axis=1)
        & (surface.points[surface.edges][..., 2] == 0.5).all(axis=1)
    ]
    inside = np.flatnonzero(
        (surface.points[:, 2] == 0.0) & (np.abs(surface.points[:, :2] - [0.5, 0.35]).max(axis=1) < 0.3)
    )
    mesh = Mesh(surface=surface, features=line, fixed_points=inside[::6])
    result = anisomesh.remesh(mesh, n_vertices=200)
    assert result.feature_distance < 1e-9
    length = np.linalg.norm(np.diff(result.surface.points[result.mesh.features], axis=1), axis=2).sum()
    assert abs(length - 1.0) < 1e-9
    np.testing.assert_allclose(
        np.sort(result.surface.points[result.mesh.fixed_points], axis=0),
        np.sort(surface.points[mesh.fixed_points], axis=0),
        atol=1e-12,
    )


def test_borders_that_take_too_many_vertices_are_given_up():
    labels = np.arange(BOX.n_faces) % 7
    result = anisomesh.remesh(Mesh(surface=BOX, regions={"r": Regions(labels)}), n_vertices=60)
    assert result.surface.n_points == 60
    assert any(text.startswith("edges do not follow all borders between regions") for text in result.warnings)


@pytest.mark.slow
def test_the_search_for_a_distance_carries_attributes():
    mesh = Mesh(surface=BOX, regions={"side": Regions(sides_of(BOX))})
    result = anisomesh.remesh(mesh, max_error=1e-3)
    np.testing.assert_array_equal(result.mesh.regions["side"].labels, sides_of(result.surface))


@pytest.mark.parametrize("followed", [True, False])
def test_a_small_region_of_a_scan_is_kept_or_its_loss_is_named(followed):
    ball = sphere(3)
    labels = np.zeros(ball.n_faces, dtype=np.int64)
    labels[np.argsort(-ball.points[ball.faces][:, :, 2].mean(axis=1), kind="stable")[:2]] = 7
    mesh = Mesh(surface=ball, regions={"part": Regions(labels, {7: "patch"})})
    result = anisomesh.remesh(mesh, n_vertices=60, embedding="direct", regions=followed)
    before, after = (m.surface.face_areas[m.regions["part"].labels == 7].sum() for m in (mesh, result.mesh))
    assert (after > 0.9 * before) == followed
    said = [line for line in result.warnings if "regions have lost area: patch" in line]
    assert bool(said) != followed
