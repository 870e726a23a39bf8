"""Text in files of older programs: names in Latin-1, any ends of lines, names with words of the format, UTF-16."""

import codecs

import numpy as np
import pytest

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.errors import MeshFileError
from anisomesh.io.formats.words import text_of
from anisomesh.io.meshes import load_mesh, save
from anisomesh.shapes import analytic as shapes

BOX = shapes.box(1)
LABELS = np.arange(BOX.n_faces) % 2 + 1
FIRST, SECOND = "grüne Stütze", "naïve pièce"
OF_TEXT = {".obj": "group", ".off": None, ".ply": "group", ".stl": "solid", ".mesh": "reference"}
POINTS = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
FACET = "facet normal 0 0 1\nouter loop\nvertex {0} 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n"


def mesh_with_names():
    return Mesh(surface=BOX, regions={"group": Regions(LABELS, {1: FIRST, 2: SECOND})})


def as_ascii_ply(path):
    """Write a file of text by hand, since ours are binary."""
    names = "".join(f"comment regions part {k} {text}\n" for k, text in ((1, FIRST), (2, SECOND)))
    head = f"ply\nformat ascii 1.0\n{names}element vertex {BOX.n_points}\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz")
    head += f"element face {BOX.n_faces}\nproperty list uchar int vertex_indices\nproperty int part\nend_header\n"
    rows = "".join("{!r} {!r} {!r}\n".format(*p) for p in BOX.points.tolist())
    rows += "".join("3 {} {} {} {}\n".format(*f, k) for f, k in zip(BOX.faces.tolist(), LABELS, strict=True))
    path.write_text(head + rows, encoding="utf-8")


def written(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    if suffix == ".ply":
        as_ascii_ply(path)
    else:
        save(mesh_with_names(), path)
    return path


def assert_equal(one, other):
    np.testing.assert_array_equal(one.surface.points, other.surface.points)
    np.testing.assert_array_equal(one.surface.faces, other.surface.faces)
    assert one.regions.keys() == other.regions.keys()
    for name, regions in one.regions.items():
        np.testing.assert_array_equal(regions.labels, other.regions[name].labels)
        assert regions.names == other.regions[name].names


@pytest.mark.parametrize("end", [b"\r", b"\r\n"])
@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply", ".stl", ".mesh"])
def test_lines_may_have_any_end(tmp_path, suffix, end):
    path = written(tmp_path, suffix)
    expected = load_mesh(path)
    path.write_bytes(path.read_bytes().replace(b"\n", end))
    assert_equal(expected, load_mesh(path))


@pytest.mark.parametrize("end", ["\r", "\r\n"])
@pytest.mark.parametrize("name", ["a.msh", "a.mesh", "a.obj"])
def test_comments_and_continued_lines_end_with_any_line(tmp_path, name, end):
    texts = {
        "a.msh": "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n"
        '$PhysicalNames\n1\n2 5 "top"\n$EndPhysicalNames\n$Elements\n1\n1 2 2 5 1 1 2 3\n$EndElements\n',
        "a.mesh": "MeshVersionFormatted 2\n# a comment\nDimension 3\nVertices\n3\n0 0 0 0\n1 0 0 0\n0 1 0 0\n"
        "Triangles\n1\n1 2 3 5\nEnd\n",
        "a.obj": f"# a comment\n{POINTS}g top\nf 1 2 \\\n3\n",
    }
    (tmp_path / name).write_bytes(texts[name].encode())
    expected = load_mesh(tmp_path / name)
    assert len(expected.regions) == 1
    (tmp_path / name).write_bytes(texts[name].replace("\n", end).encode())
    assert_equal(expected, load_mesh(tmp_path / name))


@pytest.mark.parametrize("end", [b"\r", b"\r\n", b"\n"])
def test_a_binary_ply_file_may_have_any_ends_of_lines_in_its_header(tmp_path, end):
    surface = shapes.box(1)
    points = surface.points.astype("<f4")
    points[0, 0] = np.frombuffer(b"\n\0\x80\x3f", "<f4")[0]  # the first byte of the body is a line feed
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += f"element face {surface.n_faces}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = np.zeros(surface.n_faces, dtype=[("n", "u1"), ("f", "<i4", 3)])
    rows["n"], rows["f"] = 3, surface.faces
    (tmp_path / "a.ply").write_bytes(head.encode().replace(b"\n", end) + points.tobytes() + rows.tobytes())
    np.testing.assert_array_equal(load_mesh(tmp_path / "a.ply").surface.points, points)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".msh"])
def test_names_in_latin_1_are_the_ones_in_utf_8(tmp_path, suffix):
    path = written(tmp_path, suffix)
    expected = load_mesh(path)
    assert [set(regions.names.values()) for regions in expected.regions.values()] == [{FIRST, SECOND}]
    content = path.read_bytes()
    for name in (FIRST, SECOND):
        assert name.encode() in content
        content = content.replace(name.encode(), name.encode("latin-1"))
    path.write_bytes(content)
    assert_equal(expected, load_mesh(path))


def test_strings_and_names_in_vtk_files_may_be_in_latin_1(tmp_path):
    """Regression: they lost letters, unlike names in other formats."""

    def array(kind, name, values, width=1):
        numbers = " ".join(map(str, values))
        given = f'type="{kind}" Name="{name}" NumberOfComponents="{width}" format="ascii"'
        return f"<DataArray {given}>{numbers}</DataArray>" if kind != "String" else f"<Array {given}>{numbers}</Array>"

    names = f"1 {FIRST}\n2 {SECOND}".encode("latin-1")
    strings = b"".join(name.encode("latin-1") + b"\0" for name in (FIRST, SECOND))
    content = (
        '<VTKFile type="PolyData" version="1.0"><PolyData>'
        f"<FieldData>{array('UInt8', 'regions of part', names)}</FieldData>"
        '<Piece NumberOfPoints="4" NumberOfPolys="2">'
        f"<Points>{array('Float64', 'Points', [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0], 3)}</Points>"
        f"<CellData>{array('Int32', 'part', [1, 2])}{array('String', 'maker', strings)}</CellData>"
        f"<Polys>{array('Int64', 'connectivity', [0, 1, 2, 0, 2, 3])}{array('Int64', 'offsets', [3, 6])}</Polys>"
        "</Piece></PolyData></VTKFile>"
    )
    (tmp_path / "a.vtp").write_text(content)
    mesh = load_mesh(tmp_path / "a.vtp")
    assert mesh.face_data["maker"].tolist() == [FIRST, SECOND]
    assert mesh.regions["part"].names == {1: FIRST, 2: SECOND}


def test_material_files_in_latin_1_describe_the_materials_of_the_mesh_and_are_written_in_utf_8(tmp_path, caplog):
    (tmp_path / "grün.mtl").write_bytes("newmtl grün\r\nKd 1 0 0\r\n".encode("latin-1"))
    (tmp_path / "a.obj").write_bytes(f"mtllib grün.mtl\n{POINTS}usemtl grün\nf 1 2 3\n".encode("latin-1"))
    mesh = load_mesh(tmp_path / "a.obj")
    assert mesh.materials["obj"]["text"].splitlines() == ["newmtl grün", "Kd 1 0 0"]
    save(mesh, tmp_path / "b.glb")
    assert load_mesh(tmp_path / "b.glb").regions["material"].names == {0: "grün"}
    (tmp_path / "elsewhere").mkdir()
    save(mesh, tmp_path / "elsewhere" / "b.obj")
    assert "newmtl grün" in (tmp_path / "elsewhere" / "b.mtl").read_text(encoding="utf-8")
    assert caplog.text == ""


def test_a_line_break_of_unicode_does_not_break_a_line_of_a_header(tmp_path):
    as_ascii_ply(tmp_path / "a.ply")
    expected = load_mesh(tmp_path / "a.ply")
    content = (tmp_path / "a.ply").read_bytes()
    for comment in ("one\u2028two".encode(), b"more\x85"):
        (tmp_path / "a.ply").write_bytes(content.replace(b"1.0\n", b"1.0\ncomment " + comment + b"\n", 1))
        assert_equal(expected, load_mesh(tmp_path / "a.ply"))


def test_text_is_in_utf_8_or_latin_1():
    assert text_of("größe".encode()) == text_of("größe".encode("latin-1")) == "größe"
    assert text_of(bytes(range(256))) == bytes(range(256)).decode("latin-1")


@pytest.mark.parametrize(
    "name", ["a", "facet normal", "endfacet vertex 1 2 3", "vertex 1 2 3 endsolid", "my solid part"]
)
def test_the_name_of_a_solid_may_have_any_words(tmp_path, name):
    text = f"solid {name}\n{FACET.format(0)}endsolid {name}\nsolid b\n{FACET.format(2)}endsolid b\n"
    (tmp_path / "a.stl").write_text(text)
    mesh = load_mesh(tmp_path / "a.stl")
    assert mesh.surface.n_faces == 2
    assert mesh.regions["solid"].labels.tolist() == [1, 2]
    assert mesh.regions["solid"].names == {1: name, 2: "b"}


@pytest.mark.parametrize("blank", [" ", "\t", "\r", "  "])
@pytest.mark.parametrize("name", ["a", "two words", ""])
def test_any_white_space_may_separate_the_words_of_a_text_stl_file(tmp_path, name, blank):
    text = f"solid {name}\n{FACET.format(0)}{FACET.format(3)}endsolid {name}\nsolid b\n{FACET.format(2)}endsolid b\n"
    (tmp_path / "a.stl").write_text(text.replace("\n", blank))
    mesh = load_mesh(tmp_path / "a.stl")
    assert mesh.surface.n_faces == 3
    assert mesh.regions["solid"].labels.tolist() == [1, 1, 2]
    assert mesh.regions["solid"].names == {**({1: name} if name else {}), 2: "b"}


@pytest.mark.parametrize("begin", [" ", "\t", "  "])
@pytest.mark.parametrize("outer", [" ", "\n", "\n  "])
@pytest.mark.parametrize("name", ["a", "two words", ""])
def test_the_first_facet_may_be_on_the_line_of_its_solid(tmp_path, name, begin, outer):
    """Regression: such a file was refused as truncated if the corners were on further lines."""
    first, second = (FACET.format(k).replace("\nouter", f"{outer}outer") for k in (0, 2))
    text = f"solid {name}{begin}{first}{FACET.format(3)}endsolid {name}\nsolid b{begin}{second}endsolid b\n"
    (tmp_path / "a.stl").write_text(text)
    mesh = load_mesh(tmp_path / "a.stl")
    assert mesh.regions["solid"].labels.tolist() == [1, 1, 2]
    assert mesh.regions["solid"].names == {**({1: name} if name else {}), 2: "b"}


@pytest.mark.parametrize("end", ["\n", "\t"])
@pytest.mark.parametrize("name", ["a", "two words", ""])
def test_a_solid_may_begin_on_the_line_on_which_another_ends(tmp_path, name, end):
    """Regression: the second solid became part of the first one unless the whole file was on one line."""
    text = f"solid {name}\n{FACET.format(0).strip()}{end}endsolid {name} solid my b\n{FACET.format(2)}endsolid my b\n"
    (tmp_path / "a.stl").write_text(text)
    mesh = load_mesh(tmp_path / "a.stl")
    assert mesh.regions["solid"].labels.tolist() == [1, 2]
    assert mesh.regions["solid"].names == {**({1: name} if name else {}), 2: "my b"}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("endsolid", "end_solid"),
        ("My EndSolid x", "My End_Solid x"),
        ("my solid part", "my solid part"),
        ("facet normal 1 2 3 outer rim", "facet_normal 1 2 3 outer rim"),
        ("outer facet normal", "outer facet normal"),
    ],
)
def test_names_of_solids_are_written_so_that_others_read_the_file(tmp_path, caplog, name, text):
    """Regression: trimesh refused a file with a solid called endsolid."""
    save(Mesh(surface=BOX, regions={"solid": Regions(LABELS, {1: name, 2: "b"})}), tmp_path / "a.stl")
    assert ("some characters of 1 name(s)" in caplog.text) == (name != text)
    mesh = load_mesh(tmp_path / "a.stl")
    assert mesh.regions["solid"].names == {1: text, 2: "b"}
    assert np.bincount(mesh.regions["solid"].labels).tolist() == [0, BOX.n_faces // 2, BOX.n_faces // 2]
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.load_scene(tmp_path / "a.stl")
    assert {each: len(part.faces) for each, part in scene.geometry.items()} == {
        text: BOX.n_faces // 2,
        "b": BOX.n_faces // 2,
    }


def test_a_text_stl_file_on_one_line_that_is_cut_off_is_refused(tmp_path):
    text = f"solid a\n{FACET.format(0)}{FACET.format(3)}endsolid a\n".replace("\n", " ")
    for k in range(30, len(text.removesuffix("endfacet endsolid a ")), 3):
        if text[:k].rstrip().endswith("endfacet"):
            continue  # only the end of the solid is missing, which a line says
        (tmp_path / "a.stl").write_text(text[:k])
        with pytest.raises(MeshFileError, match="truncated"):
            load_mesh(tmp_path / "a.stl")


MISTAKEN = {  # suffix: content and what the message says
    ".obj": (b"ply\nformat ascii 1.0\n", "it seems to be a PLY file; give it the extension .ply"),
    ".stl": (b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + b" " * 90, "it seems to be a Gmsh file"),
    ".off": (f"# old\n{POINTS}f 1 2 3\n".encode("utf-16"), "it seems to be text in UTF-16; save it in UTF-8"),
    ".ply": (b"OFF\n3 1 0\n", "it seems to be an OFF file"),
    ".msh": (b"MeshVersionFormatted 2\n", "it seems to be a MEDIT file"),
    ".mesh": (b"solid a\nfacet normal 0 0 1\n", "it seems to be a text STL file"),
    ".glb": (b"PK\x03\x04", "it seems to be a 3MF file or another archive"),
    ".vtu": (b"# vtk DataFile Version 3.0\n", "it seems to be a legacy VTK file"),
    ".3mf": (b'<?xml version="1.0"?>\n<VTKFile type="PolyData">', "it seems to be a VTK file"),
    ".meshb": (b"<!DOCTYPE html><html>", "it seems to be a web page"),
}


@pytest.mark.parametrize("suffix", MISTAKEN)
def test_a_file_with_the_extension_of_another_format_is_recognised(tmp_path, suffix):
    content, message = MISTAKEN[suffix]
    (tmp_path / f"a{suffix}").write_bytes(content)
    with pytest.raises(MeshFileError, match=message):
        load_mesh(tmp_path / f"a{suffix}")


ONE_LINE = f"solid a {FACET.format(0)}endsolid a".replace("\n", " ").encode()
BINARY = b"solid of 1 triangle".ljust(80) + (1).to_bytes(4, "little") + bytes(50)
MEDIT_BINARY = np.array([1, 2, 3, 20, 3, 54, 0], dtype="<i4").tobytes()
ALSO_MISTAKEN = [
    (".obj", ONE_LINE, "a text STL file"),
    (".off", ONE_LINE, "a text STL file"),
    (".ply", BINARY, "a binary STL file; give it the extension .stl"),
    (".obj", BINARY, "a binary STL file"),
    (".off", f"# old\n\n{POINTS}f 1 2 3\n".encode(), "an OBJ file; give it the extension .obj"),
    (".ply", b"mtllib a.mtl\r\no part\r\n", "an OBJ file"),
    (".msh", b"v -1.5 0 0\n", "an OBJ file"),
    (".stl", b"# old\nOFF\n3 1 0\n", "an OFF file"),
    (".obj", b"OFF3 1 0\n0 0 0\n", "an OFF file"),
    (".ply", b"# old\nMeshVersionFormatted 2\n", "a MEDIT file"),
    (".msh", MEDIT_BINARY, "a MEDIT file"),
    (".stl", codecs.BOM_UTF16_LE + ONE_LINE.decode().encode("utf-16-le"), "text in UTF-16"),
    (".stl", codecs.BOM_UTF16_BE + ONE_LINE.decode().encode("utf-16-be"), "text in UTF-16"),
]


@pytest.mark.parametrize(("suffix", "content", "message"), ALSO_MISTAKEN)
def test_other_formats_are_recognised_in_each_of_their_forms(tmp_path, suffix, content, message):
    """Regression: STL on one line and OBJ in files of other extensions, and text STL in UTF-16, were not."""
    (tmp_path / f"a{suffix}").write_bytes(content)
    with pytest.raises(MeshFileError, match=f"it seems to be {message}"):
        load_mesh(tmp_path / f"a{suffix}")


@pytest.mark.parametrize("mark", [b"\x1a", b"\x1a\r\n", b"\0\0\0", b"\n\x1a\0\n"])
@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply", ".stl", ".mesh", ".msh"])
def test_marks_of_the_end_of_a_file_are_not_content(tmp_path, caplog, suffix, mark):
    """Regression: a line was said to be left out behind the faces."""
    path = written(tmp_path, suffix)
    caplog.clear()
    expected = load_mesh(path)
    path.write_bytes(path.read_bytes() + mark)
    assert_equal(expected, load_mesh(path))
    assert caplog.text == ""


def test_text_in_utf_16_is_recognised_in_both_byte_orders(tmp_path):
    """Regression: of STL the message was about the size of a binary file."""
    texts = {"a.obj": f"{POINTS}f 1 2 3\n", "a.stl": f"solid\n{FACET.format(0)}endsolid\n"}
    for mark, order in ((codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be")):
        for name, text in texts.items():
            (tmp_path / name).write_bytes(mark + text.encode(order))
            with pytest.raises(MeshFileError, match="text in UTF-16"):
                load_mesh(tmp_path / name)


PLY = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
PLY += "property list uchar int vertex_indices\nend_header\n"
MEDIT = "MeshVersionFormatted 2\nDimension 3\nVertices\n3\n"
MSH = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
WRONG = {  # name: content and what the message says
    "word.ply": (PLY + "0 0 0\n1 0 0\n0 1 0\ncomment 3 0 1 2\n", "element face: 'comment' is not the size of a list"),
    "corner.ply": (PLY + "0 0 0\n1 0 0\n0 1 0\n3 0 1 two\n", "element face: 'two' is not an integer"),
    "number.ply": (PLY + "0 0 0\n1 zero 0\n0 1 0\n3 0 1 2\n", "element vertex: 'zero' is not a number"),
    "comma.obj": ("v 0,5 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "line 1 should give three coordinates: 'v 0,5 0 0'"),
    "corner.obj": (POINTS + "f 1 2 c\n", "line 4 should give integers: '1 2 c'"),
    "cut.obj": (POINTS + "f\n", "line 4 is cut off: 'f'"),
    "counts.off": ("OFF\nmany few 0\n", "the line of counts reads 'many few 0'"),
    "number.off": ("OFF\n3 1 0\n0 0 0\n1 0 x\n0 1 0\n3 0 1 2\n", "line 4 should give three coordinates: '1 0 x'"),
    "double.mesh": (MEDIT + "0 0 0 0\n1.0D+00 0 0 0\n0 1 0 0\n", "'1.0D\\+00' is not a number"),
    "comma.stl": (f"solid a\n{FACET.format('0,5')}endsolid\n", "'0,5' is not a number"),
    "node.msh": (
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 a 0\n$EndNodes\n$Elements\n0\n$EndElements\n",
        "'a' is",
    ),
    "header.msh": ("$MeshFormat\n2.2\n$EndMeshFormat\n", "its header reads '2.2"),
}


@pytest.mark.parametrize("name", WRONG)
def test_messages_show_what_a_file_says_and_not_what_python_says(tmp_path, name):
    content, message = WRONG[name]
    (tmp_path / name).write_text(content)
    with pytest.raises(MeshFileError, match=message) as caught:
        load_mesh(tmp_path / name)
    for of_python in ("b'", "invalid literal", "could not convert", "base 10"):
        assert of_python not in str(caught.value)
