"""Attributes in particular files, valid and broken: the geometry survives what is broken."""

import json
import struct
import time
import zipfile
from urllib.parse import unquote

import numpy as np
import pytest

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.known_formats import MESH_FORMATS
from anisomesh.io.meshes import load, load_mesh, save
from anisomesh.shapes import analytic as shapes

TRIANGLES = "3 0 1 2\n3 1 3 2\n"
POINTS = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n"


def read(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    mesh = load_mesh(path)
    np.testing.assert_array_equal(load(path).faces, mesh.surface.faces)
    return mesh


def rows(array):
    return {tuple(row) for row in np.sort(np.asarray(array), axis=1).tolist()}


def test_obj(tmp_path, caplog):
    text = (
        "mtllib none.mtl\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nv 1 1 0 1 1 1\n"
        "vt 0 0 0\nvt 1 0 0\nvt 0 1 0\nvn 0 0 1\nf 1/1/1 2/2/1 3/3/-1\n"
        "o thing #25\ng left part\nusemtl dark wood\ns 2\nvt .5 .5\nf 2/-3 4/-1 3/-2\ns off\nl 1 2 4\np 3\n"
    )
    mesh = read(tmp_path, "a.obj", text)
    np.testing.assert_array_equal(mesh.point_data["color"], [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])
    uv = [[[0, 0], [1, 0], [0, 1]], [[1, 0], [0.5, 0.5], [0, 1]]]
    np.testing.assert_array_equal(mesh.corner_data["uv"], uv)
    np.testing.assert_array_equal(mesh.corner_data["normal"], [[[0, 0, 1]] * 3, [[np.nan] * 3] * 3])
    for division, name in (("object", "thing #25"), ("group", "left part"), ("material", "dark wood")):
        assert mesh.regions[division].labels.tolist() == [0, 1]
        assert mesh.regions[division].names == {1: name}
    assert mesh.face_data["smoothing_group"].tolist() == [0, 2]
    assert rows(mesh.features) == {(0, 1), (1, 3)}
    assert mesh.fixed_points.tolist() == [2]
    assert mesh.materials == {"obj": {"mtllib": ("none.mtl",)}}
    assert "left out the materials of 'none.mtl': No such file" in caplog.text
    assert "3 corner(s) of faces have no normal and get NaN" in caplog.text


def test_ply(tmp_path, caplog):
    text = (
        "ply\nformat ascii 1.0\ncomment TextureFile my picture.png\ncomment made by hand\nelement vertex 4\n"
        + "".join(f"property float {name}\n" for name in "xyz")
        + "".join(f"property uchar {name}\n" for name in ("red", "green", "blue", "alpha"))
        + "property float velocity_0\nproperty float velocity_1\nproperty list uchar int tags\n"
        + "property list uchar int many\nelement face 2\nproperty list uchar int vertex_indices\n"
        + "property list uchar float texcoord\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
        + "property int material_id\nelement edge 1\nproperty int vertex1\nproperty int vertex2\nproperty uchar red\n"
        + "element camera 1\nproperty float f\nend_header\n"
        + "0 0 0 1 2 3 4 .5 1 2 7 8 1 1\n1 0 0 1 2 3 4 .5 1 2 7 8 1 1\n0 1 0 1 2 3 4 .5 1 2 7 8 0\n"
        + "1 1 0 9 9 9 9 2 3 2 5 6 2 1 1\n4 0 1 3 2 8 0 0 1 0 1 1 0 1 255 0 0 5\n3 0 1 2 6 1 1 0 0 .5 .5 0 255 0 6\n"
        + "1 3 9\n35\n"
    )
    mesh = read(tmp_path, "a.ply", text)
    assert mesh.point_data["color"].dtype == np.uint8
    np.testing.assert_array_equal(mesh.point_data["color"], [[1, 2, 3, 4]] * 3 + [[9] * 4])
    np.testing.assert_array_equal(mesh.point_data["velocity"], [[0.5, 1]] * 3 + [[2, 3]])
    np.testing.assert_array_equal(mesh.point_data["tags"], [[7, 8]] * 3 + [[5, 6]])
    uv = {0: (0, 0), 1: (1, 0), 3: (1, 1), 2: (0, 1)}
    expected = [[uv[point] for point in face] for face in mesh.surface.faces[:2].tolist()]
    np.testing.assert_array_equal(mesh.corner_data["uv"], [*expected, [(1, 1), (0, 0), (0.5, 0.5)]])
    np.testing.assert_array_equal(mesh.face_data["color"], [[255, 0, 0], [255, 0, 0], [0, 255, 0]])
    assert mesh.regions["material_id"].labels.tolist() == [5, 5, 6]
    assert rows(mesh.features) == {(1, 3)}
    assert mesh.materials == {"texture_files": (str(tmp_path / "my picture.png"),)}
    said = [record.getMessage().partition(": ")[2] for record in caplog.records]
    assert said == [
        "left out the lists 'many' of vertex, which differ in length",
        "left out the properties red of edges",
        "left out 1 x camera",
    ]


def test_off(tmp_path, caplog):
    points = "".join(f"{point} 0 0 1 9 8 7 .5 1\n" for point in POINTS.splitlines()[:3])
    text = f"STCNOFF\n3 1 0\n{points}3 0 1 2 .5 .25 1 1\n"
    mesh = read(tmp_path, "a.off", text)
    np.testing.assert_array_equal(mesh.point_data["normal"], [[0, 0, 1]] * 3)
    np.testing.assert_array_equal(mesh.point_data["color"], [[9, 8, 7]] * 3)
    np.testing.assert_array_equal(mesh.point_data["uv"], [[0.5, 1]] * 3)
    np.testing.assert_array_equal(mesh.face_data["color"], [[0.5, 0.25, 1, 1]])
    assert mesh.point_data["color"].dtype == np.uint8
    assert caplog.text == ""


def test_stl(tmp_path):
    facet = "facet normal 0 0 1\nouter loop\nvertex {0} 0 0\nvertex {1} 0 0\nvertex {0} 1 0\nendloop\nendfacet\n"
    others = facet.format(2, 3) + facet.format(4, 5)
    text = f"solid  Left Part\n{facet.format(0, 1)}endsolid Left Part\nSOLID\n{others}ENDSOLID\n"
    mesh = read(tmp_path, "a.stl", text)
    assert mesh.regions["solid"].labels.tolist() == [1, 2, 2]
    assert mesh.regions["solid"].names == {1: "Left Part"}
    triangle = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0x7C1F)
    mesh = read(tmp_path, "b.stl", b"\0" * 80 + struct.pack("<I", 1) + triangle)
    assert mesh.face_data["attribute"].tolist() == [0x7C1F]


MEDIT = (
    "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n0 0 0 4\n1 0 0 0\n0 1 0 0\n1 1 0 0\n"
    "Triangles\n2\n1 2 3 7\n2 4 3 -2\n"
    "Edges\n4\n1 2 0\n2 4 5\n4 3 0\n3 1 0\nRidges\n1\n1\nRequiredEdges\n1\n3\nCorners\n2\n1 2\nRequiredVertices\n1\n3\n"
    "Normals\n1\n0 0 1\nNormalAtVertices\n2\n1 1 2 1\nTangents\n1\n1 0 0\nEnd\n"
)


def test_medit(tmp_path, caplog):
    mesh = read(tmp_path, "a.mesh", MEDIT)
    assert mesh.regions["reference"].labels.tolist() == [7, -2]
    assert mesh.fixed_point_regions["reference"].labels.tolist() == [4, 0, 0]
    assert dict(zip(map(tuple, mesh.features.tolist()), mesh.feature_regions["reference"].labels, strict=True)) == {
        (0, 1): 0,
        (1, 3): 5,
        (3, 2): 0,
    }
    assert list(mesh.point_data) == ["normal"]
    np.testing.assert_array_equal(mesh.point_data["normal"], [[0, 0, 1]] * 2 + [[np.nan] * 3] * 2)
    assert rows(mesh.features) == {(0, 1), (1, 3), (2, 3)}
    assert mesh.fixed_points.tolist() == [0, 1, 2]
    assert "left out its sections Tangents" in caplog.text


def test_an_edge_in_two_regions_keeps_the_first_that_it_has(tmp_path, caplog):
    edges = "Edges\n5\n4 2 0\n2 4 5\n4 2 6\n4 3 0\n3 1 0\nRidges\n1\n1\nRequiredEdges\n1\n4\n"
    mesh = read(tmp_path, "a.mesh", MEDIT[: MEDIT.index("Edges")] + edges + MEDIT[MEDIT.index("Corners") :])
    assert dict(
        zip(map(tuple, np.sort(mesh.features).tolist()), mesh.feature_regions["reference"].labels, strict=True)
    ) == {
        (1, 3): 5,
        (2, 3): 0,
    }
    assert "1 line(s) or point(s) are in several regions 'reference' and kept in one only" in caplog.text


def test_references_of_medit_at_other_vertices_are_point_data(tmp_path):
    mesh = read(tmp_path, "a.mesh", MEDIT.replace("1 1 0 0\n", "1 1 0 3\n"))
    assert mesh.point_data["reference"].tolist() == [4, 0, 0, 3]
    assert not mesh.fixed_point_regions


GMSH_41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
1 3 "rim"
2 8 "left half"
$EndPhysicalNames
$Entities
1 1 2 0
5 0 0 0 1 2
6 0 0 0 1 0 0 1 3 2 5 -5
4 0 0 0 1 1 0 1 8 1 6
9 0 0 0 1 1 0 2 7 8 0
$EndEntities
$Nodes
1 4 1 4
2 4 0 4
1
2
3
4
0 0 0
1 0 0
0 1 0
1 1 0
$EndNodes
$Elements
4 4 1 4
0 5 15 1
1 2
1 6 1 1
2 1 2
2 4 2 1
3 1 2 3
2 9 2 1
4 2 4 3
$EndElements
$NodeData
1
"height"
1
0.5
3
0
1
3
1 10
2 20
4 40
$EndNodeData
$ElementData
1
"flow"
1
0.5
3
0
3
2
3 1 2 3
4 4 5 6
$EndElementData
$ElementData
1
"flow"
1
0.6
3
1
3
1
3 1 2 3
$EndElementData
$Periodic
0
$EndPeriodic
"""


def test_gmsh(tmp_path, caplog):
    mesh = read(tmp_path, "a.msh", GMSH_41)
    assert mesh.regions["physical"].labels.tolist() == [8, 8]
    assert mesh.regions["physical"].names == {8: "left half"}
    assert mesh.regions["physical_2"].labels.tolist() == [0, 7]
    assert mesh.regions["geometrical"].labels.tolist() == [4, 9]
    assert rows(mesh.features) == {(0, 1)}
    assert mesh.fixed_points.tolist() == [1]
    assert mesh.feature_regions["physical"].labels.tolist() == [3]
    assert mesh.feature_regions["physical"].names == {3: "rim"}
    assert mesh.fixed_point_regions["physical"].labels.tolist() == [2]
    np.testing.assert_array_equal(mesh.point_data["height"], [10, 20, np.nan, 40])
    np.testing.assert_array_equal(mesh.face_data["flow"], [[1, 2, 3], [4, 5, 6]])
    said = [record.getMessage().partition(": ")[2] for record in caplog.records]
    assert said == [
        "left out a further time step of the data 'flow'",
    ]


VTU = """<VTKFile type="UnstructuredGrid" byte_order="LittleEndian">
<UnstructuredGrid>{0}{1}</UnstructuredGrid></VTKFile>"""
PIECE = """<Piece NumberOfPoints="3" NumberOfCells="2"><PointData>{0}</PointData>
<CellData><DataArray type="Int32" Name="number" format="ascii">{1} 5</DataArray></CellData>
<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 {1}</DataArray></Points><Cells>
<DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 0 1</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3 5</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">5 3</DataArray></Cells></Piece>"""
ARRAY = '<DataArray type="Float64" Name="{0}" format="ascii">{1}</DataArray>'


def test_pieces_of_vtu(tmp_path, caplog):
    first, second = ARRAY.format("a", "1 2 3"), ARRAY.format("a", "4 5 6") + ARRAY.format("b", "7 8 9")
    mesh = read(tmp_path, "a.vtu", VTU.format(PIECE.format(first, 1), PIECE.format(second, 2)))
    assert mesh.point_data["a"].tolist() == [1, 2, 3, 4, 5, 6]
    assert mesh.face_data["number"].tolist() == [1, 2]
    assert rows(mesh.features) == {(0, 1), (3, 4)}
    assert "left out PointData 'b', which 1 of 2 pieces lack" in caplog.text


def test_numbers_of_faces_are_no_regions(tmp_path):
    """Regression: every edge of a mesh whose faces have numbers was a border between regions."""
    surface = shapes.box(n=3)
    numbers = np.arange(surface.n_faces)
    save(Mesh(surface=surface, face_data={"face_id": numbers, "part_id": numbers % 5}), tmp_path / "a.vtu")
    mesh = load_mesh(tmp_path / "a.vtu")
    assert set(mesh.regions) == {"part_id"}
    np.testing.assert_array_equal(mesh.face_data["face_id"], numbers)


def test_data_of_vtu_that_cannot_be_unpacked(tmp_path, caplog):
    surface = shapes.box(n=3)
    save(Mesh(surface=surface, point_data={"a": surface.points[:, 0], "b": surface.points[:, 1]}), tmp_path / "a.vtu")
    lines = (tmp_path / "a.vtu").read_text().splitlines()
    place = next(k for k, line in enumerate(lines) if 'Name="a"' in line) + 1
    lines[place] = lines[place][:60] + "AAAAAAAA" + lines[place][68:]
    (tmp_path / "a.vtu").write_text("\n".join(lines))
    mesh = load_mesh(tmp_path / "a.vtu")
    assert set(mesh.point_data) == {"b"}
    assert "left out PointData 'a': error: Error -3" in caplog.text


@pytest.mark.parametrize("suffix", [".glb", ".3mf", ".stl", ".obj"])
def test_thousands_of_regions_take_no_time(tmp_path, suffix):
    """Regression: the time was the product of the numbers of regions and faces."""
    surface = shapes.torus(n_major=100, n_minor=50)
    labels = np.arange(surface.n_faces) // 4
    start = time.process_time()
    save(Mesh(surface=surface, regions={"object": Regions(labels)}), tmp_path / f"a{suffix}")
    assert len(np.unique(load_mesh(tmp_path / f"a{suffix}").regions.popitem()[1].labels)) == 2_500
    assert time.process_time() - start < 4.0


def test_materials_of_a_user_that_no_format_knows(tmp_path, caplog):
    materials = {"obj": 3, "gltf": "red", "display_colours": None, "texture_files": 5, "unit": [], "field_data": 1}
    mesh = Mesh(surface=shapes.box(n=1), regions={"material": Regions(np.arange(12) % 2)}, materials=materials)
    for suffix in MESH_FORMATS:
        save(mesh, tmp_path / f"a{suffix}")
        assert load(tmp_path / f"a{suffix}").n_faces == 12
    assert "materials 'obj'" in caplog.text


@pytest.mark.parametrize("suffix", [".ply", ".glb"])
def test_textures_in_other_files_are_named_from_the_output(tmp_path, suffix):
    source, target = tmp_path / "in put", tmp_path / "out" / "deeper"
    source.mkdir()
    target.mkdir(parents=True)
    (source / "my wood.png").write_bytes(b"pixels")
    names = ("my wood.png", "missing.png")
    materials = {"texture_files": names}
    if suffix == ".glb":
        images = [{"uri": "my%20wood.png"}, {"uri": "missing.png"}, {"uri": "data:,x"}]
        materials = {"gltf": {"materials": [{"name": "wood"}], "images": images}}
    regions = {"material": Regions(np.zeros(12, dtype=int))}
    save(Mesh(surface=shapes.box(n=1), regions=regions, materials=materials), source / f"a{suffix}")
    save(load_mesh(source / f"a{suffix}"), target / f"b{suffix}")
    content = (target / f"b{suffix}").read_bytes()
    assert (b"in%20put/my%20wood.png" if suffix == ".glb" else b"TextureFile ../../in put/my wood.png\n") in content
    again = load_mesh(target / f"b{suffix}").materials
    found = again["gltf"]["images"] if suffix == ".glb" else again["texture_files"]
    expected = [str(source / "my wood.png"), str(source / "missing.png")]
    if suffix == ".glb":
        assert [unquote(image["uri"]) for image in found] == [*expected, "data:,x"]
    else:
        assert list(found) == expected


def glb(document, *arrays):
    views, binary = [], b""
    for array in arrays:
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": array.nbytes})
        binary += array.tobytes() + b"\0" * (-array.nbytes % 4)
    document = {"bufferViews": views, "buffers": [{"byteLength": len(binary)}], **document}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I", len(text)) + b"JSON" + text + struct.pack("<I", len(binary)) + b"BIN\0" + binary
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def accessor(view, kind, component, count=3, **more):
    return {"bufferView": view, "type": kind, "componentType": component, "count": count, **more}


def scene(**changes):
    first = {"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2, "NORMAL": 0, "JOINTS_0": 3, "WEIGHTS_0": 4, "_HEAT": 5}
    document = {
        "accessors": [
            accessor(0, "VEC3", 5126),
            accessor(1, "VEC2", 5123, normalized=True),
            accessor(2, "VEC4", 5121, normalized=True),
            accessor(3, "VEC4", 5121),
            accessor(4, "VEC4", 5126),
            accessor(5, "SCALAR", 5126),
        ],
        "meshes": [
            {"name": "a mesh", "primitives": [{"attributes": first, "material": 1}]},
            {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_1": 1}, "targets": [{"POSITION": 0}]}]},
        ],
        "materials": [{"name": "unused"}, {"pbrMetallicRoughness": {"metallicFactor": 0.5}, "extensions": {"X": {}}}],
        "extensionsUsed": ["X", "Y"],
        "nodes": [{"mesh": 0, "scale": [2, 1, 1]}, {"mesh": 1, "name": "second"}],
        "scenes": [{"nodes": [0, 1]}],
        "skins": [{"joints": [0]}],
        **changes,
    }
    weights = np.tile(np.array([0.25, 0.75, 0, 0], "f4"), (3, 1))
    colours = np.arange(12, dtype="u1")
    uv = np.array([0, 65535, 0, 0, 65535, 0], "<u2")
    normals = np.array([[0.6, 0.8, 0], [1, 0, 0], [0, 0, 1]], "f4")
    return glb(document, normals, uv, colours, colours, weights, np.array([1, 2, 3], "f4"))


def test_glb(tmp_path, caplog):
    mesh = read(tmp_path, "a.glb", scene())
    assert mesh.regions["node"].names == {0: "a mesh", 1: "second"}
    assert mesh.regions["material"].labels.tolist() == [1, -1]
    assert mesh.regions["material"].names == {0: "unused"} or mesh.regions["material"].names == {}
    np.testing.assert_array_equal(mesh.point_data["uv"], [[0, 0], [0, 1], [1, 1], *[[np.nan] * 2] * 3])
    np.testing.assert_array_equal(mesh.point_data["uv1"], [*[[np.nan] * 2] * 3, [0, 0], [0, 1], [1, 1]])
    assert mesh.point_data["color"].dtype == np.uint8
    np.testing.assert_array_equal(mesh.point_data["color"].ravel(), [*range(12), *[255] * 12])
    np.testing.assert_array_equal(mesh.point_data["HEAT"], [1, 2, 3, *[np.nan] * 3])
    np.testing.assert_array_equal(mesh.point_data["JOINTS_0"][:3].ravel(), range(12))
    assert mesh.materials["gltf"]["materials"][1]["pbrMetallicRoughness"] == {"metallicFactor": 0.5}
    assert mesh.materials["gltf"]["extensionsUsed"] == ["X"]
    assert "normal" not in mesh.point_data
    assert "left out 'normal', which some of its meshes lack" in caplog.text
    assert "left out its skins, morph targets" in caplog.text


def test_normals_of_glb_move_with_their_node(tmp_path):
    mesh = read(tmp_path, "a.glb", scene(scenes=[{"nodes": [0]}]))
    expected = np.array([0.3, 0.8, 0]) / np.linalg.norm([0.3, 0.8])
    np.testing.assert_allclose(mesh.point_data["normal"], [expected, [1, 0, 0], [0, 0, 1]], atol=1e-7)


def archive(path, body, unit="inch"):
    core, more = (f"http://schemas.microsoft.com/3dmanufacturing/{name}/2015/02" for name in ("core", "material"))
    with zipfile.ZipFile(path, "w") as file:
        text = f'<model unit="{unit}" xmlns="{core}" xmlns:m="{more}"><resources>{body}</resources><build>'
        file.writestr(
            "3D/3dmodel.model", text + '<item objectid="3" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/></build></model>'
        )


VERTICES = (
    "<vertices>" + "".join(f'<vertex x="{x}" y="{y}" z="0"/>' for x, y in ((0, 0), (1, 0), (0, 1))) + "</vertices>"
)
PROPERTIES_3MF = (
    '<basematerials id="1"><base name="oak" displaycolor="#AA5500"/></basematerials>'
    '<m:colorgroup id="2"><m:color color="#FF0000"/><m:color color="#00FF0080"/></m:colorgroup>'
    '<object id="3" name="lid &amp; box" pid="1" pindex="0"><mesh>' + VERTICES + "<triangles>"
    '<triangle v1="0" v2="1" v3="2"/><triangle v1="0" v2="1" v3="2" pid="2" p1="0" p2="1" p3="0"/>'
    '<triangle v1="0" v2="1" v3="2" pid="2" p1="1"/></triangles></mesh></object>'
)


def test_3mf(tmp_path):
    archive(tmp_path / "a.3mf", PROPERTIES_3MF)
    mesh = load_mesh(tmp_path / "a.3mf")
    assert mesh.regions["object"].names == {1: "lid & box"}
    assert mesh.regions["material"].labels.tolist() == [1, 0, 0]
    assert mesh.regions["material"].names == {1: "oak"}
    assert mesh.materials == {"display_colours": {1: "#AA5500"}, "unit": "inch"}
    red, green, white = [255, 0, 0, 255], [0, 255, 0, 128], [255] * 4
    at_points = [dict.fromkeys(range(3), white), {0: red, 1: green, 2: red}, dict.fromkeys(range(3), green)]
    expected = [[at[p] for p in face] for at, face in zip(at_points, mesh.surface.faces.tolist(), strict=True)]
    np.testing.assert_array_equal(mesh.corner_data["color"], expected)  # the reflection turns the corners


BROKEN = {
    "uv of a line.obj": ("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 x\nf 1/1 2/1 3/1\n", "left out texture coordinates"),
    "slashes.obj": ("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/x 2/1 3/1\n", "left out texture coordinates and normals"),
    "few colours.obj": ("v 0 0 0 1 1 1\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "left out the colours of points: not every"),
    "line.obj": ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nl 1 9\n", "left out line 5: it reads"),
    "smoothing.obj": ("v 0 0 0\nv 1 0 0\nv 0 1 0\ns many\nf 1 2 3\n", "left out its smoothing groups"),
    "colour map.off": (f"OFF\n4 2 0\n{POINTS}3 0 1 2 7\n3 1 3 2\n", "left out the colours of faces"),
    "columns.off": (f"COFF\n4 2 0\n{POINTS}{TRIANGLES}", "left out the columns behind"),
    "edges.mesh": (MEDIT.replace("Edges\n4\n1 2", "Edges\n4\n1 x"), "left out the edges"),
    "required.mesh": (MEDIT.replace("RequiredEdges\n1\n3", "RequiredEdges\n1\n33"), "refers to number 33 of 4"),
    "short.mesh": (MEDIT.replace("Corners\n2", "Corners\n20"), "left out the section Corners: truncated"),
    "reference.mesh": (MEDIT.replace("1 2 3 7", "1 2 3 7.5"), "left out the references of faces"),
    "entities.msh": (GMSH_41.replace("$Entities\n1 1", "$Entities\n9999 1"), "left out the physical groups"),
    "data.msh": (GMSH_41.replace("1 10\n", "1 ten\n"), "left out $NodeData: 'ten' is not a number"),
    "nobody.msh": (GMSH_41.replace("1 10\n2 20\n4 40", "6 1\n7 2\n8 3"), "'height' has no row for what is in the file"),
    "few.vtu": (VTU.format(PIECE.format(ARRAY.format("a", "1 2"), 1), ""), "left out PointData 'a': it has 2 values"),
    "word.vtu": (VTU.format(PIECE.format(ARRAY.format("a", "1 2 x"), 1), ""), "left out PointData 'a': could not"),
    "view.glb": (scene(accessors=[accessor(0, "VEC3", 5126), *[accessor(9, "VEC2", 5126)] * 5]), "_0: malformed"),
    "materials.glb": (scene(materials=[]), None),
    "images.glb": (scene(images=[{"bufferView": 77}]), "left out its materials"),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_the_geometry_survives_broken_attributes(tmp_path, caplog, name):
    content, message = BROKEN[name]
    mesh = read(tmp_path, name, content)
    assert mesh.surface.n_faces > 0
    assert message is None or message in caplog.text


@pytest.mark.parametrize("spelling", ["my textures/red wall.png", "my textures\\red wall.png"])
def test_textures_are_found_from_the_folder_of_the_materials(tmp_path, spelling):
    (tmp_path / "mats" / "my textures").mkdir(parents=True)
    (tmp_path / "mats" / "my textures" / "red wall.png").write_bytes(b"png")
    (tmp_path / "mats" / "box.mtl").write_text(f"newmtl red\nmap_Kd {spelling}\n")
    (tmp_path / "a.obj").write_text("mtllib mats/box.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n")
    (tmp_path / "out").mkdir()
    save(load_mesh(tmp_path / "a.obj"), tmp_path / "out" / "b.obj")
    (line,) = [row for row in (tmp_path / "out" / "b.mtl").read_text().splitlines() if row.startswith("map_Kd ")]
    assert (tmp_path / "out" / line.removeprefix("map_Kd ")).is_file()
