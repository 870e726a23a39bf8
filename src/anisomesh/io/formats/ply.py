"""The PLY format (Turk 1994): ascii or binary of either byte order, polygons, arbitrary extra properties."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh.io.cells import SurfaceCells, strip_triangles
from anisomesh.io.polygons import Integers, PolygonSoup

_NUMPY_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("int64", "longlong"), "i8"),
    **dict.fromkeys(("uint64", "ulonglong"), "u8"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_BYTE_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_INDEX_PROPERTIES = ("vertex_indices", "vertex_index")  # both are in use for the corners of a face
_RESTART = -1  # ends a strip in a list of strips


@dataclass(frozen=True)
class _Property:
    name: str
    type: str
    count_type: str | None = None


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: tuple[_Property, ...]


class _PropertyValues(NamedTuple):
    """The values of a property in all rows, concatenated, and how many each row has."""

    values: npt.NDArray[np.float64] | Integers
    sizes: Integers


def read_ply(data: bytes) -> PolygonSoup:
    """Read the points, polygons and strips of triangles of a PLY file; ValueError if it is malformed or truncated."""
    order, elements, start = _header(data)
    if not any(element.name == "vertex" for element in elements):
        raise ValueError("the header declares no vertex element")
    body = _TextBody(data[start:].split()) if order == "" else _BinaryBody(data, start, order)
    points, cells = np.zeros((0, 3)), SurfaceCells()
    for element in elements:
        scalars = [prop.name for prop in element.properties if not prop.count_type]
        lists = [prop.name for prop in element.properties if prop.count_type]
        if element.name == "vertex":
            if not {"x", "y", "z"} <= set(scalars):
                names = scalars + lists
                raise ValueError(f"the vertex element has properties {names}; expected scalars with x, y and z")
            columns = body.read(element, "xyz")
            points = np.stack([columns[name].values.astype(np.float64) for name in "xyz"], axis=1)
        elif element.name in ("face", "tristrips"):
            index = next((name for name in _INDEX_PROPERTIES if name in lists), None)
            if index is None and element.count:
                raise ValueError(f"the {element.name} element has the lists {lists}; expected {_INDEX_PROPERTIES[0]}")
            columns = body.read(element, (index,) if index else ())
            if index:
                _add(cells, element.name, columns[index])
        else:
            body.read(element, ())
    return cells.soup(points)


def _add(cells: SurfaceCells, name: str, corners: _PropertyValues) -> None:
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


def ply_bytes(points: Points, faces: Faces, scalars: Mapping[str, npt.NDArray[np.float64]]) -> bytes:
    """Return the content of a binary little-endian PLY file with float64 coordinates and scalars (V,) per point."""
    names = ["x", "y", "z", *("_".join(name.split()) for name in scalars)]
    if len(set(names)) < len(names):
        raise ValueError(f"the point data {', '.join(scalars)} need names that differ from each other and from x, y, z")
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    header += [f"property double {name}" for name in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    columns = np.column_stack([points, *scalars.values()]).astype("<f8")
    rows = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"] = 3
    rows["corners"] = faces
    return "\n".join(header).encode() + columns.tobytes() + rows.tobytes()


def _header(data: bytes) -> tuple[str, list[_Element], int]:
    """Return the byte order, the elements and the position of the body."""
    if data[:4].rstrip() != b"ply":
        raise ValueError("it does not begin with the line ply")
    stop = data.find(b"end_header")
    newline = data.find(b"\n", stop)
    if stop < 0 or newline < 0:
        raise ValueError("truncated: the header has no end_header line")
    order: str | None = None
    elements: list[_Element] = []
    for line in data[:stop].decode("ascii", errors="replace").splitlines()[1:]:
        match line.split():
            case ["format", name, *_]:
                order = _BYTE_ORDERS.get(name)
            case ["element", name, count] if count.isdigit():
                elements.append(_Element(name, int(count), ()))
            case ["property", "list", count_type, kind, name] if elements and {count_type, kind} <= _NUMPY_TYPES.keys():
                prop = _Property(name, _NUMPY_TYPES[kind], _NUMPY_TYPES[count_type])
                elements[-1] = _with_property(elements[-1], prop)
            case ["property", kind, name] if elements and kind in _NUMPY_TYPES:
                elements[-1] = _with_property(elements[-1], _Property(name, _NUMPY_TYPES[kind]))
            case [] | ["comment" | "obj_info", *_]:
                pass
            case _:
                raise ValueError(f"the header line {line[:60]!r} is malformed; expected element or property")
    if order is None:
        raise ValueError(f"the header names no known format; expected one of {', '.join(_BYTE_ORDERS)}")
    return order, elements, newline + 1


def _with_property(element: _Element, prop: _Property) -> _Element:
    if any(known.name == prop.name for known in element.properties):
        raise ValueError(f"the header declares the property {prop.name} of {element.name} twice")
    return _Element(element.name, element.count, (*element.properties, prop))


def _truncated(element: _Element) -> ValueError:
    return ValueError(f"truncated: the header declares {element.count} x {element.name} and the data ends before")


class _TextBody:
    """The body of an ascii file, read as a stream of words."""

    def __init__(self, words: list[bytes]) -> None:
        self.words = words
        self.position = 0

    def read(self, element: _Element, wanted: Iterable[str]) -> dict[str, _PropertyValues]:
        """Read an element; return the properties with these names."""
        if not any(prop.count_type for prop in element.properties):
            return self._table(element, wanted)
        places: dict[str, tuple[list[int], list[int]]] = {name: ([], []) for name in wanted}
        at, limit = self.position, len(self.words)
        for _ in range(element.count):
            for prop in element.properties:
                if at >= limit:
                    raise _truncated(element)
                size = int(self.words[at]) if prop.count_type else 1
                if size < 0:
                    raise ValueError(f"element {element.name}: a list of {size} values")
                at += bool(prop.count_type)
                if prop.name in places:
                    places[prop.name][0].append(at)
                    places[prop.name][1].append(size)
                at += size
        if at > limit:
            raise _truncated(element)
        self.position = at
        kinds = {prop.name: prop.type for prop in element.properties}
        return {name: self._column(kinds[name], *found) for name, found in places.items()}

    def _column(self, kind: str, starts: list[int], sizes: list[int]) -> _PropertyValues:
        words = self.words
        flat = [word for start, size in zip(starts, sizes, strict=True) for word in words[start : start + size]]
        values: npt.NDArray[np.float64] | Integers
        if kind.startswith("f"):
            values = np.array([float(word) for word in flat], dtype=np.float64)
        else:
            values = np.array([int(word) for word in flat], dtype=np.int64)
        return _PropertyValues(values, np.array(sizes, dtype=np.int64))

    def _table(self, element: _Element, wanted: Iterable[str]) -> dict[str, _PropertyValues]:
        """Read an element of scalars."""
        width = len(element.properties)
        count = element.count * width
        if self.position + count > len(self.words):
            raise _truncated(element)
        self.position += count
        try:
            words = self.words[self.position - count : self.position]
            table = np.array(list(map(float, words)), dtype=np.float64).reshape(element.count, width)
        except ValueError as error:
            raise ValueError(f"element {element.name}: {error}") from None
        names = [prop.name for prop in element.properties]
        ones = np.ones(element.count, dtype=np.int64) if width else np.zeros(0, dtype=np.int64)
        return {name: _PropertyValues(table[:, names.index(name)], ones) for name in wanted}


class _BinaryBody:
    """The body of a binary file, read from ``start`` on."""

    def __init__(self, data: bytes, start: int, order: str) -> None:
        self.data = data
        self.position = start
        self.order = order

    def read(self, element: _Element, wanted: Iterable[str]) -> dict[str, _PropertyValues]:
        """Read an element; return the properties with these names."""
        if not element.properties:
            return {}
        columns = self._equal_rows(element, wanted)
        return self._any_rows(element, wanted) if columns is None else columns

    def _equal_rows(self, element: _Element, wanted: Iterable[str]) -> dict[str, _PropertyValues] | None:
        """Read all rows as one array if their lists have the sizes of the first row's; else return None."""
        fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
        sizes, at = {}, self.position
        for prop in element.properties:
            size = 1
            if prop.count_type:
                if element.count:
                    size, at = self._list_size(prop.count_type, at, element)
                sizes[prop.name] = size
                fields.append((f"count {prop.name}", self.order + prop.count_type))
            fields.append((f"value {prop.name}", self.order + prop.type, (size,)))
            at += size * np.dtype(prop.type).itemsize
        dtype = np.dtype(fields)
        if self.position + element.count * dtype.itemsize > len(self.data):
            if sizes:
                return None
            raise _truncated(element)
        rows = np.frombuffer(self.data, dtype=dtype, count=element.count, offset=self.position)
        if any((rows[f"count {name}"] != size).any() for name, size in sizes.items()):
            return None
        self.position += rows.nbytes
        columns = {}
        for name in wanted:
            lengths = np.full(element.count, sizes.get(name, 1), dtype=np.int64)
            columns[name] = _PropertyValues(_native(rows[f"value {name}"].ravel()), lengths)
        return columns

    def _any_rows(self, element: _Element, wanted: Iterable[str]) -> dict[str, _PropertyValues]:
        """Read row by row."""
        chunks: dict[str, tuple[list[bytes], list[int]]] = {name: ([], []) for name in wanted}
        at = self.position
        for _ in range(element.count):
            for prop in element.properties:
                size = 1
                if prop.count_type:
                    size, at = self._list_size(prop.count_type, at, element)
                width = size * np.dtype(prop.type).itemsize
                if prop.name in chunks:
                    chunks[prop.name][0].append(self.data[at : at + width])
                    chunks[prop.name][1].append(size)
                at += width
            if at > len(self.data):
                raise _truncated(element)
        self.position = at
        kinds = {prop.name: self.order + prop.type for prop in element.properties}
        return {
            name: _PropertyValues(
                _native(np.frombuffer(b"".join(found), dtype=kinds[name])), np.array(lengths, dtype=np.int64)
            )
            for name, (found, lengths) in chunks.items()
        }

    def _list_size(self, kind: str, at: int, element: _Element) -> tuple[int, int]:
        """Return the size of the list at a position and the position of its first value."""
        dtype = np.dtype(self.order + kind)
        if at + dtype.itemsize > len(self.data):
            raise _truncated(element)
        count = int(np.frombuffer(self.data, dtype=dtype, count=1, offset=at)[0])
        if count < 0:
            raise ValueError(f"element {element.name}: a list of {count} values")
        return count, at + dtype.itemsize


def _native(values: npt.NDArray[Any]) -> npt.NDArray[np.float64] | Integers:
    return values.astype(np.float64) if values.dtype.kind == "f" else values.astype(np.int64)
