"""MEDIT's text files (.mesh).

Format: Frey, "MEDIT: an interactive mesh visualization software", INRIA RT-0253, and the names of libMeshb.
"""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh.io.cells import Shape, SurfaceCells
from anisomesh.io.formats.words import format_rows, whole
from anisomesh.io.polygons import PolygonSoup

# Shape and number of nodes; corners come first, then in cells of second order the nodes of the sides and the middle.
_SURFACES: dict[bytes, tuple[Shape, int]] = {
    b"Triangles": ("triangle", 3),
    b"TrianglesP2": ("triangle", 6),
    b"TrianglesP3": ("triangle", 10),
    b"TrianglesP4": ("triangle", 15),
    b"Quadrilaterals": ("quad", 4),
    b"QuadrilateralsQ2": ("quad", 9),
    b"QuadrilateralsQ3": ("quad", 16),
    b"QuadrilateralsQ4": ("quad", 25),
}
_SECOND_ORDER = (6, 9)
_VOLUMES = (b"Tetrahedra", b"Hexahedra", b"Prisms", b"Pyramids")


def read_medit(data: bytes) -> PolygonSoup:
    """Read the vertices, triangles and quadrilaterals of all sections of a MEDIT .mesh text file."""
    tokens = re.sub(rb"#[^\n]*", b"", data).split()
    if not tokens or not tokens[0].startswith(b"MeshVersionFormatted"):
        raise ValueError("it does not begin with MeshVersionFormatted as a MEDIT text file does")
    words = [k for k, token in enumerate(tokens) if token[:1].isalpha() and token.lower() not in (b"nan", b"inf")]
    dimension, points, cells = 3, [np.zeros((0, 3))], SurfaceCells()
    for k, end in zip(words, [*words[1:], len(tokens)], strict=True):
        name, body = tokens[k], tokens[k + 1 : end]
        if name == b"Dimension" and body:
            dimension = int(body[0])
            if dimension not in (2, 3):
                raise ValueError(f"its dimension is {dimension}; expected 2 or 3")
        elif name == b"Vertices":
            rows = _rows(name, body, dimension)
            points.append(np.pad(rows, ((0, 0), (0, 3 - dimension))))
        elif name in _SURFACES:
            shape, width = _SURFACES[name]
            nodes = whole(_rows(name, body, width)) - 1
            cells.add(shape, nodes, nodes_on_sides=width in _SECOND_ORDER)
        elif name.endswith(b"Ordering") and name.removesuffix(b"Ordering") in _SURFACES:
            raise ValueError(f"its nodes have an order of their own ({name.decode()}); save it in the standard order")
        elif name.startswith(_VOLUMES):
            cells.ignore(name.decode(errors="replace"))
    remarks = () if b"End" in tokens[-1:] else ("it has no End after its sections; check that none is missing",)
    return cells.soup(np.concatenate(points), remarks)


def medit_text(points: Points, faces: Faces) -> str:
    """Return the content of a MEDIT .mesh text file, version 2 (float64)."""
    vertices = f"Vertices\n{len(points)}\n" + format_rows("%r %r %r 0\n", points)
    triangles = f"Triangles\n{len(faces)}\n" + format_rows("%d %d %d 0\n", faces + 1)
    return f"MeshVersionFormatted 2\nDimension 3\n{vertices}{triangles}End\n"


def _rows(section: bytes, body: list[bytes], width: int) -> npt.NDArray[np.float64]:
    """Return the rows (n, width) of a section, without the reference number at the end of each row."""
    name = section.decode()
    if not body or not body[0].isdigit():
        raise ValueError(f"truncated: the section {name} has no count")
    count = int(body[0])
    if len(body) - 1 < count * (width + 1):
        raise ValueError(f"truncated: {name} declares {count} rows of {width + 1} but {len(body) - 1} numbers follow")
    try:
        rows = np.array(list(map(float, body[1 : 1 + count * (width + 1)])), dtype=np.float64)
    except ValueError as error:
        raise ValueError(f"malformed: the section {name} should give numbers: {error}") from None
    return rows.reshape(count, width + 1)[:, :width]
