"""Every surface cell of a file is read, whatever its kind, encoding and piece, or refused by name."""

import itertools
import logging
import struct

import meshio
import numpy as np
import pytest

from anisomesh.errors import MeshFileError
from anisomesh.io.meshes import load, save
from anisomesh.mesh.surface import Surface
from anisomesh.shapes import analytic as shapes

CORNERS = np.array(list(itertools.product((0.0, 1.0), repeat=3)))[:, ::-1]
FIVE = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2]]  # a cube without its side x = 1
LAST = [1, 3, 7, 5]
MIDDLES = np.array([[1, 0.5, 0], [1, 1, 0.5], [1, 0.5, 1], [1, 0, 0.5], [1, 0.5, 0.5]])
POINTS = np.vstack([CORNERS, MIDDLES])
LAST_SIDE = {  # VTK's cell types: https://vtk.org/doc/nightly/html/vtkCellType_8h.html
    "triangles": [(5, [1, 3, 7]), (5, [1, 7, 5])],
    "strip": [(6, [3, 7, 1, 5])],
    "polygon": [(7, LAST)],
    "pixel": [(8, [1, 3, 5, 7])],
    "quad": [(9, LAST)],
    "quadratic triangles": [(22, [1, 3, 7, 8, 9, 12]), (22, [1, 7, 5, 12, 10, 11])],
    "quadratic quad": [(23, [*LAST, 8, 9, 10, 11])],
    "biquadratic quad": [(28, [*LAST, 8, 9, 10, 11, 12])],
    "quadratic linear quad": [(30, [*LAST, 8, 10])],
    "quadratic polygon": [(36, [*LAST, 8, 9, 10, 11])],
    "Lagrange triangles": [(69, [1, 3, 7, 8, 9, 12]), (69, [1, 7, 5, 12, 10, 11])],
    "Lagrange quad": [(70, [*LAST, 8, 9, 10, 11, 12])],
}


def is_the_cube(surface):
    assert surface.area == pytest.approx(6)
    a, b, c = (surface.points[surface.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", np.cross(a, b), c) / 6 == pytest.approx(1)


def vtk_grid(cells):
    pyvista = pytest.importorskip("pyvista")
    flat = np.concatenate([[len(nodes), *nodes] for _, nodes in cells])
    return pyvista.UnstructuredGrid(flat, np.array([kind for kind, _ in cells], dtype=np.uint8), POINTS)


def write_with_vtk(data, path, mode="appended", compressor="ZLib", *, base64=False, big=False, header=32):
    import vtk

    writer = vtk.vtkXMLUnstructuredGridWriter() if path.suffix == ".vtu" else vtk.vtkXMLPolyDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(data)
    getattr(
        writer, {"ascii": "SetDataModeToAscii", "binary": "SetDataModeToBinary"}.get(mode, "SetDataModeToAppended")
    )()
    getattr(writer, f"SetCompressorTypeTo{compressor}")()
    writer.SetEncodeAppendedData(base64)
    writer.SetBlockSize(64)  # bytes: several blocks
    writer.SetHeaderTypeToUInt64() if header == 64 else writer.SetHeaderTypeToUInt32()
    writer.SetByteOrderToBigEndian() if big else writer.SetByteOrderToLittleEndian()
    writer.Write()


@pytest.mark.parametrize("kind", LAST_SIDE)
def test_surface_cells_of_vtu(tmp_path, kind):
    """Regression: strips, pixels and cells of second order vanished if others were there."""
    lines_and_volumes = [(3, [0, 1]), (12, [0, 1, 3, 2, 4, 5, 7, 6]), (1, [0])]
    grid = vtk_grid([*[(9, nodes) for nodes in FIVE], *lines_and_volumes, *LAST_SIDE[kind]])
    write_with_vtk(grid, tmp_path / "a.vtu")
    is_the_cube(load(tmp_path / "a.vtu"))


@pytest.mark.parametrize(
    ("kind", "n_triangles", "used"),
    [
        ("quadratic triangles", 8, {1, 3, 5, 7, 8, 9, 10, 11, 12}),
        ("quadratic quad", 6, {1, 3, 5, 7, 8, 9, 10, 11}),
        ("biquadratic quad", 8, {1, 3, 5, 7, 8, 9, 10, 11, 12}),
        ("quadratic linear quad", 4, {1, 3, 5, 7, 8, 10}),
        ("quadratic polygon", 2, {1, 3, 5, 7}),
        ("Lagrange triangles", 8, {1, 3, 5, 7, 8, 9, 10, 11, 12}),
        ("Lagrange quad", 8, {1, 3, 5, 7, 8, 9, 10, 11, 12}),
    ],
)
def test_cells_of_second_order_by_themselves_are_split(tmp_path, kind, n_triangles, used, caplog):
    write_with_vtk(vtk_grid(LAST_SIDE[kind]), tmp_path / "a.vtu")
    surface = load(tmp_path / "a.vtu")
    assert surface.area == pytest.approx(1)
    assert surface.n_faces == n_triangles
    assert set(surface.faces.ravel().tolist()) == used
    way = "read as polygons of their corners" if "polygon" in kind else "split at the nodes of their sides"
    assert f"{len(LAST_SIDE[kind])} cell(s) of higher order were {way}" in caplog.text


def test_cells_that_are_not_known_are_refused_by_name(tmp_path):
    write_with_vtk(vtk_grid([(9, LAST), (9, FIVE[0])]), tmp_path / "a.vtu", "ascii")
    text = (tmp_path / "a.vtu").read_text()
    place = text.index(">", text.index('Name="types"')) + 1
    (tmp_path / "a.vtu").write_text(text[:place] + text[place:].replace("9", "99", 1))
    with pytest.raises(MeshFileError, match="cell 0 is of type 99, which is not known"):
        load(tmp_path / "a.vtu")


@pytest.mark.parametrize("suffix", [".vtu", ".vtp"])
@pytest.mark.parametrize("mode", ["ascii", "binary", "appended", "base64"])
@pytest.mark.parametrize("compressor", ["None", "ZLib", "LZ4", "LZMA"])
def test_encodings_of_vtk_files(tmp_path, suffix, mode, compressor):
    pyvista = pytest.importorskip("pyvista")
    ball = pyvista.Sphere(theta_resolution=9, phi_resolution=9)
    data = ball if suffix == ".vtp" else ball.cast_to_unstructured_grid()
    for big, header in ((False, 32), (True, 64)):
        path = tmp_path / f"a{suffix}"
        write_with_vtk(data, path, mode, compressor, base64=mode == "base64", big=big, header=header)
        surface = load(path)
        np.testing.assert_array_equal(surface.points, ball.points)
        np.testing.assert_array_equal(surface.faces, ball.regular_faces)
        content = path.read_bytes()
        for length in range(len(content) // 2, len(content) - 20, 97):
            path.write_bytes(content[:length])
            with pytest.raises(MeshFileError):
                load(path)


def test_unknown_compressor_is_named(tmp_path):
    save(shapes.box(n=1), tmp_path / "a.vtu")
    text = (tmp_path / "a.vtu").read_text().replace("vtkZLibDataCompressor", "vtkZstdDataCompressor")
    (tmp_path / "a.vtu").write_text(text)
    with pytest.raises(MeshFileError, match="vtkZstdDataCompressor; save it with ZLib"):
        load(tmp_path / "a.vtu")


@pytest.mark.parametrize("suffix", [".vtu", ".vtp"])
def test_pieces(tmp_path, suffix):
    """Regression: all but the first piece of a file vanished."""
    path = tmp_path / f"a{suffix}"
    one = shapes.torus(n_major=6, n_minor=5)
    save(one, path)
    text = path.read_text()
    begin, end = text.index("<Piece"), text.index("</Piece>") + len("</Piece>")
    empty = '<Piece NumberOfPoints="0" NumberOfCells="0" NumberOfPolys="0"><Points></Points></Piece>'
    path.write_text(text[:end] + empty + text[begin:])
    two = load(path)
    assert two.n_points == 2 * one.n_points
    np.testing.assert_array_equal(two.faces, np.vstack([one.faces, one.faces + one.n_points]))
    path.write_text((text[:end] + text[begin:]).replace('NumberOfPoints="30"', 'NumberOfPoints="29"', 1))
    with pytest.raises(MeshFileError, match="declares '29' points"):
        load(path)


def test_polygons_and_strips_of_vtp(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    faces = np.concatenate([[4, *nodes] for nodes in FIVE])
    data = pyvista.PolyData(POINTS, faces=faces, strips=[4, 3, 7, 1, 5], lines=[2, 0, 1], verts=[1, 0])
    write_with_vtk(data, tmp_path / "a.vtp")
    is_the_cube(load(tmp_path / "a.vtp"))


@pytest.mark.parametrize("suffix", [".vtu", ".vtp"])
def test_vtk_reads_what_is_written(tmp_path, suffix):
    pyvista = pytest.importorskip("pyvista")
    surface = shapes.torus(n_major=12, n_minor=8)
    data = {"a b": np.arange(surface.n_points), "normal <1>": surface.point_normals}
    save(surface, tmp_path / f"a{suffix}", point_data=data)
    read = pyvista.read(tmp_path / f"a{suffix}")
    np.testing.assert_array_equal(read.points, surface.points)
    for name, values in data.items():
        np.testing.assert_array_equal(read.point_data[name], values)
    np.testing.assert_array_equal(read.extract_surface(algorithm=None).triangulate().regular_faces, surface.faces)


# Gmsh


SECOND_ORDER = [("triangle6", [[1, 3, 7, 8, 9, 12], [1, 7, 5, 12, 10, 11]])]


@pytest.mark.parametrize("version", ["2.2", "4.0", "4.1"])
@pytest.mark.parametrize("binary", [True, False])
def test_gmsh_files_of_all_versions(tmp_path, version, binary):
    cells = [("quad", FIVE), ("tetra", [[0, 1, 2, 4]]), ("line", [[0, 1]]), ("line3", [[0, 1, 8]]), *SECOND_ORDER]
    entities = {"gmsh:dim_tags": np.tile([2, 1], (len(POINTS), 1))} if version == "4.1" else {}
    numbers = [np.full(len(rows), k + 1) for k, (_, rows) in enumerate(cells)]
    tags = {"gmsh:physical": numbers, "gmsh:geometrical": numbers}
    mesh = meshio.Mesh(POINTS, cells, point_data=entities, cell_data=tags)
    meshio.gmsh.write(tmp_path / "a.msh", mesh, fmt_version=version, binary=binary)
    is_the_cube(load(tmp_path / "a.msh"))
    data = (tmp_path / "a.msh").read_bytes()
    for length in range(40, data.index(b"$EndElements"), 61):
        (tmp_path / "a.msh").write_bytes(data[:length])
        with pytest.raises(MeshFileError):
            load(tmp_path / "a.msh")


@pytest.mark.parametrize("form", ["gmsh22", "gmsh"])
def test_gmsh_surface_of_second_order_is_split(tmp_path, form):
    meshio.Mesh(POINTS, SECOND_ORDER).write(tmp_path / "a.msh", file_format=form)
    surface = load(tmp_path / "a.msh")
    assert (surface.n_faces, surface.area) == (8, pytest.approx(1))


def test_gmsh_parametric_nodes_and_sparse_tags(tmp_path):
    """Regression: parameters behind the coordinates were taken for the next point; large tags needed large tables."""
    nodes = "$Nodes\n3 4 1 9000000000\n0 1 0 1\n9000000000\n0 0 0\n1 1 1 1\n7\n1 0 0 0.5\n2 1 1 2\n3\n5\n"
    nodes += "0 1 0 0.1 0.2\n0 0 1 0.3 0.4\n$EndNodes\n"
    cells = "$Elements\n1 2 1 2\n2 1 2 2\n1 9000000000 7 3\n2 9000000000 5 7\n$EndElements\n"
    (tmp_path / "a.msh").write_text(f"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{nodes}{cells}")
    surface = load(tmp_path / "a.msh")
    np.testing.assert_array_equal(surface.points, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    assert surface.faces.tolist() == [[0, 1, 2], [0, 3, 1]]
    old = "$ParametricNodes\n3\n1 0 0 0 0 1\n2 1 0 0 1 1 0.5\n9 0 1 0 2 1 0.5 0.5\n$EndParametricNodes\n"
    cells = "$Elements\n1\n1 2 3 1 1 0 1 2 9\n$EndElements\n"
    (tmp_path / "a.msh").write_text(f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{old}{cells}")
    np.testing.assert_array_equal(load(tmp_path / "a.msh").points, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])


def test_gmsh_binary_of_the_other_byte_order(tmp_path):
    nodes = b"".join(struct.pack(">i3d", k + 1, *point) for k, point in enumerate(np.eye(3)))
    cells = struct.pack(">3i", 2, 1, 2) + struct.pack(">6i", 1, 1, 1, 1, 2, 3)
    head = b"$MeshFormat\n2.2 1 8\n" + struct.pack(">i", 1) + b"\n$EndMeshFormat\n"
    body = b"$Nodes\n3\n" + nodes + b"\n$EndNodes\n$Elements\n1\n" + cells + b"\n$EndElements\n"
    (tmp_path / "a.msh").write_bytes(head + body)
    np.testing.assert_array_equal(load(tmp_path / "a.msh").points, np.eye(3))


@pytest.mark.parametrize(
    ("nodes", "elements", "message"),
    [
        ("1 0 0 0\n2 1 0 0\n3 0 1 0", "1 140 2 1 1 1 2 3", "elements of type 140"),
        ("1 0 0 0\n2 1 0 0\n3 0 1 0", "1 2 2 1 1 1 2", "element line 1"),
        ("1 0 0 0\n2 1 0 0\n3 0 1 0", "1 2 2 1 1 1 2 4", "refers to node 4"),
        ("1 0 0 0\n1 1 0 0\n3 0 1 0", "1 2 2 1 1 1 2 3", "two nodes have the tag 1"),
        ("1.5 0 0 0\n2 1 0 0\n3 0 1 0", "1 2 2 1 1 1 2 3", "not an integer"),
    ],
)
def test_bad_gmsh_files(tmp_path, nodes, elements, message):
    text = f"$Nodes\n3\n{nodes}\n$EndNodes\n$Elements\n1\n{elements}\n$EndElements\n"
    (tmp_path / "a.msh").write_text(f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{text}")
    with pytest.raises(MeshFileError, match=message):
        load(tmp_path / "a.msh")


# MEDIT


def medit(*sections):
    rows = [("Vertices", POINTS.tolist(), 0), *((name, cells, 1) for name, cells in sections)]
    lines = [
        "\n".join([name, str(len(cells)), *(" ".join(str(x + first) for x in row) + " 0" for row in cells)])
        for name, cells, first in rows
    ]
    return "\n".join(["MeshVersionFormatted 2", "Dimension 3", *lines, "End"])


@pytest.mark.parametrize(
    "sections",
    [
        [
            ("Quadrilaterals", FIVE[:2]),
            ("Quadrilaterals", FIVE[2:]),
            ("Triangles", [[1, 3, 7]]),
            ("Triangles", [[1, 7, 5]]),
        ],
        [("Quadrilaterals", FIVE), ("TrianglesP2", SECOND_ORDER[0][1])],
        [("QuadrilateralsQ2", [[*LAST, *range(8, 13)]]), ("Quadrilaterals", FIVE), ("Tetrahedra", [[0, 1, 2, 4]])],
    ],
)
def test_sections_of_medit(tmp_path, sections):
    """Regression: of several sections of a name only the last was read, and none of higher order."""
    (tmp_path / "a.mesh").write_text(medit(*sections))
    is_the_cube(load(tmp_path / "a.mesh"))
    (tmp_path / "a.mesh").write_text(medit(("TrianglesP2", SECOND_ORDER[0][1])))
    assert load(tmp_path / "a.mesh").n_faces == 8


def test_medit_of_two_dimensions(tmp_path):
    (tmp_path / "a.mesh").write_text(
        "MeshVersionFormatted 1 Dimension 2 Vertices 3 0 0 0 1 0 0 0 1 0 Triangles 1 1 2 3 0"
    )
    assert load(tmp_path / "a.mesh").area == 0.5


# PLY


def test_strips_of_ply(tmp_path):
    """Regression: files of triangle strips, as of the Stanford repository, were refused."""
    tetrahedron = Surface(np.vstack([np.zeros(3), np.eye(3)]), [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    head = "ply\nformat {} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    head += "element tristrips 2\nproperty list int int vertex_indices\nend_header\n"
    strips = [[0, 2, 1, 3, 0, -1, 0, 3, 2], []]
    (tmp_path / "a.ply").write_text(
        head.format("ascii") + "".join(f"{x} {y} {z}\n" for x, y, z in tetrahedron.points) + "9 0 2 1 3 0 -1 0 3 2\n0\n"
    )
    binary = b"".join(struct.pack(f">{1 + len(strip)}i", len(strip), *strip) for strip in strips)
    path = tmp_path / "b.ply"
    path.write_bytes(head.format("binary_big_endian").encode() + tetrahedron.points.astype(">f4").tobytes() + binary)
    for name in "ab":
        read = load(tmp_path / f"{name}.ply")
        assert sorted(map(sorted, read.faces.tolist())) == [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]
        a, b, c = (read.points[read.faces[:, k]] for k in range(3))
        assert np.einsum("ij,ij->", np.cross(a, b), c) / 6 == pytest.approx(1 / 6)


def test_ply_faces_under_an_unknown_name_are_refused(tmp_path):
    head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    head += "element face 1\nproperty list uchar int corners\nend_header\n"
    (tmp_path / "a.ply").write_text(head + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    with pytest.raises(MeshFileError, match=r"lists .*corners.*; expected vertex_indices"):
        load(tmp_path / "a.ply")


# Everything


@pytest.mark.parametrize("suffix", [".vtu", ".msh", ".mesh"])
def test_reading_says_nothing_if_nothing_is_left_out(tmp_path, suffix, caplog):
    save(shapes.box(n=1), tmp_path / f"a{suffix}")
    with caplog.at_level(logging.WARNING, logger="anisomesh"):
        load(tmp_path / f"a{suffix}")
    assert caplog.text == ""
