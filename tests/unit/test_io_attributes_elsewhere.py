"""Other libraries read the attributes that we write, and we read the ones that they write."""

import logging
import zipfile
from dataclasses import replace
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
import pyvista as pv
import trimesh

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.meshes import load_mesh, save
from anisomesh.shapes import analytic as shapes

SURFACE = shapes.box(n=3)
N_POINTS, N_FACES = SURFACE.n_points, SURFACE.n_faces
RNG = np.random.default_rng(0)
HEIGHT, FLOW = RNG.normal(size=N_POINTS), RNG.normal(size=(N_POINTS, 3))
PRESSURE = RNG.normal(size=N_FACES)
LABELS = np.sort(RNG.integers(1, 4, N_FACES))
NAMES = {1: "inlet", 2: "outlet of it", 3: "Wände"}
FEATURES = SURFACE.edges[::9].astype(np.int64)
MESH = Mesh(
    surface=SURFACE,
    point_data={"height": HEIGHT, "flow": FLOW},
    face_data={"pressure": PRESSURE},
    regions={"physical": Regions(LABELS, NAMES)},
    features=FEATURES,
    fixed_points=np.array([0, 3, 8]),
)


def rows(array):
    return {tuple(row) for row in np.sort(np.asarray(array), axis=1).tolist()}


@pytest.mark.parametrize("suffix", [".vtu", ".vtp"])
def test_vtk_reads_data_lines_and_vertices(tmp_path, suffix):
    save(MESH, tmp_path / f"a{suffix}")
    read = pv.read(tmp_path / f"a{suffix}")
    grid = read.cast_to_unstructured_grid()
    np.testing.assert_array_equal(read.point_data["height"], HEIGHT)
    np.testing.assert_array_equal(read.point_data["flow"], FLOW)
    triangles = grid.celltypes == pv.CellType.TRIANGLE
    np.testing.assert_array_equal(grid.cell_data["pressure"][triangles], PRESSURE)
    assert np.isnan(grid.cell_data["pressure"][~triangles]).all()
    np.testing.assert_array_equal(grid.cell_data["physical"][triangles], LABELS)
    assert rows(grid.cells_dict[pv.CellType.LINE]) == rows(FEATURES)
    assert set(grid.cells_dict[pv.CellType.VERTEX].ravel()) == {0, 3, 8}
    text = bytes(read.field_data["regions of physical"]).decode()
    assert text.splitlines() == [f"{label} {name}" for label, name in NAMES.items()]


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("suffix", [".vtu", ".vtp"])
def test_data_that_vtk_writes(tmp_path, suffix, binary, caplog):
    data = pv.PolyData.from_regular_faces(SURFACE.points, SURFACE.faces)
    data.point_data["height"], data.point_data["flow"] = HEIGHT, FLOW.astype(np.float32)
    data.cell_data["pressure"], data.cell_data["region"] = PRESSURE, LABELS.astype(np.int32)
    data.cell_data["is hot"] = PRESSURE > 0.0
    data.active_texture_coordinates = HEIGHT[:, None] * [1.0, 2.0]
    data.field_data["time"] = [0.25]
    data.field_data["title"] = ["a title"]
    data.point_data["name"] = np.array([f"point {k}" for k in range(N_POINTS)])
    (data if suffix == ".vtp" else data.cast_to_unstructured_grid()).save(tmp_path / f"a{suffix}", binary=binary)
    read = load_mesh(tmp_path / f"a{suffix}")
    np.testing.assert_array_equal(read.point_data["height"], HEIGHT)
    np.testing.assert_array_equal(read.point_data["flow"], FLOW.astype(np.float32))
    np.testing.assert_array_equal(read.point_data["uv"], HEIGHT[:, None] * [1.0, 2.0])
    np.testing.assert_array_equal(read.point_data["name"], data.point_data["name"])
    np.testing.assert_array_equal(read.face_data["pressure"], PRESSURE)
    np.testing.assert_array_equal(read.face_data["is hot"], PRESSURE > 0.0)
    np.testing.assert_array_equal(read.regions["region"].labels, LABELS)
    np.testing.assert_array_equal(read.materials["field_data"]["time"], [0.25])
    np.testing.assert_array_equal(read.materials["field_data"]["title"], ["a title"])
    assert caplog.text == ""


def test_polygons_strips_and_lines_of_vtk_have_their_data(tmp_path):
    """VTK numbers the cells of polygon data vertices first, then lines, polygons and strips."""
    points = np.array([(x, y, 0) for y in range(2) for x in range(4)], dtype=float)
    data = pv.PolyData(points, faces=[4, 0, 1, 5, 4], lines=[3, 0, 1, 2], strips=[5, 5, 1, 6, 2, 7], verts=[1, 4, 1, 7])
    data.cell_data["number"] = np.arange(data.n_cells)
    for suffix in (".vtp", ".vtu"):
        (data if suffix == ".vtp" else data.cast_to_unstructured_grid()).save(tmp_path / f"a{suffix}")
        read = load_mesh(tmp_path / f"a{suffix}")
        assert read.face_data["number"].tolist() == [3, 3, 4, 4, 4]
        assert rows(read.features) == {(0, 1), (1, 2)}
        assert read.fixed_points.tolist() == [4, 7]


@pytest.mark.parametrize("suffix", [".vtu", ".msh"])
def test_meshio_reads_what_we_write(tmp_path, suffix):
    save(replace(MESH, features=np.zeros((0, 2), int), fixed_points=np.zeros(0, int)), tmp_path / f"a{suffix}")
    (pressure,) = meshio.read(tmp_path / f"a{suffix}").cell_data["pressure"]
    np.testing.assert_array_equal(pressure, PRESSURE)
    save(replace(MESH, face_data={}), tmp_path / f"a{suffix}")  # meshio 5.3.5 splits element data wrongly
    read = meshio.read(tmp_path / f"a{suffix}")
    np.testing.assert_array_equal(read.point_data["height"], HEIGHT)
    np.testing.assert_array_equal(read.point_data["flow"], FLOW)
    number = next(k for k, block in enumerate(read.cells) if block.type == "triangle")
    np.testing.assert_array_equal(read.cells[number].data, SURFACE.faces)
    label = "gmsh:physical" if suffix == ".msh" else "physical"
    np.testing.assert_array_equal(read.cell_data[label][number], LABELS)
    assert rows(read.cells_dict["line"]) == rows(FEATURES)
    if suffix == ".msh":
        assert {name: tuple(value) for name, value in read.field_data.items()} == {
            name: (label, 2) for label, name in NAMES.items()
        }


@pytest.mark.parametrize("form", ["gmsh22", "gmsh", "vtu", "medit"])
@pytest.mark.parametrize("binary", [True, False])
def test_meshio_data(tmp_path, form, binary):
    number = np.arange(1, N_FACES + 1) % 4 + 1
    names = {"vtu": ("physical", "region")}.get(form, ("gmsh:physical", "gmsh:geometrical"))
    data = {name: [np.full(len(FEATURES), 7), number * (k + 1)] for k, name in enumerate(names)}
    data = {"medit:ref": data["gmsh:physical"]} if form == "medit" else data
    mesh = meshio.Mesh(
        SURFACE.points,
        [("line", FEATURES), ("triangle", SURFACE.faces)],
        point_data={} if form == "medit" else {"height": HEIGHT, "flow": FLOW},
        cell_data=data,
        field_data={} if form in ("vtu", "medit") else {"left": np.array([2, 2]), "edge": np.array([7, 1])},
    )
    suffix = {"gmsh22": ".msh", "gmsh": ".msh", "vtu": ".vtu", "medit": ".mesh"}[form]
    if form == "medit" and binary:
        pytest.skip("text only")
    if form == "gmsh":  # meshio needs the entities of nodes for version 4
        mesh.point_data["gmsh:dim_tags"] = np.tile([2, 1], (N_POINTS, 1))
        mesh.cell_data["gmsh:geometrical"] = [np.ones(len(FEATURES), int), np.ones(N_FACES, int)]
        mesh.cell_data["gmsh:physical"] = [np.full(len(FEATURES), 7), np.full(N_FACES, 2)]
        number = np.full(N_FACES, 2)
    options = {"file_format": form} if form != "vtu" else {}
    options |= {} if form == "medit" else {"binary": binary}
    meshio.write(tmp_path / f"a{suffix}", mesh, **options)
    read = load_mesh(tmp_path / f"a{suffix}")
    division = {"vtu": "physical", "medit": "reference"}.get(form, "physical")
    if form != "gmsh":
        np.testing.assert_array_equal(read.regions[division].labels, number)
    if form == "gmsh22":
        assert read.regions["physical"].names == {2: "left"}
        np.testing.assert_array_equal(read.regions["geometrical"].labels, 2 * number)
    assert rows(read.features) == rows(FEATURES)
    if form == "vtu" or (form != "medit" and binary):  # text by meshio 5.3.5 and NumPy 2 has np.float64(0.5)
        np.testing.assert_allclose(read.point_data["height"], HEIGHT, rtol=1e-10)
        np.testing.assert_allclose(read.point_data["flow"], FLOW, rtol=1e-10)


def test_meshio_reads_references_of_medit(tmp_path):
    save(Mesh(surface=SURFACE, regions=MESH.regions), tmp_path / "a.mesh")
    read = meshio.read(tmp_path / "a.mesh")
    np.testing.assert_array_equal(read.cell_data_dict["medit:ref"]["triangle"], LABELS)


COLOURS = RNG.integers(0, 256, (N_POINTS, 4), dtype=np.uint8)
UV = RNG.uniform(size=(N_POINTS, 2)).astype(np.float32)


@pytest.mark.parametrize("suffix", [".ply", ".glb", ".obj"])
def test_trimesh_reads_colours(tmp_path, suffix):
    save(Mesh(surface=SURFACE, point_data={"color": COLOURS}), tmp_path / f"a{suffix}")
    read = trimesh.load(tmp_path / f"a{suffix}", process=False, force="mesh", maintain_order=True)
    np.testing.assert_allclose(read.vertices, SURFACE.points, atol=1e-7)
    np.testing.assert_array_equal(read.visual.vertex_colors[:, :3], COLOURS[:, :3])


@pytest.mark.parametrize("suffix", [".ply", ".glb", ".obj"])
def test_trimesh_writes_colours(tmp_path, suffix, caplog):
    given = trimesh.Trimesh(SURFACE.points, SURFACE.faces, vertex_colors=COLOURS, process=False)
    given.export(tmp_path / f"a{suffix}")
    read = load_mesh(tmp_path / f"a{suffix}")
    colours = read.point_data["color"]
    colours = np.rint(255 * colours) if colours.dtype.kind == "f" else colours
    width = colours.shape[1]
    np.testing.assert_array_equal(colours, COLOURS[:, :width])
    assert caplog.text == ""


@pytest.mark.parametrize("suffix", [".ply", ".glb", ".obj"])
def test_trimesh_reads_texture_coordinates(tmp_path, suffix):
    regions = {"material": Regions(np.ones(N_FACES, int), {1: "paint"})} if suffix == ".glb" else {}
    save(Mesh(surface=SURFACE, point_data={"uv": UV}, regions=regions), tmp_path / f"a{suffix}")
    read = trimesh.load(tmp_path / f"a{suffix}", process=False, force="mesh", maintain_order=True)
    np.testing.assert_allclose(read.visual.uv, UV, atol=1e-6)


def textured():
    from PIL import Image

    image = Image.fromarray(RNG.integers(0, 256, (4, 4, 3), dtype=np.uint8))
    material = trimesh.visual.material.PBRMaterial(name="paint", baseColorTexture=image, roughnessFactor=0.25)
    visual = trimesh.visual.TextureVisuals(uv=UV, material=material)
    return trimesh.Trimesh(SURFACE.points, SURFACE.faces, visual=visual, process=False), image


def test_textures_of_glb_pass_through(tmp_path, caplog):
    given, image = textured()
    given.export(tmp_path / "a.glb")
    mesh = load_mesh(tmp_path / "a.glb")
    np.testing.assert_allclose(mesh.point_data["uv"], UV, atol=1e-6)
    assert mesh.regions["material"].names == {0: "paint"}
    save(mesh, tmp_path / "b.glb")
    read = trimesh.load(tmp_path / "b.glb", process=False, force="mesh")
    np.testing.assert_allclose(read.visual.uv, UV, atol=1e-6)
    assert read.visual.material.name == "paint"
    assert read.visual.material.roughnessFactor == 0.25
    np.testing.assert_array_equal(np.asarray(read.visual.material.baseColorTexture), np.asarray(image))
    assert caplog.text == ""
    again = load_mesh(tmp_path / "b.glb")
    assert again.materials == mesh.materials


def test_materials_and_nodes_of_a_scene(tmp_path, caplog):
    scene = trimesh.Scene()
    for k, name in enumerate(["left", "right"]):
        part = trimesh.creation.box()
        part.visual = trimesh.visual.TextureVisuals(
            uv=np.zeros((8, 2)), material=trimesh.visual.material.PBRMaterial(name=f"paint {k}")
        )
        matrix = trimesh.transformations.translation_matrix([3.0 * k, 0, 0])
        scene.add_geometry(part, node_name=name, transform=matrix)
    scene.export(tmp_path / "a.glb")
    mesh = load_mesh(tmp_path / "a.glb")
    assert sorted(mesh.regions["node"].names.values()) == ["left", "right"]
    save(mesh, tmp_path / "b.glb")
    again = load_mesh(tmp_path / "b.glb")
    read = trimesh.load(tmp_path / "b.glb")
    right = mesh.surface.points[mesh.surface.faces].mean(axis=1)[:, 0] > 1.5
    for found in (mesh, again):
        for division, names in (("node", ["left", "right"]), ("material", ["paint 0", "paint 1"])):
            regions = found.regions[division]
            assert [regions.names[label] for label in regions.labels] == [names[int(k)] for k in right]
    assert {geometry.visual.material.name for geometry in read.geometry.values()} == {"paint 0", "paint 1"}
    assert set(read.graph.nodes_geometry) >= {"left", "right"}
    assert caplog.text == ""


def test_seams_of_texture_coordinates_repeat_points_of_glb(tmp_path):
    corners = np.random.default_rng(3).integers(0, 3, (N_FACES, 3, 2)).astype(float) / 2
    paint = {"material": Regions(np.ones(N_FACES, int), {1: "paint"})}  # without one trimesh reads no coordinates
    save(Mesh(surface=SURFACE, corner_data={"uv": corners}, regions=paint), tmp_path / "a.glb")
    read = trimesh.load(tmp_path / "a.glb", process=False, force="mesh")
    np.testing.assert_allclose(read.vertices[read.faces], SURFACE.points[SURFACE.faces], atol=1e-6)
    np.testing.assert_allclose(read.visual.uv[read.faces], corners, atol=1e-6)
    pairs = {(*SURFACE.points[p], *uv) for p, uv in zip(SURFACE.faces.ravel(), corners.reshape(-1, 2), strict=True)}
    assert len(read.vertices) == len(pairs)


def test_trimesh_reads_solids(tmp_path):
    save(MESH, tmp_path / "a.stl")
    text = (tmp_path / "a.stl").read_text(encoding="utf-8")
    assert [line for line in text.splitlines() if line.startswith("solid")] == [f"solid {n}" for n in NAMES.values()]
    read = trimesh.load(tmp_path / "a.stl")
    counts = sorted(len(geometry.faces) for geometry in read.geometry.values())
    assert counts == sorted(np.bincount(LABELS)[1:].tolist())


def test_3mf_has_objects_and_materials(tmp_path):
    materials = Regions(LABELS % 2, {1: "brass & more"})
    save(Mesh(surface=SURFACE, regions={"object": Regions(LABELS, NAMES), "material": materials}), tmp_path / "a.3mf")
    with zipfile.ZipFile(tmp_path / "a.3mf") as archive:
        root = ElementTree.fromstring(archive.read("3D/3dmodel.model"))
    core = {"c": root.tag[1:].partition("}")[0]}
    objects = root.findall("c:resources/c:object", core)
    assert [part.get("name") for part in objects] == list(NAMES.values())
    triangles = [part.findall("c:mesh/c:triangles/c:triangle", core) for part in objects]
    assert [len(part) for part in triangles] == np.bincount(LABELS)[1:].tolist()
    assert [part[0].get("p1") for part in triangles] == ["0", None, "0"]
    assert [base.get("name") for base in root.iterfind(".//c:base", core)] == ["brass & more"]
    assert len(root.findall("c:build/c:item", core)) == 3


def test_materials_of_obj_pass_through(tmp_path, caplog):
    from PIL import Image

    caplog.set_level(logging.WARNING)
    source, target = tmp_path / "in put", tmp_path / "out"
    source.mkdir()
    target.mkdir()
    Image.fromarray(np.full((2, 2, 3), 200, np.uint8)).save(source / "my wood.png")
    (source / "all.mtl").write_text("newmtl wood\nKd 1 0 0\nmap_Kd -s 1 1 1 my wood.png\nnewmtl stone\nKd 0 1 0\n")
    corners = np.round(np.random.default_rng(5).uniform(size=(N_FACES, 3, 2)), 3)
    regions = Regions(np.sort(LABELS % 2) + 1, {1: "wood", 2: "stone"})
    save(Mesh(surface=SURFACE, corner_data={"uv": corners}, regions={"material": regions}), source / "a.obj")
    text = "mtllib all.mtl\n" + (source / "a.obj").read_text()
    (source / "a.obj").write_text(text)
    mesh = load_mesh(source / "a.obj")
    save(mesh, target / "b.obj")
    again = load_mesh(target / "b.obj")
    np.testing.assert_array_equal(again.corner_data["uv"], corners)
    assert again.regions["material"].names == {1: "wood", 2: "stone"}
    read = trimesh.load(target / "b.obj", process=False)
    materials = {geometry.visual.material.name: geometry.visual.material for geometry in read.geometry.values()}
    assert materials["stone"].diffuse.tolist() == [0, 255, 0, 255]
    assert (target / "b.mtl").read_text().count("map_Kd -s 1 1 1 ../in put/my wood.png\n") == 1
    save(again, target / "b.obj")  # its own file is replaced
    assert sorted(path.name for path in target.iterdir()) == ["b.mtl", "b.obj"]
    save(mesh, source / "c.obj")  # in the same folder the same file is named
    assert "mtllib all.mtl" in (source / "c.obj").read_text()
    (target / "d.mtl").write_text("mine")
    save(mesh, target / "d.obj")
    assert (target / "d.mtl").read_text() == "mine"
    assert "mtllib d_1.mtl" in (target / "d.obj").read_text()
    assert caplog.text == ""
    save(mesh, target / "e.stl")
    assert "materials 'obj'" in caplog.text
