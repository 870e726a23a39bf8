"""Binary MEDIT files (.meshb, .solb), written here by the published layout and by meshio."""

import struct

import meshio
import numpy as np
import pytest

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.errors import MeshFileError
from anisomesh.io.fields.load import load_field
from anisomesh.io.fields.save import save_tensors
from anisomesh.io.meshes import load_mesh, save
from anisomesh.mesh.surface import Surface

POINTS = [[0, 0, 0], [1, 0, 0], [1, 1, 0.25], [0, 1, 0]]
VERSIONS = [1, 2, 3, 4]


class File:
    """Writes a file section by section."""

    def __init__(self, version, order, dimension=3):
        self.order, self.integer = order, "q" if version == 4 else "i"
        self.real, self.position = "f" if version == 1 else "d", "i" if version < 3 else "q"
        self.data = self.packed("ii", 1, version)
        self.add(3, self.packed("i", dimension))

    def packed(self, kinds, *values):
        return struct.pack(self.order + kinds, *values)

    def add(self, code, body):
        after = len(self.data) + 4 + struct.calcsize(self.order + self.position) + len(body)
        self.data += self.packed("i" + self.position, code, 0 if code == 54 else after) + body

    def rows(self, code, rows, reals=0):
        body = self.packed(self.integer, len(rows))
        for row in rows:
            body += self.packed(self.real * reals + self.integer * (len(row) - reals), *row)
        self.add(code, body)

    def solution(self, types, rows):
        body = self.packed(self.integer, len(rows)) + self.packed(f"{1 + len(types)}i", len(types), *types)
        self.add(62, body + b"".join(self.packed(f"{len(row)}{self.real}", *row) for row in rows))

    def end(self, path):
        self.add(54, b"")
        path.write_bytes(self.data)
        return path


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("version", VERSIONS)
def test_every_version_and_byte_order_reads_as_the_text_does(tmp_path, version, order):
    text = (
        "MeshVersionFormatted 2 Dimension 3 Vertices 4 0 0 0 0 1 0 0 3 1 1 .25 0 0 1 0 0 Triangles 2 1 2 3 5 1 3 4 6 "
        "Edges 2 1 2 0 2 3 7 Ridges 1 1 Corners 1 1 RequiredVertices 1 2 Normals 1 0 0 1 NormalAtVertices 1 2 1 "
        "Tetrahedra 1 1 2 3 4 0 Tangents 1 1 0 0 End"
    )
    (tmp_path / "a.mesh").write_text(text)
    file = File(version, order)
    file.rows(4, [[*point, reference] for point, reference in zip(POINTS, [0, 3, 0, 0], strict=True)], reals=3)
    file.rows(6, [[1, 2, 3, 5], [1, 3, 4, 6]])
    file.rows(5, [[1, 2, 0], [2, 3, 7]])
    for code, rows in ((14, [[1]]), (13, [[1]]), (15, [[2]]), (20, [[2, 1]]), (8, [[1, 2, 3, 4, 0]])):
        file.rows(code, rows)
    file.rows(60, [[0, 0, 1]], reals=3)
    file.rows(59, [[1, 0, 0]], reals=3)
    expected, read = load_mesh(tmp_path / "a.mesh"), load_mesh(file.end(tmp_path / "a.meshb"))
    np.testing.assert_array_equal(read.surface.points, expected.surface.points)
    np.testing.assert_array_equal(read.surface.faces, expected.surface.faces)
    np.testing.assert_array_equal(read.features, [[0, 1], [1, 2]])
    np.testing.assert_array_equal(read.fixed_points, [0, 1])
    np.testing.assert_array_equal(read.point_data["normal"], expected.point_data["normal"])
    for kind in ("regions", "feature_regions", "fixed_point_regions"):
        found = getattr(read, kind)["reference"].labels
        np.testing.assert_array_equal(found, getattr(expected, kind)["reference"].labels)


def test_files_of_meshio_are_read_and_ours_by_it(tmp_path):
    faces, quads = np.array([[0, 1, 2]]), np.array([[0, 2, 3, 1]])
    for number, kind in ((3, np.int32), (4, np.int64)):
        cells = [("triangle", faces.astype(kind)), ("quad", quads.astype(kind))]
        labels = {"medit:ref": [np.array([5], dtype=kind), np.array([6], dtype=kind)]}
        meshio.Mesh(np.array(POINTS), cells, {}, labels).write(tmp_path / "a.meshb")
        assert (tmp_path / "a.meshb").read_bytes()[4] == number
        read = load_mesh(tmp_path / "a.meshb")
        np.testing.assert_array_equal(read.surface.points, POINTS)
        assert read.regions["reference"].labels.tolist() == [5, 6, 6]
    for labels in ([5, 6], [5, 2**40]):  # which need versions 2 and 4
        surface = Surface(np.array(POINTS), np.array([[0, 1, 2], [0, 2, 3]]))
        given = Mesh(surface=surface, regions={"reference": Regions(labels)}, features=[[0, 1]])
        save(given, tmp_path / "b.meshb")
        again = meshio.read(tmp_path / "b.meshb")
        np.testing.assert_array_equal(again.points, POINTS)
        np.testing.assert_array_equal(again.cells_dict["triangle"], surface.faces)
        assert again.cell_data_dict["medit:ref"]["triangle"].tolist() == labels
        read = load_mesh(tmp_path / "b.meshb")
        assert read.regions["reference"].labels.tolist() == labels
        assert read.features.tolist() == [[0, 1]]


def test_files_in_the_plane_and_of_single_precision(tmp_path):
    file = File(2, "<", dimension=2)
    file.add(155, file.packed("i", 32))
    file.real = "f"
    file.rows(4, [[0, 0, 0], [1, 0, 0], [0, 0.5, 0]], reals=2)
    file.rows(6, [[1, 2, 3, 0]])
    assert load_mesh(file.end(tmp_path / "a.meshb")).surface.area == 0.25


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("version", VERSIONS)
def test_solutions_of_every_version(tmp_path, version, order):
    file = File(version, order)
    rows = np.arange(20.0).reshape(2, 10) / 4
    file.solution([1, 3, 2], rows)
    path = file.end(tmp_path / "a.solb")
    np.testing.assert_array_equal(load_field(f"{path}:1").values, rows[:, 0])
    np.testing.assert_array_equal(load_field(f"{path}:3", kinds=("vector",)).values, rows[:, 7:])
    found = load_field(f"{path}:2")
    assert found.layout == "m11 m12 m22 m13 m23 m33"
    for row, tensor in zip(rows[:, 1:7], found.values, strict=True):
        np.testing.assert_array_equal(tensor, row[[[0, 1, 3], [1, 2, 4], [3, 4, 5]]])


def test_tensors_come_back_exactly_and_as_in_text(tmp_path):
    surface = Surface(np.array(POINTS), np.array([[0, 1, 2], [0, 2, 3]]))
    tensors = np.random.default_rng(0).normal(size=(4, 3, 3))
    tensors += tensors.transpose(0, 2, 1)
    for name in ("a.sol", "a.solb"):
        save_tensors(surface, tensors, tmp_path / name)
        np.testing.assert_array_equal(load_field(tmp_path / name).values, tensors)


@pytest.mark.parametrize("name", ["a.sol", "a.solb"])
def test_damaged_solutions_are_refused_in_one_line_or_read(tmp_path, name):
    rng = np.random.default_rng(0)
    surface = Surface(np.array(POINTS), np.array([[0, 1, 2], [0, 2, 3]]))
    save_tensors(surface, np.tile(np.eye(3), (4, 1, 1)), tmp_path / name)
    data, n_errors = (tmp_path / name).read_bytes(), 0
    for case in range(300):
        changed = bytearray(data)
        for place in rng.integers(len(data), size=rng.integers(1, 4)):
            changed[place] = rng.integers(256)
        (tmp_path / name).write_bytes(data[: rng.integers(len(data))] if case % 3 == 0 else bytes(changed))
        try:
            assert len(load_field(tmp_path / name).values) == 4
        except MeshFileError as error:
            n_errors += 1
            assert str(error).startswith(str(tmp_path / name))
            assert len(str(error).splitlines()) == 1
    assert n_errors > 50


def test_what_follows_the_content_of_a_solution_is_refused(tmp_path):
    file = File(2, "<")
    file.solution([1], [[0.5, 0.5], [1.0, 1.0]])  # rows of two numbers where one is declared
    with pytest.raises(MeshFileError, match=r"more than the 2 rows of 1 numbers that SolAtVertices declares"):
        load_field(file.end(tmp_path / "a.solb"))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda data: data[:4] + b"\x07" + data[5:], "its version is 7; expected 1 to 4"),
        (lambda data: data[:6], "a section should begin at byte 4 of 6"),
        (lambda data: data[:16] + b"\x05" + data[17:], "its dimension is 5"),
        (lambda data: data[:24] + struct.pack("<i", 10) + data[28:], "the section Vertices ends at byte 10"),
        (lambda data: data[:24] + struct.pack("<i", 10**6) + data[28:], "the section Vertices ends at byte 1000000"),
        (lambda data: data[:28] + struct.pack("<i", 99) + data[32:], "Vertices has 84 bytes where 2772 should follow"),
        (lambda data: data[:28] + struct.pack("<i", -9) + data[32:], "Vertices declares -9 rows"),
    ],
)
def test_bad_files_are_refused_by_name(tmp_path, change, reason):
    file = File(2, "<")
    file.rows(4, [[*point, 0] for point in POINTS[:3]], reals=3)
    file.rows(6, [[1, 2, 3, 0]])
    path = file.end(tmp_path / "a.meshb")
    assert load_mesh(path).surface.n_faces == 1
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(MeshFileError, match=f"cannot be read as MESHB: .*{reason}"):
        load_mesh(path)


def test_nodes_in_an_order_of_their_own_are_refused(tmp_path):
    file = File(3, "<")
    file.rows(4, [[*point, 0] for point in POINTS], reals=3)
    file.rows(129, [[1, 2, 3]] * 6)
    with pytest.raises(MeshFileError, match=r"order of their own \(TrianglesP2Ordering\)"):
        load_mesh(file.end(tmp_path / "a.meshb"))


def test_other_sections_and_a_missing_end_are_named(tmp_path, caplog):
    file = File(2, "<")
    file.rows(4, [[*point, 0] for point in POINTS], reals=3)
    file.rows(6, [[1, 2, 3, 0]])
    file.rows(59, [[1, 0, 0]], reals=3)
    file.add(777, b"abcd")
    (tmp_path / "a.meshb").write_bytes(file.data)
    load_mesh(tmp_path / "a.meshb")
    said = [record.getMessage().partition(": ")[2] for record in caplog.records]
    assert said == [
        "it has no End after its sections; check that none is missing",
        "left out its sections Tangents, of number 777",
    ]
