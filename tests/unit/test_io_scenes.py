"""GLB and 3MF: meshes in their places, strips and fans, data laid out in every way, other parts of an archive."""

import io
import json
import struct
import zipfile

import numpy as np
import pytest
import trimesh

from anisomesh.errors import MeshFileError
from anisomesh.io.meshes import load, load_mesh, save
from anisomesh.shapes import analytic as shapes

SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype="<f4")


def volume(surface):
    a, b, c = (surface.points[surface.faces[:, k]] for k in range(3))
    return np.einsum("ij,ij->", np.cross(a, b), c) / 6


def glb(document, binary):
    text = json.dumps({"asset": {"version": "2.0"}, **document}).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def one_primitive(primitive, accessors, views, binary, **more):
    document = {"meshes": [{"primitives": [primitive]}], "accessors": accessors, "bufferViews": views}
    return glb({**document, "buffers": [{"byteLength": len(binary)}], **more}, binary)


def square_of(mode, indices):
    data = np.array(indices, dtype="<u2").tobytes()
    data += b"\0" * (-len(data) % 4)
    views = [{"buffer": 0, "byteLength": len(data)}]
    views.append({"buffer": 0, "byteOffset": len(data), "byteLength": SQUARE.nbytes})
    accessors = [
        {"bufferView": 0, "componentType": 5123, "count": len(indices), "type": "SCALAR"},
        {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3"},
    ]
    primitive = {"attributes": {"POSITION": 1}, "indices": 0, "mode": mode}
    return one_primitive(primitive, accessors, views, data + SQUARE.tobytes())


@pytest.mark.parametrize(("mode", "indices"), [(4, [0, 1, 2, 0, 2, 3]), (5, [0, 1, 3, 2]), (6, [0, 1, 2, 3])])
def test_lists_strips_and_fans_of_glb(tmp_path, mode, indices):
    """Regression: strips and fans vanished."""
    (tmp_path / "a.glb").write_bytes(square_of(mode, indices))
    surface = load(tmp_path / "a.glb")
    assert surface.n_faces == 2
    np.testing.assert_allclose(surface.face_normals, [(0, 0, 1)] * 2)
    assert surface.area == pytest.approx(1)


@pytest.mark.parametrize("mode", [0, 1, 3])
def test_points_and_lines_of_glb_are_no_surface(tmp_path, mode):
    (tmp_path / "a.glb").write_bytes(square_of(mode, [0, 1, 2]))
    with pytest.raises(MeshFileError, match="only cells of type line or point"):
        load(tmp_path / "a.glb")


def test_glb_without_indices_interleaved_and_sparse(tmp_path):
    rows = np.zeros(6, dtype=[("normal", "<f4", 3), ("xyz", "<f4", 3)])
    rows["xyz"] = SQUARE[[0, 1, 2, 0, 2, 3]]
    rows["xyz"][5] = 0  # put right by the sparse values
    patch = struct.pack("<H2x3f", 5, 0, 1, 0)
    views = [
        {"buffer": 0, "byteLength": rows.nbytes, "byteStride": 24},
        {"buffer": 0, "byteOffset": rows.nbytes, "byteLength": 2},
        {"buffer": 0, "byteOffset": rows.nbytes + 4, "byteLength": 12},
    ]
    sparse = {"count": 1, "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 2}}
    accessor = {"bufferView": 0, "byteOffset": 12, "componentType": 5126, "count": 6, "type": "VEC3", "sparse": sparse}
    data = one_primitive({"attributes": {"POSITION": 0}}, [accessor], views, rows.tobytes() + patch)
    (tmp_path / "a.glb").write_bytes(data)
    assert load(tmp_path / "a.glb").area == pytest.approx(1)


def test_glb_of_normalised_integers(tmp_path):
    data = (SQUARE * 32767).astype("<i2")
    accessor = {"bufferView": 0, "componentType": 5122, "count": 4, "type": "VEC3", "normalized": True}
    views = [{"buffer": 0, "byteLength": data.nbytes}]
    content = one_primitive({"attributes": {"POSITION": 0}, "mode": 6}, [accessor], views, data.tobytes())
    (tmp_path / "a.glb").write_bytes(content)
    assert load(tmp_path / "a.glb").area == pytest.approx(1)


def test_nodes_of_glb_move_their_meshes(tmp_path):
    """A scene as another library writes it: copies moved, turned, scaled and reflected, nodes in nodes."""
    scene = trimesh.Scene()
    box = trimesh.creation.box((1, 2, 3))
    turn = trimesh.transformations.rotation_matrix(0.7, (1, 2, 3), (4, 5, 6))
    reflection = np.diag([-2.0, 1.0, 1.0, 1.0])
    scene.add_geometry(box, node_name="a", transform=turn)
    scene.add_geometry(box, node_name="b", parent_node_name="a", transform=reflection)
    scene.export(tmp_path / "a.glb")
    surface = load(tmp_path / "a.glb")
    assert volume(surface) == pytest.approx(6 + 12, rel=1e-5)
    expected = np.concatenate([trimesh.transform_points(box.vertices, m) for m in (turn, turn @ reflection)])
    np.testing.assert_allclose(np.sort(surface.points, axis=0), np.sort(expected, axis=0), atol=1e-5)
    matrix = [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1]  # by columns
    rotation = {"rotation": [0, 0, 0.5**0.5, 0.5**0.5], "translation": [5, 0, 0]}
    places = []
    for node in ({"matrix": matrix}, rotation):
        data = square_of(6, [0, 1, 2, 3])
        size = struct.unpack("<I", data[12:16])[0]
        document = json.loads(data[20 : 20 + size]) | {"scenes": [{"nodes": [0]}], "nodes": [{**node, "mesh": 0}]}
        (tmp_path / "b.glb").write_bytes(glb(document, data[28 + size :]))
        places.append(load(tmp_path / "b.glb").points)
    np.testing.assert_allclose(places[0], [(5, 0, 0), (5, 1, 0), (4, 1, 0), (4, 0, 0)], atol=1e-6)
    np.testing.assert_allclose(places[1], places[0], atol=1e-6)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "compressed with KHR_draco_mesh_compression"),
        ({"buffers": [{"byteLength": 48, "uri": "a.bin"}]}, "in another file, 'a.bin'"),
        ({"scenes": [{"nodes": [0]}], "nodes": [{"children": [0]}]}, "contain each other"),
        ({"bufferViews": [{"buffer": 0, "byteLength": 47}]}, "truncated: an accessor needs 48 bytes"),
        ({"accessors": [{"bufferView": 0, "componentType": 5126, "count": 9**20, "type": "VEC3"}]}, "truncated"),
        ({"accessors": [{"bufferView": 0, "componentType": 5126, "count": -1, "type": "VEC3"}]}, "natural number"),
    ],
)
def test_bad_glb(tmp_path, more, message):
    accessor = {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}
    views = [{"buffer": 0, "byteLength": 48}]
    document = {"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 6}]}], "accessors": [accessor]}
    document |= {"bufferViews": views, "buffers": [{"byteLength": 48}], **more}
    (tmp_path / "a.glb").write_bytes(glb(document, SQUARE.tobytes()))
    with pytest.raises(MeshFileError, match=message):
        load(tmp_path / "a.glb")


def test_glb_is_read_by_another_library(tmp_path):
    torus = shapes.torus(n_major=12, n_minor=8)
    save(torus, tmp_path / "a.glb")
    read = trimesh.load_mesh(tmp_path / "a.glb", process=False)
    np.testing.assert_array_equal(read.vertices, torus.points.astype(np.float32))
    np.testing.assert_array_equal(read.faces, torus.faces)


def lines_of(caplog):
    return [record.getMessage().partition(": ")[2] for record in caplog.records]


def fan(*primitives, attributes=None, **more):
    """Return a GLB file with the square as a fan, and other primitives."""
    accessors = [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}, *more.pop("accessors", [])]
    first = {"attributes": {"POSITION": 0, **(attributes or {})}, "mode": 6}
    document = {"meshes": [{"name": "m", "primitives": [first, *primitives]}], "accessors": accessors}
    document |= {"bufferViews": [{"buffer": 0, "byteLength": 48}], "buffers": [{"byteLength": 48}], **more}
    return glb(document, SQUARE.tobytes())


def test_a_line_says_how_many_lines_and_points_a_glb_file_has(tmp_path, caplog):
    """Regression: primitives of lines and points beside triangles vanished."""
    others = [{"attributes": {"POSITION": 0}, "mode": mode} for mode in (0, 1, 2, 3)]
    (tmp_path / "a.glb").write_bytes(fan(*others))
    assert load(tmp_path / "a.glb").n_faces == 2
    assert lines_of(caplog) == ["left out 9 line(s) and 4 point(s) that its meshes have besides triangles"]


def test_lines_without_positions_do_not_hinder(tmp_path, caplog):
    """Regression: the count of the lines refused the file, though nothing is drawn of them."""
    (tmp_path / "a.glb").write_bytes(fan({"attributes": {}, "mode": 1}, {"mode": 0}))
    assert load(tmp_path / "a.glb").n_faces == 2
    assert lines_of(caplog) == []


def test_an_accessor_without_data_is_zeros(tmp_path, caplog):
    """Regression: the attribute was left out as malformed."""
    zeros = {"componentType": 5126, "count": 4, "type": "VEC2"}
    (tmp_path / "a.glb").write_bytes(fan(attributes={"_A": 1}, accessors=[zeros]))
    np.testing.assert_array_equal(load_mesh(tmp_path / "a.glb").point_data["A"], np.zeros((4, 2)))
    assert caplog.text == ""
    (tmp_path / "b.glb").write_bytes(fan(attributes={"_A": 1}, accessors=[{**zeros, "count": 10**9}]))
    assert "A" not in load_mesh(tmp_path / "b.glb").point_data
    assert "declares 1000000000 rows without data" in caplog.text
    compressed = {"extensionsUsed": ["KHR_draco_mesh_compression"], "accessors": [zeros]}
    (tmp_path / "c.glb").write_bytes(fan(attributes={"_A": 1}, **compressed))
    assert "A" not in load_mesh(tmp_path / "c.glb").point_data
    assert "compressed with KHR_draco_mesh_compression" in caplog.text


def test_a_glb_file_without_scenes_is_read_with_a_line(tmp_path, caplog):
    """Regression: nodes and their places were passed over."""
    nodes = [{"mesh": 0}, {"mesh": 0, "translation": [3, 0, 0]}]
    (tmp_path / "a.glb").write_bytes(fan(nodes=nodes))
    assert load(tmp_path / "a.glb").n_faces == 2
    assert lines_of(caplog) == ["it has no scene: read each of its meshes once, not moved by its nodes"]


def test_instances_of_a_mesh_of_glb(tmp_path, caplog):
    """Regression: a line said that they are left out, also where a file requires them."""
    name = "EXT_mesh_gpu_instancing"
    half = np.sqrt(0.5)
    offsets = np.array([(0, 0, 5), (3, 0, 0), (0, 0, 0)], dtype="<f4")
    rotations = np.array([(0, 0, 0, 1), (0, 0, half, half), (0, 0, 0, 1)], dtype="<f4")
    scales = np.array([(1, 1, 1), (1, 1, 1), (-2, 1, 1)], dtype="<f4")
    blobs = [SQUARE.tobytes(), offsets.tobytes(), rotations.tobytes(), scales.tobytes()]
    starts = np.cumsum([0, *map(len, blobs)]).tolist()
    views = [{"buffer": 0, "byteOffset": at, "byteLength": len(b)} for at, b in zip(starts, blobs, strict=False)]
    accessors = [
        {"bufferView": k, "componentType": 5126, "count": len(b) // 4 // width, "type": f"VEC{width}"}
        for k, (b, width) in enumerate(zip(blobs, (3, 3, 4, 3), strict=True))
    ]
    given = {"TRANSLATION": 1, "ROTATION": 2, "SCALE": 3}
    document = {
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 6}]}],
        "nodes": [{"mesh": 0, "translation": [0, 10, 0], "extensions": {name: {"attributes": given}}}],
        "scenes": [{"nodes": [0]}],
        "extensionsUsed": [name],
        "extensionsRequired": [name],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": starts[-1]}],
    }
    (tmp_path / "a.glb").write_bytes(glb(document, b"".join(blobs)))
    surface = load(tmp_path / "a.glb")
    turned = SQUARE[:, [1, 0, 2]] * (-1, 1, 1)
    expected = [np.add(SQUARE, (0, 10, 5)), np.add(turned, (3, 10, 0)), np.add(SQUARE * (-2, 1, 1), (0, 10, 0))]
    np.testing.assert_allclose(surface.points, np.concatenate(expected), atol=1e-6)
    np.testing.assert_allclose(surface.face_normals, [(0, 0, 1)] * 6, atol=1e-6)
    assert caplog.text == ""
    accessors[1]["count"] = 2
    (tmp_path / "a.glb").write_bytes(glb(document, b"".join(blobs)))
    with pytest.raises(MeshFileError, match="a node has 2 or 3 copies of its mesh"):
        load(tmp_path / "a.glb")


@pytest.mark.parametrize(
    "name", ["KHR_mesh_quantization", "KHR_texture_transform", "KHR_materials_unlit", "KHR_lights_punctual", "MSFT_lod"]
)
def test_extensions_that_do_not_change_the_surface(tmp_path, caplog, name):
    (tmp_path / "a.glb").write_bytes(fan(extensionsRequired=[name], extensionsUsed=[name]))
    assert load(tmp_path / "a.glb").n_faces == 2
    assert caplog.text == ""


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"extensionsRequired": ["FOO_bar"]}, "it requires the extension 'FOO_bar', which is not supported"),
        ({"extensionsRequired": ["KHR_meshopt_compression"]}, "compressed with KHR_meshopt_compression"),
        ({"scenes": [{"nodes": [0]}], "nodes": [{"mesh": 5}]}, "refers to number 5 .counted from 0. of its 1 meshes"),
        ({"scenes": [{"nodes": [3]}]}, "refers to number 3 .counted from 0. of its 0 nodes"),
        ({"scenes": [{}], "scene": 2}, "refers to number 2 .counted from 0. of its 1 scenes"),
        ({"bufferViews": []}, "refers to number 0 .counted from 0. of its 0 bufferViews"),
        ({"buffers": []}, "of its 0 buffers"),
        ({"meshes": [{"name": "m"}]}, "a part of its JSON lacks 'primitives'"),
    ],
)
def test_glb_files_that_refer_to_what_there_is_not(tmp_path, more, message):
    """Regression: they were read on, or the message was one of Python."""
    (tmp_path / "a.glb").write_bytes(fan(**more))
    with pytest.raises(MeshFileError, match=message):
        load(tmp_path / "a.glb")


CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
BOX = shapes.box((1.0, 1.0, 1.0), n=1)


def mesh_xml():
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="{z}" />' for x, y, z in BOX.points)
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}" pid="1"/>' for a, b, c in BOX.faces)
    return f"<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>"


OBJECT = f'<object id="1">{mesh_xml()}</object>'


def model(resources, build=""):
    names = f'xmlns="{CORE}" xmlns:p="{PRODUCTION}" xmlns:b="http://schemas.microsoft.com/3dmanufacturing/beamlattice"'
    return f"<model unit='inch' {names}><resources>{resources}</resources><build>{build}</build></model>"


def archive(path, **entries):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as out:
        for name, text in entries.items():
            out.writestr(name, text)


def test_objects_of_3mf_are_put_in_their_places(tmp_path):
    """Components of components in another part, scaled and reflected; what is not built is left out."""
    inner = f'<object id="7">{mesh_xml()}</object>'
    twice = "<component objectid='7'/><component objectid='7' transform='2 0 0 0 1 0 0 0 1 5 0 0'/>"
    inner += f'<object id="8"><components>{twice}</components></object>'
    outer = '<object id="1"><components><component p:path="/3D/inner.model" objectid="8"/></components></object>'
    outer += f'<object id="2">{mesh_xml()}</object>'
    items = '<item objectid="1" transform="-1 0 0 0 3 0 0 0 1 0 0 9"/>'
    kind = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
    rels = f'<Relationships><Relationship Type="{kind}" Target="/m.model"/></Relationships>'
    path = tmp_path / "a.3mf"
    archive(path, **{"_rels/.rels": rels, "m.model": model(outer, items), "3D/inner.model": model(inner)})
    surface = load(path)
    assert volume(surface) == pytest.approx(3 + 6)
    a, b = BOX.points * (-1, 3, 1) + (0, 0, 9), BOX.points * (-2, 3, 1) + (-5, 0, 9)
    np.testing.assert_allclose(surface.points, np.concatenate([a, b]))


def test_all_objects_of_3mf_if_none_is_built(tmp_path, caplog):
    path = tmp_path / "a.3mf"
    lattice = "<b:beamlattice/>"
    archive(path, **{"3D/3dmodel.model": model(f'<object id="2">{mesh_xml()}{lattice}</object>')})
    assert volume(load(path)) == pytest.approx(1)
    assert "left out its beamlattice" in caplog.text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (model("", '<item objectid="5"/>'), "no object '5'"),
        (model('<object id="1"><components><component objectid="1"/></components></object>'), "contain each other"),
        (model('<object id="1"><mesh><vertices><vertex x="1" y="2"/></vertices></mesh></object>'), "attribute 'z'"),
        (model(OBJECT.replace('v1="1"', 'v1="99"')), "beyond its 8 points"),
        (model(OBJECT, '<item objectid="1" transform="1 2"/>'), "has 2 numbers"),
        (model("")[:-5], "malformed: 3D/3dmodel.model"),
    ],
)
def test_bad_3mf(tmp_path, text, message):
    archive(tmp_path / "a.3mf", **{"3D/3dmodel.model": text})
    with pytest.raises(MeshFileError, match=message):
        load(tmp_path / "a.3mf")
    (tmp_path / "a.3mf").write_bytes(b"no archive")
    with pytest.raises(MeshFileError, match="not a zip archive"):
        load(tmp_path / "a.3mf")
    archive(tmp_path / "a.3mf", other="")
    with pytest.raises(MeshFileError, match=r"has no 3D/3dmodel\.model"):
        load(tmp_path / "a.3mf")


def test_3mf_is_the_same_for_the_same_mesh(tmp_path):
    for name in "ab":
        save(BOX, tmp_path / f"{name}.3mf")
    content = (tmp_path / "a.3mf").read_bytes()
    assert content == (tmp_path / "b.3mf").read_bytes()
    with zipfile.ZipFile(io.BytesIO(content)) as opened:
        assert set(opened.namelist()) == {"[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model"}


SETS = "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07"
MATERIALS = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"


def box_of(path, *, more="", build="", resources="", attributes=""):
    """Write the box as an object of a 3MF file, with more of the mesh, other resources, and attributes of the model."""
    mesh = mesh_xml().replace(' pid="1"', "").replace("</mesh>", f"{more}</mesh>")
    names = f'xmlns="{CORE}" xmlns:t="{SETS}" xmlns:m="{MATERIALS}" xmlns:b="http://b" {attributes}'
    objects = f'{resources}<object id="9">{mesh}</object>'
    text = f"<model {names}><resources>{objects}</resources><build>{build}</build></model>"
    archive(path, **{"3D/3dmodel.model": text})


def test_triangle_sets_of_3mf_are_divisions(tmp_path, caplog):
    """Regression: they vanished. Copies of an object are in the same sets; sets that overlap are in two divisions."""
    sets = (
        '<t:triangleset name="top" identifier="1"><t:ref index="4"/><t:refrange startindex="0" endindex="1"/>'
        '</t:triangleset><t:triangleset name="" identifier="id"><t:ref index="2"/></t:triangleset>'
        '<t:triangleset name="over" identifier="3"><t:ref index="1"/><t:ref index="1"/></t:triangleset>'
        '<t:triangleset name="none" identifier="4"/>'
        '<t:triangleset name="beyond" identifier="5"><t:refrange startindex="3" endindex="12"/></t:triangleset>'
    )
    twice = '<item objectid="9"/><item objectid="9" transform="-1 0 0 0 1 0 0 0 1 5 0 0"/>'
    box_of(tmp_path / "a.3mf", more=f"<t:trianglesets>{sets}</t:trianglesets>", build=twice)
    regions = load_mesh(tmp_path / "a.3mf").regions
    labels = np.zeros(12, dtype=int)
    labels[[0, 1, 4]], labels[2] = 1, 2
    np.testing.assert_array_equal(regions["triangle_set"].labels, np.tile(labels, 2))
    assert regions["triangle_set"].names == {1: "top", 2: "id"}
    assert np.flatnonzero(regions["triangle_set 2"].labels).tolist() == [1, 13]
    assert regions["triangle_set 2"].names == {1: "over"}
    assert lines_of(caplog) == [
        "left out the triangle set 'beyond': it refers to a triangle beyond the 12 triangles of its object",
        "left out the names of regions with nothing in them: triangle_set 'none'",
    ]


@pytest.mark.parametrize(("prefixes", "name"), [("b", "http://b"), ("t m other", "other")])
def test_3mf_files_that_require_an_unknown_extension_are_refused(tmp_path, prefixes, name):
    """Regression: they were read without a line."""
    box_of(tmp_path / "a.3mf", attributes=f'requiredextensions="{prefixes}"')
    with pytest.raises(MeshFileError, match=f"it requires the extension '{name}', which is not supported"):
        load(tmp_path / "a.3mf")
    box_of(tmp_path / "a.3mf", attributes='requiredextensions="t  m" recommendedextensions="b"')
    assert load(tmp_path / "a.3mf").n_faces == 12


def test_several_materials_of_a_face_of_3mf_and_ones_that_there_are_not(tmp_path, caplog):
    """Regression: no line said so, and reflected objects had the last material in place of the first."""
    given = ['pid="5" p1="1"', 'pid="5" p1="0" p2="1" p3="1"', 'pid="5" p1="7"', 'pid="5" p1="1" p2="1" p3="1"']
    materials = '<basematerials id="5"><base name="red"/><base name="blue"/></basematerials>'
    triangles = "".join(f'<triangle v1="0" v2="1" v3="2" {attributes}/>' for attributes in given)
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="0"/>' for x, y in ((0, 0), (1, 0), (0, 1)))
    mesh = f"<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>"
    build = '<item objectid="2"/><item objectid="2" transform="-1 0 0 0 1 0 0 0 1 5 0 0"/>'
    archive(tmp_path / "a.3mf", **{"3D/3dmodel.model": model(f'{materials}<object id="2">{mesh}</object>', build)})
    regions = load_mesh(tmp_path / "a.3mf").regions["material"]
    assert regions.labels.tolist() == [2, 1, 0, 2] * 2
    assert regions.names == {1: "red", 2: "blue"}
    assert lines_of(caplog) == [
        "2 face(s) refer to missing materials, colours or texture coordinates",
        "2 face(s) have several materials and keep the first only",
    ]


@pytest.mark.parametrize(
    ("was", "now", "message"),
    [
        ('x="0.0"', 'x="1,5"', "line 1: it reads x='1,5' y='.*' z='.*'; expected numbers"),
        ('v1="1"', 'v1="a"', "line 1: it reads v1='a' v2='.*' v3='.*'; expected integers"),
        ('v1="1"', f'v1="{10**30}"', "expected smaller integers"),
        ("<build>", '<build><item objectid="9" transform="1 0 0 0 x 0 0 0 1 0 0 0"/>', "m11='x'.*expected numbers"),
    ],
)
def test_numbers_of_3mf_that_are_none(tmp_path, was, now, message):
    """Regression: the message was one of Python."""
    path = tmp_path / "a.3mf"
    box_of(path)
    with zipfile.ZipFile(path) as opened:
        text = opened.read("3D/3dmodel.model").decode()
    assert was in text
    archive(path, **{"3D/3dmodel.model": text.replace(was, now, 1)})
    with pytest.raises(MeshFileError, match=message):
        load(path)
