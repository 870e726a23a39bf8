"""Data at the corners of elements in Gmsh files ($ElementNodeData)."""

import re
import struct

import meshio
import numpy as np
import pytest

from anisomesh.attributes.model import Mesh
from anisomesh.io.formats.gmsh.read import read_msh
from anisomesh.io.formats.gmsh.write import msh_bytes
from anisomesh.io.holding.losses import Losses
from anisomesh.io.meshes import load_mesh
from anisomesh.shapes.analytic import box

RNG = np.random.default_rng(0)
POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0.0], [2, 1, 0], [0.5, 0, 0], [1.5, 0.5, 0]])
CELLS = {
    "mixed": [("line", [[0, 1]]), ("triangle", [[0, 1, 2], [0, 2, 3]]), ("quad", [[1, 4, 5, 2]])],
    "triangle": [("triangle", [[0, 1, 2], [0, 2, 3]])],
}


def section(name, width, rows, *, binary, order="<"):
    """Return data of elements, given by their tags and values (k, width)."""
    head = f'$ElementNodeData\n1\n"{name}"\n1\n0.5\n3\n0\n{width}\n{len(rows)}\n'.encode()
    if binary:
        body = b"".join(struct.pack(f"{order}ii{v.size}d", tag, len(v), *v.ravel()) for tag, v in rows) + b"\n"
    else:
        body = "".join(f"{tag} {len(v)} {' '.join(map(repr, v.ravel().tolist()))}\n" for tag, v in rows).encode()
    return head + body + b"$EndElementNodeData\n"


@pytest.mark.parametrize("version", ["2.2", "4.1"])
@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("cells", CELLS)
@pytest.mark.parametrize("width", [1, 3])
def test_corner_data_of_all_versions(tmp_path, version, binary, cells, width):
    """Each corner of each triangle has the value of its own element, whatever the order of the rows."""
    blocks = [(kind, np.array(nodes)) for kind, nodes in CELLS[cells]]
    entities = {"gmsh:dim_tags": np.repeat([[1, 1], [2, 1], [2, 2]], [2, 2, 4], axis=0)} if version == "4.1" else {}
    numbers = [np.full(len(nodes), 1 + (kind == "quad")) for kind, nodes in blocks]
    mesh = meshio.Mesh(POINTS, blocks, entities, {"gmsh:physical": numbers, "gmsh:geometrical": numbers})
    meshio.gmsh.write(tmp_path / "a.msh", mesh, fmt_version=version, binary=binary)
    rows, tag = [], 0
    for kind, nodes in blocks:
        for element in nodes:
            tag += 1
            if kind != "line":
                rows.append((tag, value(tag, POINTS[element], width)))
    rows = [rows[k] for k in RNG.permutation(len(rows))]
    data = (tmp_path / "a.msh").read_bytes() + section("stress", width, rows, binary=binary)
    (tmp_path / "a.msh").write_bytes(data)
    read = load_mesh(tmp_path / "a.msh")
    given = dict(rows)
    owners = [tag for tag, v in sorted(given.items()) for _ in range(len(v) - 2)]
    found = read.corner_data["stress"].reshape(read.surface.n_faces, 3, width)
    for face, corners, owner in zip(read.surface.faces, found, owners, strict=True):
        np.testing.assert_array_equal(corners, value(owner, read.surface.points[face], width))


def value(tag, points, width):
    """Return what an element has at points (k, width)."""
    return np.stack([tag + (1 + k) * points[:, 0] + 10 * points[:, 1] for k in range(width)], axis=1)


def write_text(tmp_path, elements, data):
    nodes = "".join(f"{k + 1} {x} {y} {z}\n" for k, (x, y, z) in enumerate(POINTS))
    text = f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{len(POINTS)}\n{nodes}$EndNodes\n$Elements\n{elements}"
    (tmp_path / "a.msh").write_bytes(text.encode() + b"$EndElements\n" + data)
    return tmp_path / "a.msh"


def test_data_at_the_nodes_of_elements_of_second_order(tmp_path):
    """Elements that are split have the values of all their nodes; values of corners alone leave NaN at the others."""
    element = "1\n1 9 2 0 1 1 5 6 7 8 2\n"  # corners 1, 5, 6
    values = np.arange(6.0)[:, None] + 0.5
    read = load_mesh(write_text(tmp_path, element, section("s", 1, [(1, values)], binary=False)))
    assert read.surface.n_faces == 4
    nodes = np.array([1, 5, 6, 7, 8, 2]) - 1
    for face, corners in zip(read.surface.faces.tolist(), read.corner_data["s"].tolist(), strict=True):
        assert corners == [values[nodes.tolist().index(point), 0] for point in face]
    read = load_mesh(write_text(tmp_path, element, section("s", 1, [(1, values[:3])], binary=False)))
    at_corners = np.isin(read.surface.faces, nodes[:3])
    assert (np.isfinite(read.corner_data["s"]) == at_corners).all()


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (section("s", 1, [(7, np.ones((3, 1)))], binary=False), "'s' has no row for what is in the file"),
        (section("s", 1, [(1, np.ones((3, 1)))], binary=False).replace(b"1 3 1.0", b"1 9 1.0"), "row 1 of 1"),
        (section("s", 1, [(1, np.ones((3, 1)))], binary=False).replace(b"1 3 1.0", b"1 -1 1.0"), "row 1 of 1"),
        (section("s", 1, [(1, np.ones((3, 1)))], binary=False).replace(b"\n1\n1 3", b"\n2\n1 3"), "row 2 of 2"),
    ],
)
def test_broken_corner_data_are_left_out_with_a_reason(tmp_path, data, reason, caplog):
    read = load_mesh(write_text(tmp_path, "1\n1 2 2 0 1 1 2 3\n", data))
    assert read.is_bare
    assert "left out $ElementNodeData: " in caplog.text
    assert reason in caplog.text


def test_faces_without_a_row_have_nan(tmp_path):
    elements = "2\n1 2 2 0 1 1 2 3\n5 2 2 0 1 1 3 4\n"
    path = write_text(tmp_path, elements, section("s", 1, [(5, np.arange(3.0)[:, None])], binary=False))
    np.testing.assert_array_equal(load_mesh(path).corner_data["s"], [[np.nan] * 3, [0, 1, 2]])


def test_a_file_that_is_cut_off_in_a_section_is_refused():
    """Data behind the cut were left out without a word, or components of theirs."""
    surface = box(n=1)
    rng = np.random.default_rng(1)
    data = {"point_data": surface.n_points, "face_data": surface.n_faces, "corner_data": 3 * surface.n_faces}
    arrays = {kind: {kind: rng.random((n, 2) if kind != "corner_data" else (n // 3, 3, 2))} for kind, n in data.items()}
    content = msh_bytes(Mesh(surface=surface, **arrays), Losses())
    begins = [found.start() for found in re.finditer(rb"^\$(?!End)\w", content, re.MULTILINE)]
    ends = [found.start() for found in re.finditer(rb"^\$End\w+", content, re.MULTILINE)]
    assert len(begins) == len(ends) >= 6
    for begin, end in zip(begins[1:], ends[1:], strict=True):
        for cut in {begin + 2, (begin + end) // 2, end, end + 3}:
            with pytest.raises(ValueError, match="truncated"):
                read_msh(content[:cut])
