"""Objects of other libraries keep what they carry, on the way in and on the way back."""

import io
import logging
from dataclasses import replace

import meshio
import numpy as np
import pytest
import trimesh

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.meshes import load_mesh, mesh_of, save
from anisomesh.io.objects.write import to_meshio, to_pyvista, to_trimesh
from anisomesh.shapes import analytic as shapes

SURFACE = shapes.box(n=2)
N_POINTS, N_FACES = SURFACE.n_points, SURFACE.n_faces
RNG = np.random.default_rng(0)
LABELS = np.arange(N_FACES) // 20 + 1
FULL = Mesh(
    surface=SURFACE,
    point_data={"height": RNG.random(N_POINTS), "flow": RNG.random((N_POINTS, 3)), "hot": RNG.random(N_POINTS) > 0.5},
    face_data={"pressure": RNG.random(N_FACES).astype(np.float32)},
    corner_data={"uv": RNG.integers(0, 3, (N_FACES, 3, 2)).astype(float)},
    regions={"physical": Regions(LABELS, {1: "inlet", 2: "Wände"})},
    features=SURFACE.edges[::5].astype(np.int64),
    fixed_points=np.array([1, 4]),
    feature_regions={"physical": Regions(np.arange(len(SURFACE.edges[::5])) % 3, {1: "rim"})},
    fixed_point_regions={"physical": Regions(np.array([0, 7]), {7: "probe"})},
)


def assert_same(mesh, expected, *left_out):
    np.testing.assert_array_equal(mesh.surface.points, expected.surface.points)
    np.testing.assert_array_equal(mesh.surface.faces, expected.surface.faces)
    for kind in ("point_data", "face_data", "corner_data"):
        found, wanted = getattr(mesh, kind), getattr(expected, kind)
        assert set(found) == set(wanted) - set(left_out)
        for name, values in found.items():
            np.testing.assert_array_equal(values, wanted[name])
    for name, regions in expected.regions.items():
        np.testing.assert_array_equal(mesh.regions[name].labels, regions.labels)
        assert mesh.regions[name].names == regions.names
    if "features" not in left_out:
        rows = [set(map(tuple, np.sort(m.features).tolist())) for m in (mesh, expected)]
        assert rows[0] == rows[1]
        assert mesh.fixed_points.tolist() == expected.fixed_points.tolist()
        for kind in ("feature_regions", "fixed_point_regions"):
            assert getattr(mesh, kind).keys() == getattr(expected, kind).keys()
            for name, wanted in getattr(expected, kind).items():
                np.testing.assert_array_equal(getattr(mesh, kind)[name].labels, wanted.labels)
                assert getattr(mesh, kind)[name].names == wanted.names


def test_pyvista_and_back(caplog):
    pyvista = pytest.importorskip("pyvista")
    data = to_pyvista(FULL)
    assert isinstance(data, pyvista.PolyData)
    assert data.active_texture_coordinates is not None
    assert_same(mesh_of(data), FULL)
    assert_same(mesh_of(data.cast_to_unstructured_grid()), FULL)
    assert caplog.text == ""


def test_meshio_and_back(caplog):
    data = to_meshio(FULL)
    assert caplog.messages == ["left out what meshio cannot hold: corner data 'uv'"]
    assert data.field_data["inlet"].tolist() == [1, 2]
    assert data.field_data["rim"].tolist() == [1, 1]
    assert data.field_data["probe"].tolist() == [7, 0]
    assert_same(mesh_of(data), FULL, "uv")


def test_trimesh_and_back(caplog):
    bare = {"regions": {}, "feature_regions": {}, "fixed_point_regions": {}}
    mesh = replace(FULL, **bare, features=FULL.features[:0], fixed_points=FULL.fixed_points[:0])
    data = to_trimesh(mesh)
    read = mesh_of(data)
    assert caplog.text == ""
    for name, values in mesh.corner_data.items():
        np.testing.assert_array_equal(read.point_data[name][read.surface.faces], values)
    for name, values in mesh.point_data.items():
        np.testing.assert_array_equal(read.point_data[name][read.surface.faces], values[SURFACE.faces])
    np.testing.assert_array_equal(read.face_data["pressure"], mesh.face_data["pressure"])
    assert read.regions == {}
    without_seams = replace(mesh, corner_data={}, regions={"node": FULL.regions["physical"]})
    scene = to_trimesh(without_seams)
    assert set(scene.geometry) == {"inlet", "Wände", "region_3"}
    np.testing.assert_array_equal(
        np.concatenate([part.face_attributes["pressure"] for part in scene.geometry.values()]),
        mesh.face_data["pressure"],
    )
    to_trimesh(FULL)
    assert "names of regions 'physical'; 15 feature edge(s); 2 fixed point(s)" in caplog.text


def test_scenes_of_trimesh_keep_nodes_colours_and_textures(caplog):
    image = pytest.importorskip("PIL.Image").new("RGB", (4, 4), (255, 0, 0))
    left, right = trimesh.creation.box(), trimesh.creation.icosphere(1)
    texture = RNG.random((len(left.vertices), 2))
    left.visual = trimesh.visual.TextureVisuals(uv=texture, image=image)
    right.visual.vertex_colors = colours = RNG.integers(0, 255, (len(right.vertices), 4), dtype=np.uint8)
    right.face_attributes["weight"] = weight = RNG.random(len(right.faces))
    scene = trimesh.Scene({"left": left, "right": right})
    scene.units = "inches"
    mesh = mesh_of(scene)
    assert mesh.regions["node"].names == {0: "left", 1: "right"}
    np.testing.assert_array_equal(mesh.point_data["uv"][: len(texture)], texture)
    np.testing.assert_array_equal(mesh.point_data["color"][len(texture) :], colours)
    np.testing.assert_array_equal(mesh.face_data["weight"][-len(weight) :], weight)
    assert mesh.materials["unit"] == "inch"
    assert "vertices of its meshes without uv, color get 0, NaN or white" in caplog.text
    stream = io.BytesIO()
    save(replace(mesh, face_data={}, materials={"trimesh": mesh.materials["trimesh"]}), stream, file_format="glb")
    read = load_mesh(io.BytesIO(stream.getvalue()), file_format="glb")
    again = to_trimesh(read)
    assert list(again.geometry) == ["left", "right"]
    assert np.asarray(again.geometry["left"].visual.material.baseColorTexture)[0, 0].tolist() == [255, 0, 0]
    faces = trimesh.creation.box()
    faces.visual.face_colors = RNG.integers(0, 255, (12, 4), dtype=np.uint8)
    np.testing.assert_array_equal(mesh_of(faces).face_data["color"], faces.visual.face_colors)


def test_blocks_of_pyvista_have_their_names_and_data(caplog):
    pyvista = pytest.importorskip("pyvista")
    ball, grid = pyvista.Sphere(), pyvista.Sphere().cast_to_unstructured_grid()
    ball.point_data["height"], grid.point_data["height"] = ball.points[:, 2], 2 * ball.points[:, 2]
    ball.field_data["title"] = grid.field_data["title"] = ["a title"]
    mesh = mesh_of(pyvista.MultiBlock({"wing": pyvista.MultiBlock({"upper": ball}), "body": grid}))
    assert mesh.regions["block"].names == {0: "wing/upper", 1: "body"}
    assert np.bincount(mesh.regions["block"].labels).tolist() == [ball.n_cells] * 2
    np.testing.assert_array_equal(mesh.point_data["height"][ball.n_points :], 2 * ball.points[:, 2])
    assert mesh.point_data["normal"].shape == (2 * ball.n_points, 3)
    assert mesh.materials["field_data"]["title"].tolist() == ["a title"]
    assert caplog.text == ""
    assert "block" not in mesh_of(ball).regions


def test_sets_of_meshio_are_regions_and_point_data():
    cells = [("triangle", SURFACE.faces[:30]), ("line", SURFACE.edges[:3]), ("triangle", SURFACE.faces[30:])]
    sets = {
        "a": [np.arange(5), [], []],
        "b": [[7], [], np.arange(4)],
        "over both": [np.arange(9), [0], []],
    }
    given = meshio.Mesh(SURFACE.points, cells, cell_sets=sets, point_sets={"clamped": [0, 3]})
    mesh = mesh_of(given)
    first, second = mesh.regions["cell_set"], mesh.regions["cell_set 2"]
    assert {first.names[k]: np.flatnonzero(first.labels == k).tolist() for k in first.names} == {
        "a": [0, 1, 2, 3, 4],
        "b": [7, 30, 31, 32, 33],
    }
    assert np.flatnonzero(second.labels).tolist() == list(range(9))
    assert np.flatnonzero(mesh.point_data["clamped"]).tolist() == [0, 3]
    assert len(mesh.features) == 3
    back = to_meshio(mesh)
    assert back.cell_sets["b"][0].tolist() == [7, 30, 31, 32, 33]
    assert_same(mesh_of(back), mesh)


def test_odd_data_are_left_out_by_name(caplog):
    caplog.set_level(logging.WARNING)
    mesh = trimesh.Trimesh(SURFACE.points, SURFACE.faces, process=False)
    mesh.vertex_attributes["short"] = np.arange(3.0)
    mesh.face_attributes["object"] = np.array([None] * N_FACES)
    assert mesh_of(mesh).is_bare
    assert f"left out 'short': it does not have {N_POINTS} rows" in caplog.text
    assert "left out face data 'object' of type object" in caplog.text


def ghosts(n_cells, n_points):
    """Return marks of VTK that make every third cell a ghost, every fourth hidden, and hide the first point."""
    of_cells = np.where(np.arange(n_cells) % 3 == 0, 1, np.where(np.arange(n_cells) % 4 == 0, 32, 0))
    of_points = (np.arange(n_points) == 0) * 2
    return of_cells.astype(np.uint8), of_points.astype(np.uint8)


@pytest.mark.parametrize("suffix", [".vtu", ".vtp"])
def test_ghosts_and_hidden_cells_of_vtk_are_left_out(tmp_path, suffix, caplog):
    pyvista = pytest.importorskip("pyvista")
    data = pyvista.PolyData.from_regular_faces(SURFACE.points, SURFACE.faces)
    data.cell_data["number"] = np.arange(N_FACES)
    data.cell_data["vtkGhostType"], data.point_data["vtkGhostType"] = ghosts(N_FACES, N_POINTS)
    cells, _ = ghosts(N_FACES, N_POINTS)
    kept = np.flatnonzero((cells == 0) & (SURFACE.faces != 0).all(axis=1))
    data = data if suffix == ".vtp" else data.cast_to_unstructured_grid()
    data.save(tmp_path / f"a{suffix}")
    n_hidden = N_FACES - len(kept) - np.count_nonzero(cells == 1)
    for given in (tmp_path / f"a{suffix}", data):
        read = mesh_of(given)
        assert read.face_data["number"].tolist() == kept.tolist()
        assert "vtkGhostType" not in {*read.point_data, *read.face_data}
        np.testing.assert_array_equal(read.surface.faces, SURFACE.faces[kept])
        assert f"left out {np.count_nonzero(cells == 1)} cell(s) marked as ghosts" in caplog.text
        assert f"left out {n_hidden} cell(s) marked as hidden" in caplog.text
        caplog.clear()


def test_pieces_with_ghosts_and_global_numbers_make_the_whole():
    """Two halves that have a layer of each other's cells: every cell is there once, and no point twice."""
    pyvista = pytest.importorskip("pyvista")
    numpy_support = pytest.importorskip("vtkmodules.util.numpy_support")
    blocks = []
    for side in range(2):
        near = np.arange(0, N_FACES // 2 + 6) if side == 0 else np.arange(N_FACES // 2 - 6, N_FACES)
        used, corners = np.unique(SURFACE.faces[near], return_inverse=True)
        block = pyvista.PolyData.from_regular_faces(SURFACE.points[used], corners.reshape(-1, 3))
        block.cell_data["vtkGhostType"] = ((near < N_FACES // 2) ^ (side == 0)).astype(np.uint8)
        block.point_data["height"] = SURFACE.points[used, 2]
        numbers = numpy_support.numpy_to_vtkIdTypeArray(used.astype(np.int64), deep=True)
        numbers.SetName("id")
        block.GetPointData().SetGlobalIds(numbers)
        blocks.append(block)
    mesh = mesh_of(pyvista.MultiBlock(blocks))
    assert mesh.surface.n_points == N_POINTS
    corners = [np.sort(m.points[m.faces].reshape(N_FACES, -1), axis=0) for m in (mesh.surface, SURFACE)]
    np.testing.assert_array_equal(*corners)
    np.testing.assert_array_equal(mesh.point_data["height"], mesh.surface.points[:, 2])
    assert "id" in mesh.point_data


def test_textures_of_vtp_are_seen_by_vtk_and_read_back(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    save(FULL, tmp_path / "a.vtp")
    data = pyvista.read(tmp_path / "a.vtp")
    wanted = FULL.corner_data["uv"].reshape(-1, 2)
    np.testing.assert_array_equal(data.active_texture_coordinates[data.regular_faces.ravel()], wanted)
    np.testing.assert_array_equal(data.points[data.regular_faces], SURFACE.points[SURFACE.faces])
    assert_same(load_mesh(tmp_path / "a.vtp"), FULL)
    data.save(tmp_path / "b.vtp")  # as VTK writes it
    assert_same(load_mesh(tmp_path / "b.vtp"), FULL)


def test_blocks_keep_their_names_whatever_their_number(caplog):
    pyvista = pytest.importorskip("pyvista")
    one = pyvista.PolyData.from_regular_faces(SURFACE.points, SURFACE.faces[:1])
    many = pyvista.MultiBlock({f"part {k}": one.translate((k, 0, 0)) for k in range(20)})
    regions = mesh_of(many).regions["block"]
    assert [regions.names[label] for label in regions.labels] == [f"part {k}" for k in range(20)]
    one.cell_data["block"] = [7]
    assert mesh_of(pyvista.MultiBlock({"a": one, "b": one})).regions["block"].names == {}
    assert "left out the names of its blocks, whose cells have data 'block'" in caplog.text
