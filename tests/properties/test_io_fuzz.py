"""The readers on fifteen thousand damaged files: one clear error or a mesh, no crash, no hang, no large allocation."""

import re
import struct
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.errors import MeshFileError
from anisomesh.io.known_formats import MESH_FORMATS
from anisomesh.io.meshes import load_mesh, save
from anisomesh.mesh.surface import Surface

pytestmark = pytest.mark.slow

CASES = 250  # of each kind of file
MOST_BYTES = 8 * 2**20  # more than any of these files has a right to
MOST_SECONDS = 2.0

ASCII_PLY = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 2
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
0 0 1
3 0 1 2
3 1 2 3
"""
ASCII_STL = "solid a\n" + 2 * (
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0.5\nendloop\nendfacet\n"
)
STRIPS_PLY = ASCII_PLY.replace("face 2", "tristrips 1").replace("3 0 1 2\n3 1 2 3", "9 0 1 2 3 -1 0 3 1 2")
NODES = "$Nodes\n1 4 1 40\n2 1 1 4\n1\n7\n9\n40\n0 0 0 1 1\n1 0 0 1 2\n0 1 0 2 1\n0 0 1 2 2\n$EndNodes\n"
TEXT_MSH = (
    f"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{NODES}$Elements\n1 2 1 2\n2 1 2 2\n1 1 7 9\n2 7 9 40\n$EndElements\n"
)
ASCII_VTU = """<VTKFile type="UnstructuredGrid" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="4" NumberOfCells="2"><Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">
0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells>
<DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 1 0 2 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3 7</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">5 6</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>"""
RAW_VTP = b"""<VTKFile type="PolyData" byte_order="LittleEndian"><PolyData><Piece NumberOfPoints="3" NumberOfPolys="1">
<Points><DataArray type="Float32" NumberOfComponents="3" format="appended" offset="0"/></Points>
<Polys><DataArray type="Int32" Name="connectivity" format="appended" offset="40"/>
<DataArray type="Int32" Name="offsets" format="appended" offset="56"/></Polys></Piece></PolyData>
<AppendedData encoding="raw">_%b</AppendedData></VTKFile>""" % struct.pack(
    "<I9fI3iIi", 36, *np.eye(3).ravel(), 12, 0, 1, 2, 4, 3
)
FULL_OBJ = """mtllib a.mtl
v 0 0 0 1 0 0
v 1 0 0 0 1 0
v 0 1 0 0 0 1
v 0 0 1 1 1 1
vt 0 0
vt 1 0
vn 0 0 1
o a thing
g part one
usemtl wood
s 1
f 1/1/1 2/2/1 3/1/1
usemtl stone
s off
f -1/-1/-1 -3/-2/-1 -2/-1/-1
l 1 2 3
p 4
"""
FULL_PLY = """ply
format ascii 1.0
comment TextureFile a.png
comment regions part 1 one
comment edge_regions region 1 rim
element vertex 4
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
property float v_0
property float v_1
property list uchar int tags
element face 2
property list uchar int vertex_indices
property list uchar float texcoord
property int part
element edge 1
property int vertex1
property int vertex2
property int region
end_header
0 0 0 1 2 3 .5 .5 2 1 2
1 0 0 1 2 3 .5 .5 2 1 2
0 1 0 1 2 3 .5 .5 2 1 2
0 0 1 1 2 3 .5 .5 2 1 2
3 0 1 2 6 0 0 1 0 0 1 1
3 1 2 3 6 0 0 1 0 0 1 2
0 1 1
"""
FULL_MEDIT = """MeshVersionFormatted 2
Dimension 3
Vertices 4
0 0 0 1
1 0 0 0
0 1 0 0
0 0 1 3
Triangles 2
1 2 3 5
2 3 4 6
Edges 2
1 2 0
2 4 7
Ridges 1
1
RequiredEdges 1
2
Corners 1
1
RequiredVertices 1
4
Normals 1
0 0 1
NormalAtVertices 1
2 1
End
"""
FULL_MSH = (
    TEXT_MSH.replace("$Nodes", '$PhysicalNames\n1\n2 8 "left"\n$EndPhysicalNames\n$Nodes', 1).replace(
        "$Nodes", "$Entities\n0 0 1 0\n1 0 0 0 1 1 0 1 8 0\n$EndEntities\n$Nodes", 1
    )
    + '$NodeData\n1\n"a"\n1\n0\n3\n0\n1\n4\n1 1\n7 2\n9 3\n40 4\n$EndNodeData\n'
    + '$ElementData\n1\n"b"\n1\n0\n3\n0\n3\n2\n1 1 2 3\n2 4 5 6\n$EndElementData\n'
    + '$ElementNodeData\n1\n"c"\n1\n0\n3\n0\n1\n2\n1 3 1 2 3\n2 3 4 5 6\n$EndElementNodeData\n'
)
U_OBJ = "".join(f"v {x} {y} 0\n" for x, y in [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)])
KINDS = {
    **dict.fromkeys(MESH_FORMATS),
    "ascii.ply": ASCII_PLY,
    "strips.ply": STRIPS_PLY,
    "ascii.stl": ASCII_STL + "endsolid a\n",
    "text.msh": TEXT_MSH,
    "ascii.vtu": ASCII_VTU,
    "raw.vtp": RAW_VTP,
    "concave.obj": U_OBJ + "f 1 2 3 4 5 6 7 8\n",
    "full.off": "STCNOFF\n3 1 0\n" + 3 * "0 0 1 0 0 1 9 8 7 1 .5 1\n" + "3 0 1 2 .5 .25 1 1\n",
    "full.obj": FULL_OBJ,
    "full.ply": FULL_PLY,
    "full.mesh": FULL_MEDIT,
    "full.msh": FULL_MSH,
    **{f"full{suffix}": None for suffix in (".glb", ".3mf", ".vtu", ".vtp", ".meshb")},
}
HOSTILE = [b"999999999", b"-1", b"4294967295", b"1e308", b"nan", b"99999999999999999999", b"", b"0"]


def original(kind, tmp_path):
    if KINDS[kind] is not None:
        return KINDS[kind] if isinstance(KINDS[kind], bytes) else KINDS[kind].encode()
    path = tmp_path / f"original{kind}"
    rng = np.random.default_rng(0)
    surface = Surface(rng.normal(size=(8, 3)), np.array([[0, 1, 2], [3, 4, 5], [5, 6, 7]]))
    mesh = Mesh(
        surface=surface,
        point_data={"a": rng.normal(size=8), "color": rng.integers(0, 256, (8, 4), dtype=np.uint8)},
        face_data={"b": rng.normal(size=(3, 2))},
        corner_data={"uv": rng.uniform(size=(3, 3, 2))},
        regions={name: Regions([1, 1, 2], {1: "one", 2: "two"}) for name in ("object", "material", "texture")},
        features=[[0, 1], [3, 4]],
        fixed_points=[0, 5],
        materials={"textures": {1: {"data": b"\x89PNG and more"}}},
    )
    save(mesh if kind.startswith("full") else surface, path)
    return path.read_bytes()


def damaged(data, rng):
    """Return the file cut off, with bytes changed, doubled or left out, or with another number in place of one."""
    way = rng.integers(6)
    place = int(rng.integers(len(data)))
    if way == 0:
        return data[:place]
    if way == 1:
        changed = bytearray(data)
        for _ in range(rng.integers(1, 5)):
            changed[rng.integers(len(data))] = rng.integers(256)
        return bytes(changed)
    if way == 2:
        numbers = list(re.finditer(rb"\d+", data))
        if numbers:
            chosen = numbers[rng.integers(len(numbers))]
            return data[: chosen.start()] + HOSTILE[rng.integers(len(HOSTILE))] + data[chosen.end() :]
    if way == 3:
        value = struct.pack("<I", rng.choice([0xFFFFFFFF, 0x7FFFFFFF, 0x00FFFFFF, 0]))
        return data[:place] + value + data[place + 4 :]
    end = int(min(place + rng.integers(1, 60), len(data)))
    return data[:place] + (data[place:end] + data[place:] if way == 4 else data[end:])


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files(kind, tmp_path, capfd):
    rng = np.random.default_rng(1)
    data = original(kind, tmp_path)
    path = tmp_path / (kind if KINDS[kind] else f"mesh{Path(kind).suffix or kind}")
    path.write_bytes(data)
    load_mesh(path)  # what it imports and caches is not counted below
    errors = 0
    try:
        for case in range(CASES):
            path.write_bytes(damaged(data, rng))
            if case % 4 == 0:  # tracing takes longer than reading
                tracemalloc.start()
            start = time.process_time()
            try:
                mesh = load_mesh(path)
            except MeshFileError as error:
                errors += 1
                assert str(error).startswith(f"{path}: "), case
                assert len(str(error).splitlines()) == 1, case
            else:
                assert mesh.surface.n_faces >= 1, case
                assert np.isfinite(mesh.surface.points).all(), case
            assert time.process_time() - start < MOST_SECONDS, case
            assert tracemalloc.get_traced_memory()[1] < MOST_BYTES, case  # 0 where nothing is traced
            tracemalloc.stop()
    finally:
        tracemalloc.stop()
    assert errors > CASES // 20
    assert capfd.readouterr() == ("", "")
