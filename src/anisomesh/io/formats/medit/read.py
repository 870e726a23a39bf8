"""MEDIT's mesh files, text (.mesh) and binary (.meshb)."""

from __future__ import annotations

import numpy as np

from anisomesh.io.carried import NORMAL, Array, Carried, Integers, listed
from anisomesh.io.cells import Shape, SurfaceCells
from anisomesh.io.formats.medit.sections import SPACE, Section, marks, read_sections, table
from anisomesh.io.formats.words import whole
from anisomesh.io.polygons import PolygonSoup

REFERENCE = "reference"
"""Name of the references of triangles, edges and fixed points as divisions, and of vertices as point data."""

# Shape and number of nodes; corners come first, then in cells of second order the nodes of the sides and the middle.
_SURFACES: dict[str, tuple[Shape, int]] = {
    "Triangles": ("triangle", 3),
    "TrianglesP2": ("triangle", 6),
    "TrianglesP3": ("triangle", 10),
    "TrianglesP4": ("triangle", 15),
    "Quadrilaterals": ("quad", 4),
    "QuadrilateralsQ2": ("quad", 9),
    "QuadrilateralsQ3": ("quad", 16),
    "QuadrilateralsQ4": ("quad", 25),
}
_SECOND_ORDER = (6, 9)
_VOLUMES = ("Tetrahedra", "Hexahedra", "Prisms", "Pyramids")
_MARKED_EDGES, _MARKED_POINTS = ("Ridges", "RequiredEdges"), ("Corners", "RequiredVertices")
_MARKED_FACES = {"RequiredTriangles": "Triangles", "RequiredQuadrilaterals": "Quadrilaterals"}
_USED = ("Vertices", "Edges", "Normals", "NormalAtVertices", *_MARKED_EDGES, *_MARKED_POINTS)
_WITHOUT_CONTENT = ("End", "MeshVersionFormatted", "Geometry", "AngleOfCornerBound", "BoundingBox")


def read_medit(data: bytes) -> PolygonSoup:
    """Read the vertices, triangles and quadrilaterals of all sections of a MEDIT file, text or binary.

    Notes
    -----
    Ridges, required edges and edges with a reference are features; corners and required vertices are fixed points, and
    required triangles and quadrilaterals fixed faces.
    References of vertices are point data, or a division of the fixed points if no other vertices have one.
    """
    dimension, sections, ends, is_followed = read_sections(data)
    points, of_points, cells = [np.zeros((0, SPACE))], [np.zeros(0, dtype=np.int64)], SurfaceCells()
    references, others = [np.zeros(0, dtype=np.int64)], dict[str, Section]()
    numbers: dict[str, list[Integers]] = {}  # of the cells of each section
    repeated: list[str] = []
    for section in sections:
        name = section.name
        if name == "Vertices":
            coordinates, integers = table(section, dimension, 1)
            points.append(np.pad(coordinates, ((0, 0), (0, SPACE - dimension))))
            of_points.append(integers[:, 0])
        elif name in _SURFACES:
            shape, width = _SURFACES[name]
            rows = table(section, 0, width + 1).integers
            numbers.setdefault(name, []).append(sum(map(len, references)) + np.arange(len(rows)))
            cells.add(shape, whole(rows[:, :width]) - 1, nodes_on_sides=width in _SECOND_ORDER)
            references.append(rows[:, width])
        elif name.endswith("Ordering") and name.removesuffix("Ordering") in _SURFACES:
            raise ValueError(f"its nodes have an order of their own ({name}); save it in the standard order")
        elif name.startswith(_VOLUMES):
            cells.ignore(name)
        else:
            repeated += [name] if name in others and (name in _USED or name in _MARKED_FACES) else []
            others[name] = section
    required = {name: others.pop(name) for name in _MARKED_FACES if name in others}
    carried = _carried(others, np.concatenate(references), np.concatenate(of_points), dimension)
    for name, section in required.items():
        with carried.optional(f"the section {name}"):
            of_section = np.concatenate(numbers.get(_MARKED_FACES[name], [np.zeros(0, dtype=np.int64)]))
            chosen = of_section[_within(marks(section), len(of_section), _MARKED_FACES[name])]
            carried.fixed_cells = np.concatenate([carried.fixed_cells, chosen])
    if repeated:
        carried.remarks.append(f"left out all but the last of its sections {listed(list(dict.fromkeys(repeated)))}")
    for section in sections:
        if section.is_read and section.n_left:
            carried.remarks.append(f"left out what follows the rows that its section {section.name} declares")
    if is_followed:
        carried.remarks.append("left out what follows its End")
    remarks = () if ends else ("it has no End after its sections; check that none is missing",)
    return cells.soup(np.concatenate(points), remarks, carried)


def _carried(
    sections: dict[str, Section],
    of_cells: Array,
    of_points: Array,
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
        with carried.optional(f"the section {name}"):
            if name in sections:
                points = marks(sections[name])
                carried.fixed_points.add(points, np.where((points >= 0) & (points < len(of_points)), points, -1))
    with carried.optional("the references of vertices"):
        fixed = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *carried.fixed_points.blocks]))
        if len(fixed) < len(of_points) and np.isin(np.flatnonzero(of_points), fixed).all():
            carried.fixed_points.divide(REFERENCE, whole(of_points))
        elif of_points.any():
            carried.point_data[REFERENCE] = whole(of_points)
    with carried.optional("the normals"):
        if "NormalAtVertices" in sections:
            if "Normals" not in sections:
                raise ValueError("truncated: it has no section Normals")
            normals = table(sections["Normals"], dimension, 0).reals
            place = whole(table(sections["NormalAtVertices"], 0, 2).integers) - 1
            values = np.full((len(of_points), 3), np.nan)
            rows = np.pad(normals, ((0, 0), (0, SPACE - dimension)))
            values[_within(place[:, 0], len(values), "Vertices")] = rows[_within(place[:, 1], len(normals), "Normals")]
            if len(place):
                carried.point_data[NORMAL] = values
            if (missing := np.count_nonzero(np.isnan(values).all(axis=1))) and len(place):
                carried.remarks.append(f"{missing} of {len(values)} vertices have no normal and get NaN")
    unknown = [name for name in sections if name not in _USED and name not in _WITHOUT_CONTENT]
    if "Normals" in sections and "NormalAtVertices" not in sections:
        unknown.append("Normals")
    if unknown:
        carried.remarks.append(f"left out its sections {listed(unknown)}")
    return carried


def _take_edges(sections: dict[str, Section], carried: Carried) -> None:
    """Add the edges that are ridges, required or have a reference."""
    if "Edges" not in sections:
        for name in _MARKED_EDGES:
            with carried.optional(f"the section {name}"):
                _within(marks(sections[name]) if name in sections else np.zeros(0, dtype=np.int64), 0, "Edges")
        return
    rows = whole(table(sections["Edges"], 0, 3).integers)
    chosen = rows[:, 2] != 0
    for name in _MARKED_EDGES:
        with carried.optional(f"the section {name}"):
            if name in sections:
                chosen[_within(marks(sections[name]), len(rows), "Edges")] = True
    carried.lines.add(rows[chosen, :2] - 1, np.flatnonzero(chosen))
    carried.lines.divide(REFERENCE, rows[:, 2])


def _within(numbers: Integers, count: int, section: str) -> Integers:
    """Return numbers of rows of a section, from 0; ValueError if one is too large or negative."""
    outside = numbers[(numbers < 0) | (numbers >= count)]
    if len(outside):
        raise ValueError(
            f"it refers to number {outside[0] + 1} of {count} {section}" if count else f"it has no {section}"
        )
    return numbers
