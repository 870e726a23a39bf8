"""Reading of PLY files (Turk 1994): ascii or binary of either byte order, polygons, arbitrary extra properties."""

from __future__ import annotations

from typing import Any

import numpy as np

from anisomesh.io.carried import COLOUR, NORMAL, UV, Array, Carried, Integers, grouped_columns, is_region
from anisomesh.io.cells import SurfaceCells, strip_triangles
from anisomesh.io.formats.ply.body import BinaryBody, PropertyValues, TextBody
from anisomesh.io.formats.ply.header import EDGE_REGIONS, NAME, REGIONS, TEXTURE_FILE, Element, read_header
from anisomesh.io.formats.region_names import also_named, unquoted
from anisomesh.io.formats.words import whole, without_end_marks
from anisomesh.io.polygons import PolygonSoup

_INDEX_PROPERTIES = ("vertex_indices", "vertex_index")  # both are in use for the corners of a face
_RESTART = -1  # ends a strip in a list of strips
_KNOWN = (  # properties, and the array that they are columns of
    (("red", "green", "blue", "alpha"), COLOUR),
    (("red", "green", "blue"), COLOUR),
    (("diffuse_red", "diffuse_green", "diffuse_blue"), COLOUR),
    (("r", "g", "b"), COLOUR),
    (("nx", "ny", "nz"), NORMAL),
    (("s", "t"), UV),
    (("u", "v"), UV),
    (("texture_u", "texture_v"), UV),
    (("texture_s", "texture_t"), UV),
)
_UV_LISTS = ("texcoord", UV)  # of faces

Columns = dict[str, PropertyValues]


def read_ply(data: bytes) -> PolygonSoup:
    """Read the points, polygons and strips of triangles of a PLY file with all their properties.

    Raises
    ------
    ValueError
        If it is malformed or truncated.

    Notes
    -----
    The element ``edge`` gives features; its integers are divisions of these if a comment says so or they are called as
    divisions usually are. Lists of faces with as many values for each corner are corner data.
    """
    header = read_header(data)
    if not any(element.name == "vertex" for element in header.elements):
        raise ValueError("the header declares no vertex element")
    body = (
        TextBody(without_end_marks(data[header.start :]).split())
        if header.order == ""
        else BinaryBody(data, header.start, header.order)
    )
    points, cells, carried = np.zeros((0, 3)), SurfaceCells(), Carried()
    for element in header.elements:
        columns = body.read(element, [prop.name for prop in element.properties])
        if element.name == "vertex":
            points = _points(element, columns)
            carried.point_data |= _arrays(element, columns, carried)
        elif element.name in ("face", "tristrips"):
            corners = _corners(element, columns)
            if corners is not None:
                _add(cells, element.name, corners)
                _add_face_data(element, columns, corners, carried)
        elif element.name == "edge" and {"vertex1", "vertex2"} <= columns.keys():
            _add_edges(element, columns, header.comments, carried)
        elif element.count:
            carried.remarks.append(f"left out {element.count} x {element.name}")
    if body.left:
        carried.remarks.append(f"left out {body.left} behind the elements that its header declares")
    _take_comments(header.comments, carried)
    return cells.soup(points, carried=carried)


def _points(element: Element, columns: Columns) -> Array:
    scalars = {prop.name for prop in element.properties if not prop.count_type}
    if not {"x", "y", "z"} <= scalars:
        names = [prop.name for prop in element.properties]
        raise ValueError(f"the vertex element has properties {names}; expected scalars with x, y and z")
    return np.stack([columns.pop(name).values.astype(np.float64) for name in "xyz"], axis=1)


def _corners(element: Element, columns: Columns) -> PropertyValues | None:
    """Take the lists of corners out of the columns of faces or strips."""
    lists = [prop.name for prop in element.properties if prop.count_type]
    index = next((name for name in _INDEX_PROPERTIES if name in lists), None)
    if index is None and element.count:
        raise ValueError(f"the {element.name} element has the lists {lists}; expected {_INDEX_PROPERTIES[0]}")
    return columns.pop(index) if index else None


def _add(cells: SurfaceCells, name: str, corners: PropertyValues) -> None:
    """Add faces, or strips that are ended by -1; a strip counts as one face."""
    values = corners.values.astype(np.int64)
    if name == "face":
        cells.add_polygons(values, corners.sizes)
        return
    strips = np.split(values, np.cumsum(corners.sizes)[:-1]) if len(corners.sizes) else []
    for strip in strips:
        triangles = [strip_triangles(part[part != _RESTART]) for part in _parts(strip)]
        rows = np.concatenate(triangles)
        cells.add("triangle", rows, np.repeat(cells.take_numbers(1), len(rows)))


def _parts(strip: Integers) -> list[Integers]:
    return np.split(strip, np.flatnonzero(strip == _RESTART))


def _add_face_data(element: Element, columns: Columns, corners: PropertyValues, carried: Carried) -> None:
    """Add properties of faces: scalars and lists of equal length, or lists with values for each corner."""
    if element.name != "face":
        if columns:
            carried.remarks.append(f"left out the properties {', '.join(columns)} of {element.name}")
        return
    for name in list(columns):
        values, sizes = columns[name]
        width = int(sizes[0]) // max(int(corners.sizes[0]), 1) if len(sizes) else 0
        is_list = any(prop.name == name and prop.count_type for prop in element.properties)
        if is_list and width > 0 and (sizes == width * corners.sizes).all():
            del columns[name]
            kind = next(prop.type for prop in element.properties if prop.name == name)
            rows = values.astype(kind).reshape(-1, width)
            ours = UV if name in _UV_LISTS and width == 2 else name
            carried.corner_data[ours] = rows[:, 0] if width == 1 else rows
    for name, rows in _arrays(element, columns, carried).items():
        carried.add_cell_data(name, rows)


def _add_edges(element: Element, columns: Columns, comments: list[str], carried: Carried) -> None:
    """Add edges, and the regions that they are in."""
    ends = [columns.pop(name).values.astype(np.int64) for name in ("vertex1", "vertex2")]
    carried.lines.add(np.stack(ends, axis=1), np.arange(element.count))
    said = [words for words in (line.split(maxsplit=3) for line in comments) if words[:1] == [EDGE_REGIONS]]
    integers = {prop.name for prop in element.properties if prop.type[0] in "iu" and not prop.count_type}
    divisions = {words[1] for words in said if len(words) > 1} | {name for name in integers if is_region(name)}
    for name in [name for name in columns if name in divisions]:
        with carried.optional(f"the regions {name!r} of edges"):
            names = {int(words[2]): unquoted(words[3]) for words in said if words[1:2] == [name] and len(words) == 4}
            also_named(carried, name, names.values())
            carried.lines.divide(name, whole(columns.pop(name).values), names)
    if columns:
        carried.remarks.append(f"left out the properties {', '.join(columns)} of edges")


def _arrays(element: Element, columns: Columns, carried: Carried) -> dict[str, Array]:
    """Return scalars and lists of equal length of the properties of an element as arrays."""
    scalars: dict[str, Array] = {}
    lists: dict[str, Array] = {}
    for prop in element.properties:
        if prop.name not in columns or element.count == 0:
            continue
        values, sizes = columns[prop.name]
        if not prop.count_type:
            scalars[prop.name] = values.astype(prop.type)
        elif (sizes == sizes[0]).all() and sizes[0] > 0:
            lists[prop.name] = values.astype(prop.type).reshape(len(sizes), -1)
        else:
            carried.remarks.append(f"left out the lists {prop.name!r} of {element.name}, which differ in length")
    known: dict[str, Array] = {}
    for names, ours in _KNOWN:
        if set(names) <= scalars.keys() and ours not in known and ours not in scalars:
            known[ours] = np.stack([scalars.pop(name) for name in names], axis=1)
    return {**known, **grouped_columns(scalars), **lists}


def _take_comments(comments: list[str], carried: Carried) -> None:
    """Take the names of regions and of textures out of the comments."""
    textures = [line.split(maxsplit=1)[1] for line in comments if line.split()[:1] == [TEXTURE_FILE] and " " in line]
    if textures:
        carried.materials["texture_files"] = tuple(textures)
    for line in comments:
        words = line.split(maxsplit=3)
        if len(words) < 2 or words[0] != REGIONS:
            continue
        values = carried.cell_data.get(words[1])
        if words[1] not in carried.divisions and values is not None:
            with carried.optional(f"regions {words[1]!r}"):
                carried.add_cell_data(words[1], whole(values), names={})  # large labels are real numbers in the file
                del carried.cell_data[words[1]]
        with carried.optional("a name of regions"):
            if words[1] in carried.divisions and len(words) == 4:
                carried.divisions[words[1]].names[int(words[2])] = unquoted(words[3])
    for line in comments:
        words = line.split(maxsplit=3)
        if len(words) == 4 and words[0] == NAME:
            named: dict[str, tuple[dict[str, Any], ...]] = {
                "vertex": (carried.point_data,),
                "face": (carried.cell_data, carried.corner_data, carried.divisions),
                "edge": (carried.lines.divisions,),
            }
            for data in named.get(words[1], ()):
                _rename(data, words[2], unquoted(words[3]))


def _rename(data: dict[str, Any], name: str, other: str) -> None:
    if name in data and other not in data:
        data[other] = data.pop(name)
