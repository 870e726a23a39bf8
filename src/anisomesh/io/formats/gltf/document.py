"""The parts of a GLB file: its JSON and the arrays that this describes.

Format: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html.
"""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.io.formats.gltf.extensions import REQUIRED, check_compression, check_required, extensions

JSON_CHUNK, BINARY_CHUNK = b"JSON", b"BIN\0"

COMPONENTS = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
"""NumPy types of the components of accessors."""

WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
"""Numbers of the components of accessors."""

_MAX_ZEROS = 10_000_000  # rows of an accessor without data in the file


class Document:
    """The JSON of a file, and access to its arrays.

    ValueError if the file is not a GLB file, is truncated, or requires an extension that is not supported.
    """

    def __init__(self, data: bytes) -> None:
        declared = int.from_bytes(data[8:12], "little")
        if data[:4] != b"glTF":
            raise ValueError("it does not begin with the word glTF as a GLB file does")
        if declared > len(data):
            raise ValueError(f"truncated: it declares {declared} bytes but has {len(data)}")
        chunks = _chunks(data[:declared])
        if JSON_CHUNK not in chunks:
            raise ValueError("truncated: it has no chunk of JSON")
        self.json: dict[str, Any] = json.loads(chunks[JSON_CHUNK])
        if not isinstance(self.json, dict):
            raise ValueError("malformed: its JSON is not an object")
        self._binary = chunks.get(BINARY_CHUNK, b"")
        check_required(extensions(self.json, REQUIRED))

    def item(self, kind: str, index: Any) -> dict[str, Any]:
        """Return a node, mesh, accessor or other member of a list of the JSON; ValueError if there is none."""
        found = self.json.get(kind, [])
        if index_of(index) >= len(found):
            raise ValueError(f"malformed: it refers to number {index} (counted from 0) of its {len(found)} {kind}")
        item: dict[str, Any] = found[index]
        return item

    def numbers(self, accessor: int) -> npt.NDArray[Any]:
        """Return the rows (n, k) of an accessor; normalised integers as numbers up to 1."""
        rows, normalised = self.rows(accessor)
        return as_numbers(rows) if normalised else rows

    def rows(self, accessor: int) -> tuple[npt.NDArray[Any], bool]:
        """Return the rows (n, k) of an accessor as they are, and whether they are normalised integers."""
        found = self.item("accessors", accessor)
        if found["componentType"] not in COMPONENTS or found["type"] not in WIDTHS:
            given = f"{found['type']!r} of the component type {found['componentType']!r}"
            raise ValueError(f"an accessor has the type {given}; expected one of {', '.join(WIDTHS)}")
        kind, width = np.dtype("<" + COMPONENTS[found["componentType"]]), WIDTHS[found["type"]]
        count = index_of(found["count"])
        if "bufferView" in found:
            rows = self._rows(found["bufferView"], found.get("byteOffset", 0), count, kind, width)
        else:
            check_compression(extensions(self.json, "extensionsUsed"))  # the data are there, if this says so
            if count > _MAX_ZEROS:
                raise ValueError(f"malformed: an accessor declares {count} rows without data")
            rows = np.zeros((count, width), dtype=kind)
        if "sparse" in found:
            rows = rows.copy()
            sparse = found["sparse"]
            n, where, values = index_of(sparse["count"]), sparse["indices"], sparse["values"]
            place = np.dtype("<" + COMPONENTS[where["componentType"]])
            at = self._rows(where["bufferView"], where.get("byteOffset", 0), n, place, 1).ravel()
            if n and at.max() >= count:
                raise ValueError(f"malformed: a sparse accessor refers to row {at.max()} of its {count}")
            rows[at] = self._rows(values["bufferView"], values.get("byteOffset", 0), n, kind, width)
        return rows, bool(found.get("normalized")) and kind.kind in "iu"

    def _rows(self, view: int, offset: int, count: int, kind: np.dtype[Any], width: int) -> npt.NDArray[Any]:
        found = self.item("bufferViews", view)
        data = self.view(view)
        row = width * kind.itemsize
        stride = index_of(found.get("byteStride", 0)) or row
        needed = index_of(offset) + (count - 1) * stride + row if count else 0
        if needed > len(data) or stride < row:
            raise ValueError(f"truncated: an accessor needs {needed} bytes but its view has {len(data)}")
        rows: npt.NDArray[Any] = np.ndarray((count, width), kind, data, offset, (stride, kind.itemsize))
        return rows

    def view(self, view: int) -> bytes:
        """Return the bytes of a view of a buffer."""
        found = self.item("bufferViews", view)
        data = self._buffer(found["buffer"])
        begin = index_of(found.get("byteOffset", 0))
        return data[begin : begin + index_of(found["byteLength"])]

    def _buffer(self, index: int) -> bytes:
        uri = self.item("buffers", index).get("uri")
        if uri is None:
            return self._binary
        if not str(uri).startswith("data:"):
            raise ValueError(f"its data are in another file, {str(uri)[:40]!r}; save it as one file")
        return base64.b64decode(str(uri).partition(",")[2])


def _chunks(data: bytes) -> dict[bytes, bytes]:
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= len(data):
        size, kind = int.from_bytes(data[at : at + 4], "little"), data[at + 4 : at + 8]
        if at + 8 + size > len(data):
            raise ValueError(f"truncated: a chunk declares {size} bytes but {len(data) - at - 8} follow")
        chunks.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    return chunks


def as_numbers(rows: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    """Return normalised integers as numbers from -1 or 0 to 1."""
    return np.maximum(rows.astype(np.float64) / np.iinfo(rows.dtype).max, -1.0)


def index_of(value: Any) -> int:
    """Return an index, a count or a length; ValueError if it is not a natural number."""
    if not isinstance(value, int) or value < 0:
        raise ValueError(f"malformed: {value!r} where a natural number is expected")
    return value
