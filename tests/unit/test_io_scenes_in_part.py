"""What of a GLB or 3MF file, or of cell sets of meshio, cannot be kept is named once, and the rest is read."""

import json
import struct
import zipfile

import numpy as np
import pytest

from anisomesh.errors import MeshFileError
from anisomesh.io.assemble import as_mesh
from anisomesh.io.meshes import load_mesh
from anisomesh.io.objects.read import polygon_soup
from anisomesh.io.objects.write import to_meshio

POINTS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 1)])
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
SETS = "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07"
SLICES = "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07"


def read_glb(folder, **document):
    """Read a GLB file with two triangles as mesh 0, and two lines as mesh 1."""
    binary = POINTS.astype("<f4").tobytes()
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(binary)}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": mode}]} for mode in (6, 1)],
        **document,
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    (folder / "a.glb").write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)
    return load_mesh(folder / "a.glb")


def read_3mf(folder, *, sets="", attributes="", of_object="", more=""):
    """Read a 3MF file with a tetrahedron that has triangle sets."""
    vertices = "".join('<vertex x="{}" y="{}" z="{}"/>'.format(*row) for row in POINTS.tolist())
    triangles = "".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*row) for row in FACES)
    with zipfile.ZipFile(folder / "a.3mf", "w") as file:
        file.writestr(
            "3D/3dmodel.model",
            f'<model xmlns="{CORE}" xmlns:t="{SETS}" xmlns:s="{SLICES}" {attributes}><resources>{more}'
            f'<object id="1" {of_object}><mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles>'
            f"<t:trianglesets>{sets}</t:trianglesets></mesh></object></resources>"
            '<build><item objectid="1"/></build></model>',
        )
    return load_mesh(folder / "a.3mf")


def lines_of(caplog):
    return [record.getMessage().partition(": ")[2] for record in caplog.records]


@pytest.mark.parametrize(
    ("nodes", "is_said"),
    [
        ([{"mesh": 0}], False),
        ([{"children": [1]}, {"mesh": 0}, {"translation": [1, 0, 0], "camera": 0}], False),
        ([{"mesh": 0, "translation": [1, 0, 0]}], True),
        ([{"scale": [2, 2, 2], "children": [1]}, {"children": [2]}, {"mesh": 0}], True),
        ([{"mesh": 0}, {"mesh": 0}], True),
        ([{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {}}}], True),
        ([{"children": [1], "scale": [2, 2, 2]}, {"children": [0]}], False),
    ],
)
def test_a_glb_file_without_scenes_loses_places_only_where_nodes_move_or_repeat_a_mesh(
    tmp_path, caplog, nodes, is_said
):
    """Regression: the line came wherever a node has a mesh."""
    assert read_glb(tmp_path, nodes=nodes).surface.n_faces == 2
    assert any("it has no scene" in line for line in lines_of(caplog)) == is_said


def test_a_node_of_lines_only_is_one_loss(tmp_path, caplog):
    """Regression: a second line called it a region with nothing in it."""
    nodes = [{"mesh": 0, "name": "a"}, {"mesh": 1, "name": "l"}]
    assert read_glb(tmp_path, scenes=[{"nodes": [0, 1]}], nodes=nodes).regions["node"].names == {0: "a"}
    assert lines_of(caplog) == ["left out 2 line(s) that its meshes have besides triangles, everything in 'l'"]


@pytest.mark.parametrize(
    "name", ["EXT_structural_metadata", "EXT_mesh_features", "VRM", "VRMC_vrm", "AGI_articulations"]
)
def test_required_extensions_that_describe_a_surface_are_left_out(tmp_path, caplog, name):
    """Regression: the file was refused."""
    scene = {
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 6}]}],
    }
    assert read_glb(tmp_path, **scene, extensionsRequired=[name]).surface.n_faces == 2
    assert lines_of(caplog) == [f"left out its {name}"]


@pytest.mark.parametrize("given", ["KHR_x", [["KHR_x"]], {"KHR_x": 1}, 5])
def test_required_extensions_that_are_not_a_list_of_names(tmp_path, given):
    """Regression: the message said that a text requires its first letter."""
    with pytest.raises(MeshFileError, match=r"malformed: its extensionsRequired is .*; expected a list of names"):
        read_glb(tmp_path, extensionsRequired=given)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ('<t:ref index="x"/>', "it reads index='x'; expected integers"),
        ("<t:ref/>", "a part of it lacks the attribute 'index'"),
        ('<t:refrange startindex="3" endindex="1"/>', "it has a range that begins with 3 and ends with 1"),
        ('<t:ref index="4"/>', "it refers to a triangle beyond the 4 triangles of its object"),
    ],
)
def test_a_broken_triangle_set_is_left_out_alone(tmp_path, caplog, wrong, said):
    """Regression: the file was refused, or the reason was another one."""
    sets = f'<t:triangleset name="A"><t:ref index="0"/>{wrong}</t:triangleset>'
    division = read_3mf(tmp_path, sets=f'{sets}<t:triangleset name="B"><t:ref index="2"/></t:triangleset>').regions
    assert division["triangle_set"].labels.tolist() == [0, 0, 1, 0]
    assert division["triangle_set"].names == {1: "B"}
    assert lines_of(caplog) == [f"left out the triangle set 'A': {said}"]


def test_triangle_sets_without_names(tmp_path, caplog):
    """Regression: they were regions with an empty name."""
    sets = "".join(
        f'<t:triangleset{name}><t:ref index="{k}"/></t:triangleset>' for k, name in enumerate(["", ' name="B"', ""])
    )
    division = read_3mf(tmp_path, sets=sets).regions["triangle_set"]
    assert division.labels.tolist() == [1, 2, 3, 0]
    assert division.names == {2: "B"}
    assert caplog.text == ""
    read_3mf(tmp_path, sets='<t:triangleset><t:ref index="9"/></t:triangleset>')
    assert "left out a triangle set without a name: it refers to" in caplog.text


def test_slices_are_left_out_unless_a_mesh_stands_in_for_them(tmp_path, caplog):
    """Regression: files that require the extension were refused."""
    slices = {"attributes": 'requiredextensions="s"', "more": '<s:slicestack id="2"><s:slice ztop="1"/></s:slicestack>'}
    full = read_3mf(tmp_path, of_object='s:slicestackid="2" s:meshresolution="fullres"', **slices)
    assert full.surface.n_faces == 4
    assert lines_of(caplog) == ["left out its slicestack, which are not triangles"]
    with pytest.raises(MeshFileError, match="its surface is given by slices, which are not supported"):
        read_3mf(tmp_path, of_object='s:slicestackid="2" s:meshresolution="lowres"', **slices)


@pytest.mark.parametrize(
    ("sets", "faces", "lines", "said"),
    [
        ({"b": [[], [0], []]}, {}, {"cell_set": [1, 0]}, ""),
        ({"none": [[], [], []]}, {}, {}, "cell_set 'none'"),
        ({"solid": [[], [], [0]]}, {}, {}, "cell_set 'solid'"),
        ({"none": [[], [], []], "a": [[1], [], []]}, {"cell_set": [0, 1, 0, 0]}, {}, "cell_set 'none'"),
        (
            {"a": [[0], [0], []], "b": [[], [0], []]},
            {"cell_set": [1, 0, 0, 0]},
            {"cell_set": [1, 0], "cell_set 2": [1, 0]},
            "",
        ),
    ],
)
def test_cell_sets_without_faces_do_not_divide_the_faces(sets, faces, lines, said):
    """Regression: they were divisions in which all faces have the label 0."""
    meshio = pytest.importorskip("meshio")
    cells = [("triangle", FACES), ("line", [(0, 1), (1, 2)]), ("tetra", [(0, 1, 2, 3)])]
    mesh, _, losses = as_mesh(polygon_soup(meshio.Mesh(POINTS, cells, cell_sets=sets)))
    assert {name: division.labels.tolist() for name, division in mesh.regions.items()} == faces
    assert {name: division.labels.tolist() for name, division in mesh.feature_regions.items()} == lines
    assert losses == ((f"left out the names of regions with nothing in them: {said}",) if said else ())
    back = as_mesh(polygon_soup(to_meshio(mesh)))[0]
    assert back.regions.keys() == mesh.regions.keys()
    assert back.feature_regions.keys() == mesh.feature_regions.keys()
