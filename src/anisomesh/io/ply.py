"""The PLY format (Turk 1994): ascii or binary of either byte order, polygons, arbitrary extra properties."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh.io.polygons import PolygonSoup

_NUMPY_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_BYTE_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_INDEX_PROPERTIES = ("vertex_indices", "vertex_index")  # both are in use for the corners of a face


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


def read_ply(data: bytes) -> PolygonSoup:
    """Read the points and polygons of a PLY file; ValueError if it is malformed or truncated."""
    order, elements, start = _header(data)
    if not any(element.name == "vertex" for element in elements):
        raise ValueError("the header declares no vertex element")
    body = _TextBody(data[start:].split()) if order == "" else _BinaryBody(data, start, order)
    points = np.zeros((0, 3))
    corners = sizes = np.zeros(0, dtype=np.int64)
    for element in elements:
        names = [prop.name for prop in element.properties]
        lists = [prop.name for prop in element.properties if prop.count_type]
        if element.name == "vertex":
            if lists or not {"x", "y", "z"} <= set(names):
                raise ValueError(f"the vertex element has properties {names}; expected scalars with x, y and z")
            columns = body.table(element)
            points = np.stack([columns[name].astype(np.float64) for name in "xyz"], axis=1)
        elif element.name == "face" and (index := next((name for name in _INDEX_PROPERTIES if name in lists), None)):
            corners, sizes = body.lists(element, names.index(index))
        elif lists:
            body.lists(element, names.index(lists[0]))
        else:
            body.table(element)
    return PolygonSoup(points=points, corners=corners, sizes=sizes)


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

    def _take(self, count: int, element: _Element) -> npt.NDArray[np.float64]:
        if self.position + count > len(self.words):
            raise _truncated(element)
        self.position += count
        try:
            return np.array(list(map(float, self.words[self.position - count : self.position])), dtype=np.float64)
        except ValueError as error:
            raise ValueError(f"element {element.name}: {error}") from None

    def table(self, element: _Element) -> dict[str, npt.NDArray[np.float64]]:
        """Read an element of scalars; return a column (count,) for each property."""
        width = len(element.properties)
        table = self._take(element.count * width, element).reshape(element.count, width)
        return {prop.name: table[:, k] for k, prop in enumerate(element.properties)}

    def lists(self, element: _Element, wanted: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Read an element with lists; return the concatenated lists of property number ``wanted`` and their sizes."""
        starts, sizes = [], []
        at, limit = self.position, len(self.words)
        for _ in range(element.count):
            for k, prop in enumerate(element.properties):
                if at >= limit:
                    raise _truncated(element)
                size = int(self.words[at]) if prop.count_type else 1
                if size < 0:
                    raise ValueError(f"element {element.name}: a list of {size} values")
                at += bool(prop.count_type)
                if k == wanted:
                    starts.append(at)
                    sizes.append(size)
                at += size
        if at > limit:
            raise _truncated(element)
        self.position = at
        words = self.words
        flat = [int(word) for a, n in zip(starts, sizes, strict=True) for word in words[a : a + n]]
        return np.array(flat, dtype=np.int64), np.array(sizes, dtype=np.int64)


class _BinaryBody:
    """The body of a binary file, read from ``start`` on."""

    def __init__(self, data: bytes, start: int, order: str) -> None:
        self.data = data
        self.position = start
        self.order = order

    def _rows(self, dtype: np.dtype[np.void], element: _Element) -> npt.NDArray[np.void]:
        if self.position + element.count * dtype.itemsize > len(self.data):
            raise _truncated(element)
        return np.frombuffer(self.data, dtype=dtype, count=element.count, offset=self.position)

    def table(self, element: _Element) -> dict[str, npt.NDArray[np.float64]]:
        """Read an element of scalars; return a column (count,) for each property."""
        if not element.properties:
            return {}
        rows = self._rows(np.dtype([(prop.name, self.order + prop.type) for prop in element.properties]), element)
        self.position += rows.nbytes
        return {prop.name: rows[prop.name].astype(np.float64) for prop in element.properties}

    def lists(self, element: _Element, wanted: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Read an element with lists; return the concatenated lists of property number ``wanted`` and their sizes."""
        equal = self._equal_lists(element, wanted)
        return self._any_lists(element, wanted) if equal is None else equal

    def _equal_lists(
        self, element: _Element, wanted: int
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]] | None:
        """Read all rows as one array if their lists have the sizes of the first row's; else return None."""
        if element.count == 0:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
        sizes, at = {}, self.position
        for k, prop in enumerate(element.properties):
            if prop.count_type:
                sizes[k], at = self._list_size(prop.count_type, at, element)
                fields.append((f"count{k}", self.order + prop.count_type))
            fields.append((f"value{k}", self.order + prop.type, (sizes.get(k, 1),)))
            at += sizes.get(k, 1) * np.dtype(prop.type).itemsize
        dtype = np.dtype(fields)
        if self.position + element.count * dtype.itemsize > len(self.data):
            return None
        rows = self._rows(dtype, element)
        if any((rows[f"count{k}"] != size).any() for k, size in sizes.items()):
            return None
        self.position += rows.nbytes
        return rows[f"value{wanted}"].astype(np.int64).ravel(), np.full(element.count, sizes[wanted], dtype=np.int64)

    def _any_lists(self, element: _Element, wanted: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Read row by row."""
        chunks, sizes, at = [], [], self.position
        for _ in range(element.count):
            for k, prop in enumerate(element.properties):
                size = 1
                if prop.count_type:
                    size, at = self._list_size(prop.count_type, at, element)
                width = size * np.dtype(prop.type).itemsize
                if k == wanted:
                    chunks.append(self.data[at : at + width])
                    sizes.append(size)
                at += width
        if at > len(self.data):
            raise _truncated(element)
        self.position = at
        flat = np.frombuffer(b"".join(chunks), dtype=self.order + element.properties[wanted].type)
        return flat.astype(np.int64), np.array(sizes, dtype=np.int64)

    def _list_size(self, kind: str, at: int, element: _Element) -> tuple[int, int]:
        """Return the size of the list at a position and the position of its first value."""
        dtype = np.dtype(self.order + kind)
        if at + dtype.itemsize > len(self.data):
            raise _truncated(element)
        count = int(np.frombuffer(self.data, dtype=dtype, count=1, offset=at)[0])
        if count < 0:
            raise ValueError(f"element {element.name}: a list of {count} values")
        return count, at + dtype.itemsize
