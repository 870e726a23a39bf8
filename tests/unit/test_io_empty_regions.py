"""Names of regions that nothing is in, and parts that a file does not show, are named in one line."""

import json
import logging
import struct
import zipfile

import numpy as np
import pytest

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.known_formats import MESH_FORMATS
from anisomesh.io.meshes import load_mesh, save
from anisomesh.io.objects.read import polygon_soup
from anisomesh.shapes.analytic import box

POINTS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
VERTICES = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
FACET = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
SOLIDS = f"solid lid\nendsolid lid\nsolid body\n{FACET}endsolid body\n"
GROUPS = (
    '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n4\n0 1 "tip"\n1 2 "rim"\n2 3 "inlet"\n2 4 "wall"\n'
    "$EndPhysicalNames\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n$Elements\n1\n1 2 2 4 4 1 2 3\n$EndElements\n"
)
PLY = (
    "ply\nformat ascii 1.0\ncomment regions part 1 wall\ncomment regions part 2 inlet\nelement vertex 3\n"
    + "".join(f"property float {name}\n" for name in "xyz")
    + "element face 1\nproperty list uchar int vertex_indices\nproperty int part\nend_header\n"
    + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 1\n"
)
NAMED = "the names of regions with nothing in them: "


def glb(document):
    """Return a file with a triangle as mesh 0, and a line as mesh 1."""
    binary = POINTS.astype("<f4").tobytes()
    accessor = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}
    text = json.dumps(
        {
            "asset": {"version": "2.0"},
            "buffers": [{"byteLength": len(binary)}],
            "bufferViews": [{"buffer": 0, "byteLength": len(binary)}],
            "accessors": [accessor],
            "meshes": [
                {"name": name, "primitives": [{"attributes": {"POSITION": 0}, "mode": mode, "material": 0}]}
                for name, mode in (("body", 4), ("outline", 1), ("spare", 4))
            ],
            "scenes": [{"nodes": [0, 1]}],
            **document,
        }
    ).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def model(path):
    """Write an archive with an object of a triangle, one without, one that is not built, and an unused material."""
    vertices = "".join("<vertex x='{}' y='{}' z='{}'/>".format(*row) for row in POINTS.tolist())
    mesh = f"<mesh><vertices>{vertices}</vertices><triangles>%s</triangles></mesh>"
    triangle = "<triangle v1='0' v2='1' v3='2' pid='9' p1='0'/>"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr(
            "3D/3dmodel.model",
            "<model xmlns='http://schemas.microsoft.com/3dmanufacturing/core/2015/02'><resources>"
            "<basematerials id='9'><base name='oak' displaycolor='#FF0000'/><base name='elm' displaycolor='#00FF00'/>"
            f"</basematerials><object id='1' name='body'>{mesh % triangle}</object><object id='2' name='hollow'>"
            f"{mesh % ''}</object><object id='3' name='spare'>{mesh % triangle}</object></resources>"
            "<build><item objectid='1'/><item objectid='2'/></build></model>",
        )


FILES = {
    "a.obj": (f"{VERTICES}g default\no thing\ng lid\nusemtl tin\ng body\nf 1 2 3\ng edge\nl 1 2\n", "group 'lid'"),
    "unused.obj": (f"{VERTICES}f 1 2 3\nusemtl tin\n", "material 'tin'"),
    "a.stl": (SOLIDS, "solid 'lid'"),
    "a.msh": (GROUPS, "physical 'tip', 'rim', 'inlet'"),
    "none.msh": (GROUPS.replace("1 2 2 4 4 1", "1 2 2 0 4 1"), "physical 'tip', 'rim', 'inlet', 'wall'"),
    "a.ply": (PLY, "part 'inlet'"),
    "a.glb": (
        glb(
            {
                "nodes": [{"name": "first", "mesh": 0}, {"name": "second", "mesh": 1}],
                "materials": [{"name": "red"}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}, {"primitives": []}],
            }
        ),
        "node 'second'",
    ),
    "named.glb": (
        glb({"nodes": [{"mesh": 0}, {}], "materials": [{"name": "region_7"}, {"name": "blue"}]}),
        "material 'blue'",
    ),
}


@pytest.mark.parametrize("name", FILES)
def test_names_of_regions_without_faces_are_said(tmp_path, caplog, name):
    """Regression: they vanished without a line."""
    content, said = FILES[name]
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    load_mesh(tmp_path / name)
    lines = [line.getMessage() for line in caplog.records if NAMED in line.getMessage()]
    assert len(lines) == 1
    assert lines[0].endswith(f"{NAMED}{said}")


def test_objects_and_materials_of_3mf_without_triangles_are_said(tmp_path, caplog):
    model(tmp_path / "a.3mf")
    mesh = load_mesh(tmp_path / "a.3mf")
    assert mesh.surface.n_faces == 1
    assert f"{NAMED}object 'hollow'; material 'elm'" in caplog.text
    assert "left out 1 object(s) that it does not build: 'spare'" in caplog.text


def test_meshes_that_the_scene_of_a_glb_file_does_not_show_are_said(tmp_path, caplog):
    nodes = [{"mesh": 0}, {"mesh": 1, "name": "a"}]
    (tmp_path / "a.glb").write_bytes(glb({"nodes": nodes, "materials": [{"name": "red"}, {"name": "blue"}]}))
    mesh = load_mesh(tmp_path / "a.glb")
    assert "left out 1 mesh(es) that are not in its scene: 'spare'" in caplog.text
    assert "blue" not in caplog.text  # which is handed on
    assert mesh.materials["gltf"]["materials"] == [{"name": "red"}, {"name": "blue"}]


def test_groups_of_meshio_without_cells_are_said(caplog):
    meshio = pytest.importorskip("meshio")
    groups = {"wall": np.array([1, 2]), "inlet": np.array([2, 2]), "fluid": np.array([1, 3])}
    given = meshio.Mesh(POINTS, [("triangle", [[0, 1, 2]])], cell_data={"gmsh:physical": [[1]]}, field_data=groups)
    soup = polygon_soup(given)
    from anisomesh.io.assemble import as_mesh

    losses = as_mesh(soup)[2]
    assert f"left out {NAMED}physical 'inlet'" in losses
    assert "left out physical groups of volumes: fluid" in losses


@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_names_without_faces_that_are_not_written_are_said(tmp_path, caplog, suffix):
    """Regression: names of regions that a mesh does not have were left out of files without a line."""
    caplog.set_level(logging.WARNING)
    surface = box(n=1)
    regions = {"physical": Regions(np.ones(surface.n_faces, dtype=np.int64), {1: "wall", 2: "inlet"})}
    save(Mesh(surface=surface, regions=regions), tmp_path / f"a{suffix}")
    load_mesh(tmp_path / f"a{suffix}")
    has_names = suffix not in (".off", ".mesh", ".meshb")
    assert ("'inlet'" in caplog.text) == has_names
    assert caplog.text.count("inlet") <= 1
