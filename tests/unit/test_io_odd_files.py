"""Files with harmless oddities are read and the oddity is named; what looks like them but is cut off is refused."""

import logging
import struct

import numpy as np
import pytest

from anisomesh.errors import MeshFileError
from anisomesh.io.meshes import load

POINTS = np.vstack([np.zeros(3), np.eye(3)])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
ROWS = "".join("{:g} {:g} {:g}\n".format(*p) for p in POINTS)
CORNERS = "".join("3 {} {} {}\n".format(*f) for f in FACES)
OBJ = "".join(f"v {row}\n" for row in ROWS.splitlines()) + "".join("f {} {} {}\n".format(*(f + 1)) for f in FACES)
OFF = f"OFF\n4 4 0\n{ROWS}{CORNERS}"
HEAD = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
FACE = "element face 4\nproperty list uchar int vertex_indices\n"
END = "end_header\n"
RECORDS = b"".join(struct.pack("<12fH", 0, 0, 0, *POINTS[f].ravel(), 0) for f in FACES)
BINARY_STL = b"x".ljust(80) + struct.pack("<I", 4) + RECORDS
FACETS = "".join(
    "facet normal 0 0 0\nouter loop\n"
    + "".join("vertex {:g} {:g} {:g}\n".format(*p) for p in POINTS[f])
    + "endloop\nendfacet\n"
    for f in FACES
)
MEDIT = "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n" + ROWS.replace("\n", " 0\n")
MEDIT += "Triangles\n4\n" + "".join("{} {} {} 0\n".format(*(f + 1)) for f in FACES) + "End\n"
BOM = b"\xef\xbb\xbf"

READ = {  # name: content and what the log says
    "list on vertices.ply": (
        HEAD
        + "property list uchar int ring\n"
        + FACE
        + END
        + "".join(f"{row} 2 0 1\n" for row in ROWS.splitlines())
        + CORNERS,
        "",
    ),
    "lists of many sizes on vertices.ply": (
        HEAD
        + "property list uchar int ring\n"
        + FACE
        + END
        + "".join(f"{row} {k}{' 7' * k}\n" for k, row in enumerate(ROWS.splitlines()))
        + CORNERS,
        "",
    ),
    "int64.ply": (HEAD + FACE.replace("int vertex", "int64 vertex") + END + ROWS + CORNERS, ""),
    "uint64.ply": (HEAD + FACE.replace("int vertex", "uint64 vertex") + END + ROWS + CORNERS, ""),
    "binary int64.ply": (
        (HEAD + FACE.replace("int vertex", "int64 vertex") + END).replace("ascii", "binary_little_endian").encode()
        + POINTS.astype("<f4").tobytes()
        + b"".join(struct.pack("<B3q", 3, *f) for f in FACES),
        "",
    ),
    "binary list on vertices.ply": (
        (HEAD + "property list uchar short ring\n" + FACE + END).replace("ascii", "binary_big_endian").encode()
        + b"".join(struct.pack(f">3fB{k}h", *p, k, *[7] * k) for k, p in enumerate(POINTS))
        + b"".join(struct.pack(">B3i", 3, *f) for f in FACES),
        "",
    ),
    "unused nan.ply": (
        HEAD.replace("vertex 4", "vertex 5") + FACE + END + ROWS + "nan nan nan\n" + CORNERS,
        "1 point(s) that no face uses, the first of them 4",
    ),
    "unused nan.obj": (OBJ + "v nan 0 inf\n", "1 point(s) that no face uses"),
    "edge.obj": (OBJ + "f 1 2\n", "left out 1 face(s) of fewer than 3 corners; the first is face 4"),
    "edge.off": (OFF.replace("4 4 0", "4 5 0") + "2 0 1\n", "left out 1 face(s)"),
    "edge.ply": (
        HEAD + FACE.replace("face 4", "face 6") + END + ROWS + "2 0 1\n" + CORNERS + "0\n",
        "left out 2 face(s)",
    ),
    "mark.obj": (BOM + OBJ.encode(), ""),
    "mark.off": (BOM + OFF.encode(), ""),
    "mark.ply": (BOM + (HEAD + FACE + END + ROWS + CORNERS).encode(), ""),
    "mark.mesh": (BOM + MEDIT.encode(), ""),
    "mark.stl": (BOM + f"solid\n{FACETS}endsolid\n".encode(), ""),
    "counts behind the word.off": (OFF.replace("OFF\n", "OFF"), ""),
    "free form.obj": (OBJ + "surf 0 1 0 1 1 2 3 4\n", "left out 1 free-form surface(s) (surf)"),
    "trailing.stl": (BINARY_STL + b"\x01" * 20, "left out 20 byte(s) behind the 4 triangles"),
    "padded.stl": (BINARY_STL + b"\0" * 100, "left out 100 byte(s)"),
    "no end.stl": (f"solid a\n{FACETS}", "it has no endsolid after its 4 facets"),
    "no end.mesh": (MEDIT.removesuffix("End\n"), "it has no End after its sections"),
    "long name.stl": (f"solid {'n' * 5000}\n{FACETS}endsolid\n", ""),
}

CUT = {
    "cut face.obj": (OBJ.strip()[:-2], "the last line is a face of 2 corners"),
    "cut point.off": (OFF.replace("4 4 0", "4 5 0"), "truncated"),
    "cut strip.ply": (HEAD + FACE.replace("face 4", "tristrips 1") + END + ROWS + "12 0 2 1 -1 0 1", "truncated"),
    "cut list on vertices.ply": (
        HEAD + "property list uchar int ring\n" + FACE + END + ROWS.replace("\n", " 90\n"),
        "truncated",
    ),
    "more triangles than declared.stl": (BINARY_STL + RECORDS, "declares 4 triangles"),
    "cut.stl": (BINARY_STL[:-1], "declares 4 triangles"),
    "cut vertex.stl": (f"solid a\n{FACETS}"[:-30], "truncated: 4 facets are opened, 3 closed"),
    "cut behind a facet's head.stl": (f"solid a\n{FACETS}facet normal 0 0 0\n", "truncated: 5 facets are opened"),
    "cut word.stl": (f"solid a\n{FACETS}facet", "truncated: 4 facets"),
    "used nan.ply": (HEAD + FACE + END + ROWS.replace("0 1 0", "0 nan 0") + CORNERS, "point 2 .*not finite"),
    "edges only.off": ("OFF\n2 1 0\n0 0 0\n1 0 0\n2 0 1\n", "face 0 has 2 corners"),
}


def write(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize("name", READ)
def test_harmless_oddities(tmp_path, caplog, name):
    """Regression: files that other programs read were refused."""
    content, remark = READ[name]
    with caplog.at_level(logging.WARNING, logger="anisomesh"):
        surface = load(write(tmp_path, name, content))
    assert surface.n_faces == 4
    assert surface.area == pytest.approx(1.5 + 0.75**0.5)
    assert remark in caplog.text
    assert len(caplog.records) == (remark != "")


@pytest.mark.parametrize("name", CUT)
def test_files_that_are_cut_off(tmp_path, name):
    content, message = CUT[name]
    with pytest.raises(MeshFileError, match=message):
        load(write(tmp_path, name, content))
