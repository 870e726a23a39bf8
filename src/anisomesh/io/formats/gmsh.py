"""Gmsh's mesh files (MSH), versions 2, 4.0 and 4.1, text and binary.

Format: https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh.io.cells import N_CORNERS, Shape, SurfaceCells
from anisomesh.io.formats.gmsh_numbers import NumberStream
from anisomesh.io.formats.words import whole
from anisomesh.io.polygons import Integers, PolygonSoup

# Number of nodes by type of element; of triangles and quadrilaterals of third order and more, corners come first.
_TRIANGLES = {2: 3, 9: 6, 20: 9, 21: 10, 22: 12, 23: 15, 24: 15, 25: 21, 42: 28, 43: 36, 44: 45, 45: 55, 46: 66}
_QUADS = {3: 4, 10: 9, 16: 8, 36: 16, 37: 25, 38: 36, 39: 12, 40: 16, 41: 20, 47: 49, 48: 64, 49: 81, 50: 100, 51: 121}
_GMSH_OTHERS: dict[str, dict[int, int]] = {
    "point": {15: 1},
    "line": {1: 2, 8: 3, 26: 4, 27: 5, 28: 6, 62: 7, 63: 8, 64: 9, 65: 10, 66: 11},
    "tetra": {4: 4, 11: 10, 29: 20, 30: 35, 31: 56, 71: 84, 72: 120, 73: 165, 74: 220, 75: 286},
    "hexahedron": {5: 8, 12: 27, 17: 20, 92: 64, 93: 125, 94: 216, 95: 343, 96: 512, 97: 729, 98: 1000},
    "prism": {6: 6, 13: 18, 18: 15, 90: 40, 91: 75, 106: 126, 107: 196, 108: 288, 109: 405, 110: 550},
    "pyramid": {7: 5, 14: 14, 19: 13},
}
_GMSH_SHAPES: dict[int, Shape] = {**dict.fromkeys(_TRIANGLES, "triangle"), **dict.fromkeys(_QUADS, "quad")}
_NAMES = {kind: name for name, kinds in _GMSH_OTHERS.items() for kind in kinds}
_N_NODES = {**_TRIANGLES, **_QUADS, **{kind: n for kinds in _GMSH_OTHERS.values() for kind, n in kinds.items()}}


def read_msh(data: bytes) -> PolygonSoup:
    """Read the triangles and quadrilaterals of any order of a Gmsh file.

    Notes
    -----
    Points are in the order of the file, whatever their tags. Parameters of nodes are skipped.
    """
    version, numbers = _header(data)
    name = b"ParametricNodes" if version.startswith("2") and b"$ParametricNodes" in data else b"Nodes"
    nodes, elements = numbers.of(_section(data, name)), numbers.of(_section(data, b"Elements"))
    if version.startswith("2"):
        tags, points = _nodes_2(nodes, parametric=name != b"Nodes")
    else:
        tags, points = _nodes_4(nodes, interleaved=version == "4.0")
    table = _TagTable(tags)
    cells = SurfaceCells()
    if not version.startswith("2"):
        _elements_4(elements, table, cells, "<i4" if version == "4.0" else "size")
    elif elements.binary:
        _elements_2_binary(elements, table, cells)
    else:
        _elements_2_text(elements, table, cells)
    return cells.soup(points)


def msh_bytes(points: Points, faces: Faces) -> bytes:
    """Return the content of a binary Gmsh file of version 2.2, in float64."""
    nodes = np.zeros(len(points), dtype=[("tag", "<i4"), ("xyz", "<f8", 3)])
    nodes["tag"], nodes["xyz"] = np.arange(1, len(points) + 1), points
    elements = np.ones((len(faces), 6), dtype="<i4")  # tag, physical group, elementary entity, nodes
    elements[:, 0] = np.arange(1, len(faces) + 1)
    elements[:, 3:] = faces + 1
    block = np.array([2, len(faces), 2], dtype="<i4")  # triangles, their number, two tags each
    return b"".join(
        [
            b"$MeshFormat\n2.2 1 8\n" + (1).to_bytes(4, "little") + b"\n$EndMeshFormat\n",
            b"$Nodes\n%d\n" % len(points) + nodes.tobytes() + b"\n$EndNodes\n",
            b"$Elements\n%d\n" % len(faces) + block.tobytes() + elements.tobytes() + b"\n$EndElements\n",
        ]
    )


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


def _elements_2_text(numbers: NumberStream, table: _TagTable, cells: SurfaceCells) -> None:
    """Read elements of version 2, one a line: number, type, number of tags, tags, nodes."""
    count = numbers.line_count()
    by_type: dict[int, tuple[list[list[int]], list[int]]] = {}
    for k, line in enumerate(numbers.lines(count)):
        row = list(map(int, line.split()))
        kind = row[1] if len(row) > 2 else 0
        nodes = row[3 + row[2] :] if len(row) > 2 and row[2] >= 0 else []
        if kind in _N_NODES and len(nodes) != _N_NODES[kind]:
            raise ValueError(f"truncated or malformed: element line {k + 1} reads {line[:60]!r}")
        rows, places = by_type.setdefault(kind, ([], []))
        rows.append(nodes)
        places.append(k)
    source = cells.take_numbers(count)
    for kind, (rows, places) in by_type.items():
        _check_type(kind)
        _add(cells, kind, table, np.array(rows, dtype=np.int64), source[places])


def _elements_2_binary(numbers: NumberStream, table: _TagTable, cells: SurfaceCells) -> None:
    """Read blocks of elements of version 2: type, number, number of tags, then number, tags and nodes of each."""
    left = numbers.line_count()
    while left > 0:
        kind, count, n_tags = whole(numbers.take(3, "<i4")).tolist()
        _check_type(kind)
        if count <= 0 or n_tags < 0:
            raise ValueError(f"malformed: a block declares {count} elements with {n_tags} tags each")
        width = 1 + n_tags + _N_NODES[kind]
        rows = whole(numbers.take(count * width, "<i4")).reshape(count, width)
        _add(cells, kind, table, rows[:, 1 + n_tags :], cells.take_numbers(count))
        left -= count


def _elements_4(numbers: NumberStream, table: _TagTable, cells: SurfaceCells, tag_type: str) -> None:
    """Read blocks of elements of version 4: entity, type, number, then number and nodes of each."""
    n_blocks, declared = whole(numbers.take(4 if tag_type == "size" else 2, "size"))[:2].tolist()
    found = 0
    for _ in range(n_blocks):
        kind = int(whole(numbers.take(3, "<i4"))[2])
        count = int(whole(numbers.take(1, "size"))[0])
        _check_type(kind)
        width = 1 + _N_NODES[kind]
        rows = whole(numbers.take(count * width, tag_type)).reshape(count, width)
        _add(cells, kind, table, rows[:, 1:], cells.take_numbers(count))
        found += count
    if found != declared:
        raise ValueError(f"truncated or malformed: it declares {declared} elements but has {found}")


def _check_type(kind: int) -> None:
    if kind not in _N_NODES:
        raise ValueError(f"it has elements of type {kind}, which is not known; save it with elements of lower order")


def _add(cells: SurfaceCells, kind: int, table: _TagTable, tags: Integers, source: Integers) -> None:
    """Add elements of a type, given by the tags of their nodes (n, k)."""
    if kind in _GMSH_SHAPES:
        shape = _GMSH_SHAPES[kind]
        nodes_on_sides = _N_NODES[kind] <= 2 * N_CORNERS[shape] + 1
        cells.add(shape, table.indices(tags), source, nodes_on_sides=nodes_on_sides)
    else:
        cells.ignore(_NAMES[kind], len(tags))


class _TagTable:
    """Finds nodes by their tags."""

    def __init__(self, tags: Integers) -> None:
        self._order = np.argsort(tags, kind="stable")
        self._sorted = tags[self._order]
        twice = np.flatnonzero(self._sorted[1:] == self._sorted[:-1])
        if len(twice):
            raise ValueError(f"malformed: two nodes have the tag {self._sorted[twice[0]]}")

    def indices(self, tags: npt.NDArray[Any]) -> Integers:
        """Return the indices of the nodes with these tags, of the same shape."""
        if len(self._sorted) == 0:
            raise ValueError("it has elements but no node")
        place = np.minimum(np.searchsorted(self._sorted, tags), len(self._sorted) - 1)
        missing = self._sorted[place] != tags
        if missing.any():
            raise ValueError(f"an element refers to node {tags[missing][0]}, which is not among the nodes")
        found: Integers = self._order[place]
        return found
