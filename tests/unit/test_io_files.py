"""Particular valid and invalid files, and the files that writing leaves behind."""

import io
import logging
import struct
import subprocess
import sys
from functools import partial
from pathlib import Path

import meshio
import numpy as np
import pytest
import trimesh

from anisomesh.errors import MeshError, MeshFileError
from anisomesh.io.atomic import atomic_path
from anisomesh.io.known_formats import MESH_FORMATS
from anisomesh.io.meshes import load, save
from anisomesh.mesh.surface import Surface
from anisomesh.shapes import analytic as shapes

BOX = shapes.box(n=2)
TETRAHEDRON = Surface(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))
PLY = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
PLY_FACES = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
THREE = "0 0 0\n1 0 0\n0 1 0\n"
VOLUME_MESH = meshio.Mesh(np.vstack([np.zeros(3), np.eye(3)]), [("tetra", [[0, 1, 2, 3]]), ("line", [[0, 1]])])


def write(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


BAD = [
    ("a.obj", "", "empty"),
    ("a.obj", " \n\n", "empty"),
    ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no face"),
    ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "point 3 .*3 points"),
    ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "out of|refers to point -1"),
    ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "line 4 refers to point 0"),
    ("a.obj", "v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n", "line 2 should give three coordinates"),
    ("a.obj", "v 0 0 0\nv 1 x 0\nv 0 1 0\nf 1 2 3\n", "line 2 should give three coordinates"),
    ("a.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
    ("a.obj", "v 0 0 0\nv 1 1e999 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
    ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "2 corners"),
    ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3.5\n", "line 4 should give integers"),
    ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf", "line 4 is cut off"),
    ("a.obj", b"\x00\xff\xfe" * 50, "no face"),
    ("a.off", "OFF\n3 1 0\n" + THREE, "truncated"),
    ("a.off", "OFF\n3 1 0\n" + THREE + "3 0 1\n", "fewer corners"),
    ("a.off", "OFF\n3 1 0\n" + THREE + "3 0 1 3\n", "point 3"),
    ("a.off", "OFF\n3 0 0\n" + THREE, "no face"),
    ("a.off", "OFF\nthree\n", "counts"),
    ("a.off", "OFF BINARY\n", "text OFF"),
    ("a.off", "3 1 0\n" + THREE + "3 0 1 2\n", "word OFF"),
    ("a.ply", PLY + PLY_FACES + THREE + "3 0 1", "truncated"),
    ("a.ply", PLY + PLY_FACES + THREE + "3 0 1 7\n", "point 7"),
    ("a.ply", PLY + PLY_FACES + "0 0 0\n1 inf 0\n0 1 0\n3 0 1 2\n", "not finite"),
    ("a.ply", PLY + PLY_FACES + "0 0 0\n1 a 0\n0 1 0\n3 0 1 2\n", "element vertex"),
    ("a.ply", PLY + "end_header\n" + THREE, "no face"),
    ("a.ply", PLY + "element fa", "end_header"),
    ("a.ply", PLY.replace("float z", "list uchar float z") + PLY_FACES + THREE, "scalars with x, y and z"),
    ("a.ply", PLY.replace("property float z\n", "") + PLY_FACES + THREE, "scalars with x, y and z"),
    ("a.ply", PLY.replace("ascii", "binary_middle_endian") + PLY_FACES + THREE, "no known format"),
    ("a.ply", PLY.replace("vertex 3", "vertex 3000000000") + PLY_FACES + THREE, "truncated"),
    (
        "a.ply",
        PLY.replace("ascii", "binary_little_endian").replace("vertex 3", "vertex 999999999999") + PLY_FACES,
        "trunc",
    ),
    ("a.ply", "solid\n", "line ply"),
    ("a.stl", b"\0" * 80 + struct.pack("<I", 2) + b"\0" * 50, "declares 2 triangles, that is 184 bytes, but has 134"),
    ("a.stl", b"\0" * 80 + struct.pack("<I", 0), "no face"),
    ("a.stl", b"\0" * 40, "truncated"),
    ("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n", "truncated"),
    (
        "a.stl",
        "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop endfacet endsolid",
        "trunc",
    ),
    ("a.glb", b"glTF" + struct.pack("<II", 2, 400) + b"\0" * 100, "declares 400 bytes but has 112"),
    ("a.glb", b"nonsense", "glTF"),
    ("a.vtu", "<VTKFile type='UnstructuredGrid'>", "VTU"),
    ("a.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n", "EndNodes"),
    ("a.mesh", "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n0 0 0 0\n", "Vertices declares 4 rows"),
    (
        "a.mesh",
        "MeshVersionFormatted 2\nDimension 3\nVertices\n3\n0 0 0 0 1 0 0 0 0 1 0 0\nTriangles\n1\n1 2 4 0",
        "point 3",
    ),
    ("a.mesh", "MeshVersionFormatted 2\nDimension 4\n", "dimension is 4"),
    ("a.mesh", "Vertices 3", "MeshVersionFormatted"),
    ("a.xyz", THREE, r"unknown format \.xyz; expected one of \.3mf, \.glb, .*\.vtu"),
    ("mesh", THREE, "no extension"),
]


@pytest.mark.parametrize(("name", "content", "message"), BAD)
def test_bad_file_gives_one_line_that_names_it(tmp_path, capfd, name, content, message):
    path = write(tmp_path, name, content)
    with pytest.raises(MeshFileError, match=message) as caught:
        load(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_missing_file_and_folder(tmp_path, suffix):
    with pytest.raises(MeshFileError, match="no such file"):
        load(tmp_path / f"none{suffix}")
    (tmp_path / f"folder{suffix}").mkdir()
    with pytest.raises(MeshFileError, match="is a folder"):
        load(tmp_path / f"folder{suffix}")


@pytest.mark.parametrize("suffix", [".vtu", ".msh", ".mesh"])
def test_volume_cells_alone_are_refused(tmp_path, capfd, suffix):
    path = tmp_path / f"volume{suffix}"
    formats = {".vtu": "vtu", ".msh": "gmsh22", ".mesh": "medit"}
    VOLUME_MESH.write(path, file_format=formats[suffix])
    capfd.readouterr()
    with pytest.raises(MeshFileError, match=r"only .*([Tt]etra).*no surface"):
        load(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("form", ["vtu", "gmsh22", "medit"])
def test_surface_cells_are_taken_and_others_ignored(tmp_path, form):
    cells = [
        ("tetra", [[0, 1, 2, 3]]),
        ("triangle", [[0, 1, 2], [0, 3, 1]]),
        ("line", [[0, 1]]),
        ("quad", [[0, 1, 2, 3]]),
    ]
    points = np.random.default_rng(1).normal(size=(4, 3))
    path = tmp_path / f"mixed{ {'vtu': '.vtu', 'medit': '.mesh'}.get(form, '.msh') }"
    meshio.Mesh(points, cells).write(path, file_format=form)
    surface = load(path)
    np.testing.assert_array_equal(surface.points, points)
    assert surface.n_faces == 4
    assert sorted(map(sorted, surface.faces[:2].tolist())) == [[0, 1, 2], [0, 1, 3]]


def test_gmsh_4_with_scattered_numbers(tmp_path):
    nodes = "$Nodes\n1 4 3 40\n2 1 0 4\n3\n10\n30\n40\n0 0 0\n1 0 0\n0 1 0\n0.1 0 1\n$EndNodes\n"
    cells = "$Elements\n2 3 1 3\n1 1 1 1\n1 3 10\n2 1 2 2\n2 3 10 30\n3 3 40 10\n$EndElements\n"
    surface = load(write(tmp_path, "a.msh", f"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{nodes}{cells}"))
    np.testing.assert_array_equal(surface.points, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.1, 0, 1]])
    assert surface.faces.tolist() == [[0, 1, 2], [0, 3, 1]]


def test_obj_seams_continuations_and_negative_indices(tmp_path):
    text = (
        "# a comment\nmtllib a.mtl\nv 0 0 0 1.0\nv 1 0 0 # right\nv\t0 \\\n 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\n"
        "f 1/1/1 2/2/1 3//1\r\nv 1 1 0.1 0.5 0.5 0.5\nf -1/2 -2/1 -3/1\nl 1 2\nf 1 2 4 3\n"
    )
    surface = load(write(tmp_path, "seam.OBJ", text))
    np.testing.assert_array_equal(surface.points, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.1]])
    assert surface.faces[:2].tolist() == [[0, 1, 2], [3, 2, 1]]
    assert surface.n_faces == 4
    assert (surface.edge_face_count.sum(), surface.n_points) == (12, 4)


@pytest.mark.parametrize(
    "text",
    [
        "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
        "OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255 0 0\n",
        "# c\nCOFF\n\n3 1\n0 0 0 1 1 1 1\n1 0 0 1 1 1 1 # c\n\n0 1 0 1 1 1 1\r\n3 0 1 2\n",
    ],
)
def test_off_dialects(tmp_path, text):
    surface = load(write(tmp_path, "a.off", text))
    np.testing.assert_array_equal(surface.points, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    assert surface.faces.tolist() == [[0, 1, 2]]


def test_quadrilaterals_are_split_along_the_shorter_diagonal(tmp_path):
    kite = "v 0 0 0\nv 3 0 0\nv 4 1 0\nv 0 2 0\n"
    for corners in ("1 2 3 4", "2 3 4 1", "3 4 1 2", "4 3 2 1"):
        surface = load(write(tmp_path, "kite.obj", kite + f"f {corners}\n"))
        assert [1, 3] in surface.edges.tolist()
        assert np.ptp(surface.face_normals[:, 2]) == 0


def test_stl_is_welded_and_says_so(tmp_path, caplog):
    facet = "facet normal 0 0 0\n outer loop\n{}\n endloop\nendfacet\n"
    corners = [" ".join(map(str, row)) for row in BOX.points.tolist()]
    text = "".join(facet.format("\n".join(f"VERTEX {corners[k]}" for k in face)) for face in BOX.faces)
    with caplog.at_level(logging.INFO, logger="anisomesh"):
        surface = load(write(tmp_path, "box.stl", f"solid box\n{text}endsolid box\n"))
    assert surface.n_points == BOX.n_points
    assert f"welded {3 * BOX.n_faces} corners into {BOX.n_points} points" in caplog.text
    np.testing.assert_array_equal(surface.points[surface.faces], BOX.points[BOX.faces])


def test_binary_stl_whose_header_says_solid(tmp_path):
    save(BOX, tmp_path / "box.stl")
    data = (tmp_path / "box.stl").read_bytes()
    tricky = write(tmp_path, "solid.stl", b"solid facet".ljust(80) + data[80:])
    assert load(tricky).n_faces == BOX.n_faces


def test_nothing_is_repaired_at_load(tmp_path):
    surface = Surface(np.vstack([BOX.points, [9, 9, 9]]), np.vstack([BOX.faces, [0, 0, 1]]))
    for suffix in (".obj", ".off", ".ply", ".3mf", ".vtu", ".vtp", ".mesh", ".msh"):
        save(surface, tmp_path / f"a{suffix}")
        again = load(tmp_path / f"a{suffix}")
        np.testing.assert_array_equal(again.points, surface.points)
        np.testing.assert_array_equal(again.faces, surface.faces)


def test_point_data_reaches_vtu_and_ply(tmp_path, caplog):
    data = {"height": BOX.points[:, 2] * np.pi, "normal": BOX.point_normals}
    save(BOX, tmp_path / "a.vtu", point_data=data)
    read = meshio.read(tmp_path / "a.vtu").point_data
    for name, values in data.items():
        np.testing.assert_array_equal(read[name], values)
    assert caplog.text == ""
    save(BOX, tmp_path / "a.ply", point_data=data)
    np.testing.assert_array_equal(meshio.read(tmp_path / "a.ply").point_data["height"], data["height"])
    read = trimesh.load(tmp_path / "a.ply", process=False)
    np.testing.assert_array_equal(read.vertex_normals, data["normal"])
    assert caplog.text == ""
    save(BOX, tmp_path / "a.ply", point_data={"two words": data["height"]})
    np.testing.assert_array_equal(load(tmp_path / "a.ply").points, BOX.points)
    save(BOX, tmp_path / "b.ply", point_data={"x": data["height"]})
    assert "left out what PLY cannot hold: point data 'x'" in caplog.text
    (tmp_path / "b.ply").unlink()
    save(BOX, tmp_path / "a.obj", point_data=data)
    assert "left out what OBJ cannot hold: point data 'height'" in caplog.text
    with pytest.raises(MeshFileError, match=r"has shape \(3,\); expected \(26,\)"):
        save(BOX, tmp_path / "b.ply", point_data={"q": np.zeros(3)})
    assert not (tmp_path / "b.ply").exists()


@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_failed_write_keeps_the_old_file_and_leaves_no_trace(tmp_path, monkeypatch, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_text("old")

    def interrupt(*_args):
        raise KeyboardInterrupt

    monkeypatch.setattr("pathlib.Path.replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        save(BOX, path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_impossible_targets_are_refused(tmp_path):
    with pytest.raises(MeshFileError, match="does not exist; create it first"):
        save(BOX, tmp_path / "none" / "a.obj")
    with pytest.raises(MeshFileError, match="unknown format"):
        save(BOX, tmp_path / "a.docx")
    for use in (partial(save, BOX), load):
        with pytest.raises(MeshFileError, match=r"stream: .*; give file_format, one of \.3mf, "):
            use(io.BytesIO())
    (tmp_path / "a.obj").mkdir()
    with pytest.raises(MeshFileError, match="not a plain file"):
        save(BOX, tmp_path / "a.obj")
    for suffix in (".stl", ".glb"):
        with pytest.raises(MeshFileError, match="float32"):
            save(BOX.with_points(BOX.points * 1e300), tmp_path / f"huge{suffix}")
    assert list(tmp_path.iterdir()) == [tmp_path / "a.obj"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full to play a full disk")
def test_full_disk_is_an_error_of_ours(tmp_path):
    with pytest.raises(MeshFileError, match="cannot be written"), atomic_path(tmp_path / "a.txt") as temporary:
        temporary.write_text("begun")
        with Path("/dev/full").open("w") as full:
            full.write("x")
    assert list(tmp_path.iterdir()) == []


def test_atomic_path_follows_links_and_keeps_the_mode(tmp_path):
    real = tmp_path / "real.txt"
    real.write_text("old")
    real.chmod(0o640)
    link = tmp_path / "link.txt"
    link.symlink_to(real)
    with atomic_path(link) as temporary:
        assert temporary.suffix == ".txt"
        assert temporary.parent == tmp_path
        temporary.write_text("new")
        assert real.read_text() == "old"
    assert link.is_symlink()
    assert real.read_text() == "new"
    assert real.stat().st_mode & 0o777 == 0o640
    assert sorted(tmp_path.iterdir()) == [link, real]


@pytest.mark.slow
def test_formats_need_no_heavy_library(tmp_path):
    for suffix in MESH_FORMATS:
        save(BOX, tmp_path / f"a{suffix}")
    code = (
        "import sys; from anisomesh.io.meshes import load; "
        f"[load({str(tmp_path)!r} + '/a' + s) for s in {MESH_FORMATS!r}]; "
        "print(sorted({'trimesh', 'meshio', 'igl', 'numba', 'torch', 'pyvista'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("version", ["gmsh", "gmsh22"])
@pytest.mark.parametrize("binary", [True, False])
def test_counts_of_gmsh_files_are_checked_before_room_is_made(tmp_path, version, binary):
    """Regression: a number of nodes or elements with a digit more took gigabytes before it was refused."""
    path = tmp_path / "a.msh"
    meshio.Mesh(BOX.points, [("triangle", BOX.faces)]).write(path, file_format=version, binary=binary)
    assert load(path).n_faces == BOX.n_faces
    data = path.read_bytes()
    if version == "gmsh22" or not binary:
        place = data.index(b"\n", data.index(b"$Nodes")) + 1
        n = str(BOX.n_points).encode()
        place = data.index(n, place)
        changed = data[:place] + n + b"99999999" + data[place + len(n) :]
    else:
        place = data.index(b"$Nodes\n") + 15
        changed = data[:place] + (10**9).to_bytes(8, "little") + data[place + 8 :]
    path.write_bytes(changed)
    with pytest.raises(MeshFileError, match=r"declares \d+ (nodes|numbers)"):
        load(path)


@pytest.mark.parametrize("binary", [True, False])
def test_blocks_of_gmsh_4_are_checked_before_room_is_made(tmp_path, binary):
    """Regression: the counts of blocks in files of version 4 were believed, and the numbers of nodes."""
    path = tmp_path / "a.msh"
    meshio.Mesh(BOX.points, [("triangle", BOX.faces)]).write(path, file_format="gmsh", binary=binary)
    data = path.read_bytes()
    n, m = BOX.n_points, BOX.n_faces
    for section, count in (("Nodes", n), ("Elements", m)):
        start = data.index(b"\n", data.index(b"$" + section.encode())) + 1
        if binary:
            place = start + 4 * 8 + 3 * 4  # behind the four numbers of the section and three of the block
            assert int.from_bytes(data[place : place + 8], "little") == count
            changed = data[:place] + (10**9).to_bytes(8, "little") + data[place + 8 :]
        else:
            line = data.index(b"\n", start) + 1
            place = data.index(b" %d" % count, line)
            changed = data[:place] + b" 1000000000" + data[place + len(b" %d" % count) :]
        path.write_bytes(changed)
        with pytest.raises(MeshFileError, match=r"declares \d+ numbers"):
            load(path)
    place = data.index(b"$Nodes")
    start = data.index(b"\n", place) + 1
    if binary:
        first = start + 4 * 8 + 3 * 4 + 8
        changed = data[:first] + (10**12).to_bytes(8, "little") + data[first + 8 :]
    else:
        lines = data[start:].split(b"\n")
        changed = data[:start] + b"\n".join([*lines[:2], b"1000000000000", *lines[3:]])
    path.write_bytes(changed)
    with pytest.raises(MeshFileError, match="refers to node 1, which is not among the nodes"):
        load(path)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ([[1], [1, 2], [1], [1]], "cannot be read as an array"),
        (3, "has shape"),
        (None, "has shape"),
        (np.ones((4, 3, 3)), "has shape"),
        (np.ones((4, 0)), "has shape"),
        (np.ones(4) + 1j, "expected integers or real numbers"),
        (np.array(["a"] * 4), "expected integers or real numbers"),
        (np.array(["2020-01-01"] * 4, dtype="datetime64[D]"), "expected integers or real numbers"),
    ],
)
@pytest.mark.parametrize("suffix", [".ply", ".vtu"])
def test_point_data_that_no_format_can_store_is_refused_and_leaves_no_file(tmp_path, suffix, values, message):
    with pytest.raises(MeshFileError, match=message):
        save(TETRAHEDRON, tmp_path / f"a{suffix}", point_data={"a": values})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "dtype", [bool, np.float16, np.float32, np.float64, np.longdouble, np.int8, np.int64, np.uint16]
)
@pytest.mark.parametrize("suffix", [".ply", ".vtu"])
def test_point_data_of_every_real_type_is_written_and_the_mesh_read_back(tmp_path, suffix, dtype):
    mesh = BOX
    save(mesh, tmp_path / f"a{suffix}", point_data={"a": np.ones(mesh.n_points, dtype=dtype)})
    np.testing.assert_array_equal(load(tmp_path / f"a{suffix}").points, mesh.points)


def test_what_is_not_a_mesh_or_a_file_name_is_refused(tmp_path):
    with pytest.raises(MeshError, match="cannot read a mesh from NoneType"):
        save(None, tmp_path / "a.ply")
    for path in (None, 3, b"x.obj"):
        with pytest.raises(MeshFileError, match="not a file name"):
            load(path)
        with pytest.raises(MeshFileError, match="not a file name"):
            save(BOX, path)
    for call in (load, lambda path: save(BOX, path)):
        with pytest.raises(MeshFileError, match=r"cannot be|no such file"):
            call(tmp_path / ("a" * 300 + ".obj"))
    (tmp_path / "loop.ply").symlink_to(tmp_path / "loop.ply")
    with pytest.raises(MeshFileError, match="cannot be written"):
        save(BOX, tmp_path / "loop.ply")
