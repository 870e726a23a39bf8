"""Gmsh's mesh files (MSH), versions 2, 4.0 and 4.1, text and binary.

Format: https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format.
"""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Carried
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
from anisomesh.io.formats.gmsh.numbers import NumberStream
from anisomesh.io.formats.words import whole
from anisomesh.io.polygons import Integers, PolygonSoup


def read_msh(data: bytes) -> PolygonSoup:
    """Read the triangles and quadrilaterals of any order of a Gmsh file, their groups and entities, and data.

    Notes
    -----
    Points are in the order of the file, whatever their tags. Parameters of nodes are skipped. Lines are features, and
    points in physical groups are fixed points.
    """
    version, numbers = _header(data)
    _check_ends(data)
    is_2, carried = version.startswith("2"), Carried()
    name = b"ParametricNodes" if is_2 and b"$ParametricNodes" in data else b"Nodes"
    nodes, section = numbers.of(_section(data, name)), numbers.of(_section(data, b"Elements"))
    if is_2:
        tags, points = _nodes_2(nodes, parametric=name != b"Nodes")
    else:
        tags, points = _nodes_4(nodes, interleaved=version == "4.0")
    table = TagTable(tags)
    elements = Elements(table)
    if not is_2:
        entities = read_entities(data, numbers, carried, is_40=version == "4.0")
        elements_4(section, elements, entities, is_40=version == "4.0")
    elif section.binary:
        elements_2_binary(section, elements)
    else:
        elements_2_text(section, elements)
    named = read_comments(data, carried)
    cell_numbers = elements.carry(carried, named, read_unlabelled(data))
    read_physical_names(data, carried)
    read_data(data, numbers, carried, (tags, cell_numbers))
    for each, values in carried.cell_data.items():
        carried.note_marks(each, values)
    name_regions(carried, named, elements.surface)
    of_surface = cell_numbers[elements.surface]
    at_nodes = read_data_at_corners(data, numbers, carried, of_surface, elements.node_places)
    return elements.soup(points, carried, at_nodes)


def _header(data: bytes) -> tuple[str, NumberStream]:
    """Return the version, 2, 2.2, 4.0 or 4.1, and a stream of numbers of the type of the file."""
    head = re.match(rb"\s*\$MeshFormat\s+(\S+)\s+(\S+)\s+(\S+)[^\n]*\n", data)
    if head is None:
        raise ValueError("it does not begin with $MeshFormat as a Gmsh file does")
    version, file_type, size = (word.decode(errors="replace") for word in head.groups())
    version = "4.0" if version == "4" else version
    if not (version.startswith("2") or version in ("4.0", "4.1")):
        raise ValueError(f"its version is {version[:10]}; expected 2.2, 4.0 or 4.1; save it with -format msh41")
    if file_type not in ("0", "1") or size not in ("4", "8"):
        raise ValueError(f"its header reads {file_type[:10]} {size[:10]}; expected file type 0 or 1, data size 8 or 4")
    order = ">" if data[head.end() : head.end() + 4] == (1).to_bytes(4, "big") else "<"
    return version, NumberStream(b"", binary=file_type == "1", order=order, size_bytes=int(size))


def _check_ends(data: bytes) -> None:
    """Raise ValueError if a section begins that does not end: nothing behind it would be read."""
    section, at = re.compile(rb"^\$(\w+)", re.MULTILINE), 0
    while (found := section.search(data, at)) is not None:
        name = found[1]
        end = data.find(b"$End" + name, found.end())
        if end < 0:
            text = name.decode(errors="replace")
            raise ValueError(f"truncated: its ${text} has no $End{text}")
        at = end + len(b"$End" + name)


def _section(data: bytes, name: bytes) -> bytes:
    """Return the content of a section, without its first and last line."""
    first = data.find(b"$" + name)
    begin = data.find(b"\n", first) + 1
    end = data.find(b"$End" + name, begin)
    if first < 0 or begin == 0 or end < begin:
        raise ValueError(f"truncated: it has no ${name.decode()} with an $End{name.decode()}")
    return data[begin:end]


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
    table = np.array([list(map(float, row)) for row in rows], dtype=np.float64).reshape(count, 4)
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
