"""MEDIT's text files (.mesh).

Format: Frey, "MEDIT: an interactive mesh visualization software", INRIA RT-0253, and the names of libMeshb.
"""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import NORMAL, Carried, Integers
from anisomesh.io.cells import Shape, SurfaceCells
from anisomesh.io.formats.words import whole
from anisomesh.io.polygons import PolygonSoup

REFERENCE = "reference"
"""Name of the references of triangles, edges and fixed points as divisions, and of vertices as point data."""

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
_MARKED_EDGES, _MARKED_POINTS = (b"Ridges", b"RequiredEdges"), (b"Corners", b"RequiredVertices")
_USED = (b"Vertices", b"Edges", b"Normals", b"NormalAtVertices", *_MARKED_EDGES, *_MARKED_POINTS)
_WITHOUT_CONTENT = (b"End", b"MeshVersionFormatted", b"Dimension", b"Geometry", b"AngleOfCornerBound", b"BoundingBox")


def read_medit(data: bytes) -> PolygonSoup:
    """Read the vertices, triangles and quadrilaterals of all sections of a MEDIT .mesh text file.

    Notes
    -----
    Ridges, required edges and edges with a reference are features; corners and required vertices are fixed points.
    References of vertices are point data, or a division of the fixed points if no other vertices have one.
    """
    tokens = re.sub(rb"#[^\n]*", b"", data).split()
    if not tokens or not tokens[0].startswith(b"MeshVersionFormatted"):
        raise ValueError("it does not begin with MeshVersionFormatted as a MEDIT text file does")
    words = [k for k, token in enumerate(tokens) if token[:1].isalpha() and token.lower() not in (b"nan", b"inf")]
    dimension, points, cells = 3, [np.zeros((0, 4))], SurfaceCells()
    references, others = [np.zeros(0)], {}
    for k, end in zip(words, [*words[1:], len(tokens)], strict=True):
        name, body = tokens[k], tokens[k + 1 : end]
        if name == b"Dimension" and body:
            dimension = int(body[0])
            if dimension not in (2, 3):
                raise ValueError(f"its dimension is {dimension}; expected 2 or 3")
        elif name == b"Vertices":
            rows = _rows(name, body, dimension + 1)
            points.append(np.insert(rows, [2] * (3 - dimension), 0.0, axis=1))
        elif name in _SURFACES:
            shape, width = _SURFACES[name]
            rows = _rows(name, body, width + 1)
            cells.add(shape, whole(rows[:, :width]) - 1, nodes_on_sides=width in _SECOND_ORDER)
            references.append(rows[:, width])
        elif name.endswith(b"Ordering") and name.removesuffix(b"Ordering") in _SURFACES:
            raise ValueError(f"its nodes have an order of their own ({name.decode()}); save it in the standard order")
        elif name.startswith(_VOLUMES):
            cells.ignore(name.decode(errors="replace"))
        else:
            others[name] = body
    table = np.concatenate(points)
    carried = _carried(others, np.concatenate(references), table[:, 3], dimension)
    remarks = () if b"End" in tokens[-1:] else ("it has no End after its sections; check that none is missing",)
    return cells.soup(table[:, :3], remarks, carried)


def _carried(
    sections: dict[bytes, list[bytes]],
    of_cells: npt.NDArray[np.float64],
    of_points: npt.NDArray[np.float64],
    dimension: int,
) -> Carried:
    """Return what the other sections and the references of cells and points give."""
    carried = Carried()
    with carried.optional("the references of faces"):
        if of_cells.any():
            carried.add_cell_data(REFERENCE, whole(of_cells), names={})
    with carried.optional("the edges"):
        _take_edges(sections, carried)
    for name in _MARKED_POINTS:
        with carried.optional(f"the section {name.decode()}"):
            if name in sections:
                points = whole(_rows(name, sections[name], 1))[:, 0] - 1
                carried.fixed_points.add(points, np.where((points >= 0) & (points < len(of_points)), points, -1))
    with carried.optional("the references of vertices"):
        fixed = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *carried.fixed_points.blocks]))
        if len(fixed) < len(of_points) and np.isin(np.flatnonzero(of_points), fixed).all():
            carried.fixed_points.divide(REFERENCE, whole(of_points))
        elif of_points.any():
            carried.point_data[REFERENCE] = whole(of_points)
    with carried.optional("the normals"):
        if b"NormalAtVertices" in sections:
            normals = _rows(b"Normals", sections.get(b"Normals", []), dimension)
            place = whole(_rows(b"NormalAtVertices", sections[b"NormalAtVertices"], 2)) - 1
            values = np.zeros((len(of_points), 3))
            values[_within(place[:, 0], len(values)), :dimension] = normals[_within(place[:, 1], len(normals))]
            carried.point_data[NORMAL] = values
    unknown = [name for name in sections if name not in _USED and name not in _WITHOUT_CONTENT]
    if unknown:
        carried.remarks.append("left out its sections " + b", ".join(unknown)[:200].decode(errors="replace"))
    return carried


def _take_edges(sections: dict[bytes, list[bytes]], carried: Carried) -> None:
    """Add the edges that are ridges, required or have a reference."""
    if b"Edges" not in sections:
        return
    rows = whole(_rows(b"Edges", sections[b"Edges"], 3))
    chosen = rows[:, 2] != 0
    for name in _MARKED_EDGES:
        with carried.optional(f"the section {name.decode()}"):
            if name in sections:
                chosen[_within(whole(_rows(name, sections[name], 1))[:, 0] - 1, len(rows))] = True
    carried.lines.add(rows[chosen, :2] - 1, np.flatnonzero(chosen))
    carried.lines.divide(REFERENCE, rows[:, 2])


def _within(numbers: Integers, count: int) -> Integers:
    """Return numbers from 0; ValueError if one is too large or negative."""
    outside = numbers[(numbers < 0) | (numbers >= count)]
    if len(outside):
        raise ValueError(f"it refers to number {outside[0] + 1} of {count}")
    return numbers


def _rows(section: bytes, body: list[bytes], width: int) -> npt.NDArray[np.float64]:
    """Return the rows (n, width) of a section, the reference number at the end of each row included."""
    name = section.decode(errors="replace")
    if not body or not body[0].isdigit():
        raise ValueError(f"truncated: the section {name} has no count")
    count = int(body[0])
    if len(body) - 1 < count * width:
        raise ValueError(f"truncated: {name} declares {count} rows of {width} but {len(body) - 1} numbers follow")
    try:
        rows = np.array(list(map(float, body[1 : 1 + count * width])), dtype=np.float64)
    except ValueError as error:
        raise ValueError(f"malformed: the section {name} should give numbers: {error}") from None
    return rows.reshape(count, width)
