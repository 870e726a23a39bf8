"""Gmsh's mesh files (MSH), versions 2, 4.0 and 4.1, text and binary.

Format: https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format.
"""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Carried, listed
from anisomesh.io.formats.gmsh.data import (
    name_regions,
    read_comments,
    read_data,
    read_data_at_corners,
    read_entities,
    read_physical_names,
    read_unlabelled,
)
from anisomesh.io.formats.gmsh.elements import Elements, TagTable, elements_2_binary, elements_2_text, elements_4
from anisomesh.io.formats.gmsh.groups import each_once
from anisomesh.io.formats.gmsh.numbers import NumberStream
from anisomesh.io.formats.gmsh.sections import COMMENTS, HEADER, GmshFile
from anisomesh.io.formats.words import parsed_reals, shown, text_of, whole, with_line_feeds
from anisomesh.io.polygons import Integers, PolygonSoup

_PARAMETRIC = "ParametricNodes"
_DATA = ("NodeData", "ElementData", "ElementNodeData")
_GROUPS = ("PhysicalNames", "Entities", "PartitionedEntities")
_READ = (HEADER, COMMENTS, *_GROUPS, "Nodes", _PARAMETRIC, "Elements", *_DATA)


def read_msh(data: bytes) -> PolygonSoup:
    """Read the triangles and quadrilaterals of any order of a Gmsh file, their groups and entities, and data.

    Notes
    -----
    Points are in the order of the file, whatever their tags. Parameters of nodes are skipped. Lines are features, and
    points in physical groups are fixed points.
    """
    file = GmshFile(data if b"\n" in data else with_line_feeds(data))
    version, numbers = _header(file)
    is_2, carried = version.startswith("2"), Carried()
    name = _PARAMETRIC if is_2 and _PARAMETRIC in file.names else "Nodes"
    nodes, section = numbers.of(file.first(name)), numbers.of(file.first("Elements"))
    if is_2:
        tags, points = _nodes_2(nodes, parametric=name == _PARAMETRIC)
    else:
        tags, points = _nodes_4(nodes, interleaved=version == "4.0")
    table = TagTable(tags)
    elements, repeats = Elements(table), np.zeros((0, 2), dtype=np.int64)
    if not is_2:
        entities = read_entities(file, numbers, carried, is_40=version == "4.0")
        blocks = elements_4(section, elements, entities, is_40=version == "4.0")
    else:
        blocks, repeats = each_once((elements_2_binary if section.binary else elements_2_text)(section, elements))
    for block in blocks:
        elements.add(block)
    named = read_comments(file, carried)
    cell_numbers = elements.carry(carried, named, read_unlabelled(file))
    read_physical_names(file, carried)
    read_data(file, numbers, carried, (tags, cell_numbers), repeats)
    for each, values in carried.cell_data.items():
        carried.note_marks(each, values)
    name_regions(carried, named, elements.surface)
    of_surface = cell_numbers[elements.surface]
    at_nodes = read_data_at_corners(file, numbers, carried, (of_surface, elements.node_places), repeats)
    for what, stream in (("nodes", nodes), ("elements", section)):
        if stream.n_left:
            unit = "byte(s)" if stream.binary else "number(s)"
            carried.remarks.append(f"left out {stream.n_left} {unit} behind the {what} that it declares")
    if skipped := [other for other in dict.fromkeys(file.names) if other not in _READ and file.has_content(other)]:
        carried.remarks.append(f"left out its sections {listed(skipped)}")
    return elements.soup(points, carried, at_nodes)


def _header(file: GmshFile) -> tuple[str, NumberStream]:
    """Return the version, 2, 2.2, 4.0 or 4.1, and a stream of numbers of the type of the file."""
    content = file.first(HEADER)
    head = re.match(rb"\s*(\S+)\s+(\S+)\s+(\S+)[^\n]*\n", content)
    if head is None:
        raise ValueError(f"its header reads {shown(content)}; expected version, file type and data size")
    version, file_type, size = map(text_of, head.groups())
    version = "4.0" if version == "4" else version
    if not (version.startswith("2") or version in ("4.0", "4.1")):
        raise ValueError(f"its version is {version[:10]}; expected 2.2, 4.0 or 4.1; save it with -format msh41")
    if file_type not in ("0", "1") or size not in ("4", "8"):
        raise ValueError(f"its header reads {file_type[:10]} {size[:10]}; expected file type 0 or 1, data size 8 or 4")
    order = ">" if content[head.end() : head.end() + 4] == (1).to_bytes(4, "big") else "<"
    return version, NumberStream(b"", binary=file_type == "1", order=order, size_bytes=int(size))


def _nodes_2(numbers: NumberStream, *, parametric: bool) -> tuple[Integers, npt.NDArray[np.float64]]:
    """Return the tags (V,) and the coordinates (V, 3) of the nodes of version 2."""
    count = numbers.line_count()
    if numbers.binary:
        if parametric:
            raise ValueError("it has parametric nodes in binary version 2; save it as version 4.1")
        return numbers.records(count)
    if not parametric:
        table = numbers.take(4 * count, "<f8").reshape(count, 4)
        return whole(table[:, 0]), table[:, 1:]
    rows = [line.split()[:4] for line in numbers.lines(count)]
    if any(len(row) < 4 for row in rows):
        raise ValueError("truncated: a line of the parametric nodes has fewer than 4 numbers")
    table = parsed_reals([word for row in rows for word in row]).reshape(count, 4)
    return whole(table[:, 0]), table[:, 1:]


def _nodes_4(numbers: NumberStream, *, interleaved: bool) -> tuple[Integers, npt.NDArray[np.float64]]:
    """Return tags (V,) and coordinates (V, 3) of version 4; ``interleaved`` if each node begins with its tag."""
    n_blocks, declared = whole(numbers.take(2 if interleaved else 4, "size"))[:2].tolist()
    tags, points = [np.zeros(0, dtype=np.int64)], [np.zeros((0, 3))]
    for _ in range(n_blocks):
        first, second, parametric = whole(numbers.take(3, "<i4")).tolist()
        dimension = second if interleaved else first
        count = int(whole(numbers.take(1, "size"))[0])
        width = 3 + (min(max(dimension, 0), 2 if interleaved else 3) if parametric else 0)
        if interleaved:
            block_tags, table = numbers.records(count, width)
        else:
            block_tags = whole(numbers.take(count, "size"))
            table = numbers.take(width * count, "<f8").reshape(count, width)
        tags.append(block_tags)
        points.append(table[:, :3])
    if sum(map(len, tags)) != declared:
        raise ValueError(f"truncated or malformed: it declares {declared} nodes but has {sum(map(len, tags))}")
    return np.concatenate(tags), np.concatenate(points)
