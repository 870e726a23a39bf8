"""What a file has besides what it declares, or refers to without having it, is named when it is left out."""

import numpy as np
import pytest

from anisomesh.io.meshes import load_mesh

POINTS = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
FACES = "3 0 1 2\n3 0 2 3\n"
OFF = f"OFF\n4 2 0\n{POINTS}{FACES}"
COLOURED = FACES.replace("2\n", "2 9 9 9\n").replace("3\n", "3 9 9 9\n")
PLY = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n"
PLY += "property list uchar int vertex_indices\nend_header\n"
BINARY_PLY = PLY.replace("ascii", "binary_little_endian").encode()
BINARY_PLY += np.array(POINTS.split(), dtype="<f4").tobytes()
BINARY_PLY += b"".join(b"\3" + np.array(row.split()[1:], dtype="<i4").tobytes() for row in FACES.splitlines())
MEDIT = "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n" + POINTS.replace("0\n", "0 0\n")
MEDIT += "Triangles\n2\n1 2 3 7\n1 3 4 7\n"
EDGES = "Edges\n1\n1 2 4\n"
OBJ = "".join(f"v {row}\n" for row in POINTS.splitlines())
OBJ_FACES = "f 1 2 3\nf 1 3 4\n"
END = "End\n"

LEFT_OUT = {  # name: content and what the log says
    "numbers behind points.off": (
        OFF.replace(POINTS, POINTS.replace("0\n", "0 9 9 9\n")),
        "left out 12 number(s) behind coordinates, which its first word does not declare",
    ),
    "lines behind faces.off": (OFF + "3 0 1 3\n", "left out 1 line(s) behind the 2 faces that it declares"),
    "places in a table.off": (
        OFF.replace(FACES, "3 0 1 2 7\n3 0 2 3 8\n"),
        "left out the colours of faces: they are numbers of a table of colours that the file does not have",
    ),
    "some colours.off": (
        OFF.replace(FACES, COLOURED.replace("9 9 9\n", "\n", 1)),
        "left out the colours of faces: lines of faces have 0 to 3 numbers behind their corners; expected 3 or 4",
    ),
    "five numbers.off": (
        OFF.replace(FACES, COLOURED.replace("9 9 9", "9 9 9 9 9")),
        "left out the colours of faces: lines of faces have 5 numbers behind their corners; expected 3 or 4",
    ),
    "rows behind.ply": (PLY + POINTS + FACES + "3 0 1 3\n", "left out 4 word(s) behind the elements that its header"),
    "bytes behind.ply": (BINARY_PLY + b"more", "left out 4 byte(s) behind the elements that its header declares"),
    "two numbers behind points.obj": (
        OBJ.replace("0\n", "0 9 9\n") + OBJ_FACES,
        "left out the colours of points: not every point has one: lines of points have 5 numbers",
    ),
    "late colours.obj": (
        OBJ.replace("v 0 1 0", "v 0 1 0 1 0 0") + OBJ_FACES,
        "left out the colours of points: not every point has one: lines of points have 3 to 6 numbers",
    ),
    "eight numbers.obj": (OBJ.replace("0\n", "0 1 1 1 1 9\n") + OBJ_FACES, "left out the numbers behind the colours"),
    "edge of a missing vertex.mesh": (
        MEDIT + EDGES.replace("2 4", "9 4") + END,
        "left out 1 line(s) that are not edges of its surface",
    ),
    "rows behind.mesh": (
        MEDIT + "1 2 4 7\n" + EDGES + END,
        "left out what follows the rows that its section Triangles declares",
    ),
    "two sections.mesh": (MEDIT + EDGES + EDGES + END, "left out all but the last of its sections Edges"),
    "text behind the end.mesh": (MEDIT + END + "blah blah\n", "left out what follows its End"),
    "numbers behind the end.mesh": (MEDIT + END + "1 2\n", "left out what follows its End"),
    "unknown sections.mesh": (MEDIT + "Blah Blah\n" + END, "left out its sections Blah"),
    "normals of nothing.mesh": (MEDIT + "Normals\n1\n0 0 1\n" + END, "left out its sections Normals"),
    "required point.mesh": (
        MEDIT + "RequiredVertices\n1\n9\n" + END,
        "left out 1 point(s) that no face uses as fixed points",
    ),
    "corner.mesh": (MEDIT + "Corners\n1\n9\n" + END, "left out 1 point(s) that no face uses as fixed points"),
}
LEFT_OUT |= {
    f"{name} without edges.mesh": (
        f"{MEDIT}{name}\n1\n5\n{END}",
        f"left out the section {name}: it has no Edges",
    )
    for name in ("RequiredEdges", "Ridges")
}
LEFT_OUT |= {
    f"{name} of a missing edge.mesh": (
        f"{MEDIT}{EDGES}{name}\n1\n5\n{END}",
        f"left out the section {name}: it refers to number 5 of 1",
    )
    for name in ("RequiredEdges", "Ridges")
}
LEFT_OUT |= {
    "required quadrilaterals.mesh": (
        MEDIT + "RequiredQuadrilaterals\n1\n1\n" + END,
        "left out the section RequiredQuadrilaterals: it has no Quadrilaterals",
    ),
    "required triangles.mesh": (
        MEDIT + "RequiredTriangles\n1\n3\n" + END,
        "left out the section RequiredTriangles: it refers to number 3 of 2",
    ),
}


@pytest.mark.parametrize("name", LEFT_OUT)
def test_what_is_left_out_is_named(tmp_path, caplog, name):
    content, message = LEFT_OUT[name]
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    assert load_mesh(tmp_path / name).surface.n_faces == 2
    assert [message in record.getMessage() for record in caplog.records].count(True) == 1, caplog.text


@pytest.mark.parametrize("name", ["text behind the end.mesh", "unknown sections.mesh"])
def test_what_is_left_out_of_medit_files_is_named_in_one_line(tmp_path, caplog, name):
    """Regression: a word twice gave two lines, and a file with text behind its End was said to have no End."""
    (tmp_path / name).write_text(LEFT_OUT[name][0])
    load_mesh(tmp_path / name)
    assert len(caplog.records) == 1


WHOLE = {
    "a.off": OFF,
    "colours.off": OFF.replace(FACES, COLOURED),
    "a.ply": PLY + POINTS + FACES,
    "a.binary.ply": BINARY_PLY,
    "padded.ply": BINARY_PLY + b"\n\0\0",
    "a.obj": OBJ + OBJ_FACES,
    "weights.obj": OBJ.replace("0\n", "0 1\n") + OBJ_FACES,
    "colours.obj": OBJ.replace("0\n", "0 1 .5 0\n") + OBJ_FACES,
    "a.mesh": MEDIT + EDGES + "RequiredEdges\n1\n1\n" + END,
    "no marks.mesh": MEDIT + "RequiredEdges\n0\nRidges\n0\n" + END,
}


@pytest.mark.parametrize("name", WHOLE)
def test_nothing_is_named_where_nothing_is_left_out(tmp_path, caplog, name):
    (tmp_path / name).write_bytes(WHOLE[name] if isinstance(WHOLE[name], bytes) else WHOLE[name].encode())
    assert load_mesh(tmp_path / name).surface.n_faces == 2
    assert caplog.text == ""
