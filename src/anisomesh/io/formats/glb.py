"""Binary glTF 2.0 (GLB).

Format: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html.
"""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh.io.cells import SurfaceCells, strip_triangles
from anisomesh.io.polygons import Integers, PolygonSoup

_COMPONENTS = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6  # modes of a primitive; lower ones are points and lines
_COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")
_COPIES = "EXT_mesh_gpu_instancing"
_JSON, _BINARY = b"JSON", b"BIN\0"  # kinds of chunks
_DEEPEST = 200  # of nodes in nodes
_MAX_INSTANCES = 100_000
_MAX_SPARSE = 10_000_000  # rows of an accessor that are zero but for some


def read_glb(data: bytes) -> PolygonSoup:
    """Read the triangles, strips and fans of all meshes of a binary glTF scene, moved by the nodes they hang on."""
    declared = int.from_bytes(data[8:12], "little")
    if data[:4] != b"glTF":
        raise ValueError("it does not begin with the word glTF as a GLB file does")
    if declared > len(data):
        raise ValueError(f"truncated: it declares {declared} bytes but has {len(data)}")
    chunks = _chunks(data[:declared])
    if _JSON not in chunks:
        raise ValueError("truncated: it has no chunk of JSON")
    document = json.loads(chunks[_JSON])
    used = [name for name in _COMPRESSED if name in document.get("extensionsRequired", [])]
    if used:
        raise ValueError(f"it is compressed with {used[0]}, which is not supported; save it without compression")
    scene = _Scene(document, chunks.get(_BINARY, b""))
    return scene.soup()


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


class _Scene:
    """A glTF document with its buffers, and the meshes found in it so far."""

    def __init__(self, document: dict[str, Any], binary: bytes) -> None:
        self._document = document
        self._binary = binary
        self._cells = SurfaceCells()
        self._points: list[npt.NDArray[np.float64]] = [np.zeros((0, 3))]
        self._n_points = 0
        self._n_instances = 0

    def soup(self) -> PolygonSoup:
        """Return the meshes of the scene, or all meshes if there is no scene."""
        scenes = self._document.get("scenes", [])
        if scenes:
            for node in scenes[self._document.get("scene", 0)].get("nodes", []):
                self._add_node(node, np.eye(4), 0)
        else:
            for mesh in range(len(self._document.get("meshes", []))):
                self._add_mesh(mesh, np.eye(4))
        used = _COPIES in self._document.get("extensionsUsed", [])
        remarks = (f"left out copies of its meshes that {_COPIES} makes",) if used else ()
        return self._cells.soup(np.concatenate(self._points), remarks)

    def _add_node(self, index: int, above: npt.NDArray[np.float64], depth: int) -> None:
        self._n_instances += 1
        if depth > _DEEPEST or self._n_instances > _MAX_INSTANCES:
            raise ValueError("malformed: its nodes contain each other")
        node = self._document["nodes"][_index(index)]
        matrix = above @ _matrix(node)
        if "mesh" in node:
            self._add_mesh(node["mesh"], matrix)
        for child in node.get("children", []):
            self._add_node(child, matrix, depth + 1)

    def _add_mesh(self, index: int, matrix: npt.NDArray[np.float64]) -> None:
        for primitive in self._document["meshes"][_index(index)]["primitives"]:
            mode = primitive.get("mode", _TRIANGLES)
            if mode < _TRIANGLES:
                self._cells.ignore("line or point")
                continue
            if mode > _FAN:
                raise ValueError(f"malformed: a primitive has the mode {mode}; expected 0 to 6")
            points = self._accessor(primitive["attributes"]["POSITION"])
            if points.shape[1] != 3:
                raise ValueError(f"malformed: positions have {points.shape[1]} coordinates")
            indices = np.arange(len(points))
            if "indices" in primitive:
                indices = self._accessor(primitive["indices"]).astype(np.int64).ravel()
            if len(indices) and indices.max() >= len(points):
                raise ValueError(f"a face refers to point {indices.max()} but its mesh has {len(points)} points")
            triangles = _triangles(indices, mode)
            if np.linalg.det(matrix[:3, :3]) < 0.0:
                triangles = triangles[:, ::-1]  # a reflection turns triangles inside out
            self._cells.add("triangle", triangles + self._n_points)
            self._points.append(points.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3])
            self._n_points += len(points)

    def _accessor(self, index: int) -> npt.NDArray[Any]:
        """Return the rows (n, k) of an accessor; normalised integers as numbers up to 1."""
        accessor = self._document["accessors"][_index(index)]
        kind, width = np.dtype("<" + _COMPONENTS[accessor["componentType"]]), _WIDTHS[accessor["type"]]
        count = _index(accessor["count"])
        if "bufferView" in accessor:
            rows = self._rows(accessor["bufferView"], accessor.get("byteOffset", 0), count, kind, width)
        else:
            if "sparse" not in accessor or count > _MAX_SPARSE:
                raise ValueError("malformed: an accessor has no data")
            rows = np.zeros((count, width), dtype=kind)
        if "sparse" in accessor:
            rows = rows.copy()
            sparse = accessor["sparse"]
            n, where, values = _index(sparse["count"]), sparse["indices"], sparse["values"]
            place = np.dtype("<" + _COMPONENTS[where["componentType"]])
            at = self._rows(where["bufferView"], where.get("byteOffset", 0), n, place, 1).ravel()
            rows[at] = self._rows(values["bufferView"], values.get("byteOffset", 0), n, kind, width)
        if accessor.get("normalized") and kind.kind in "iu":
            return np.maximum(rows.astype(np.float64) / np.iinfo(kind).max, -1.0)
        return rows

    def _rows(self, view: int, offset: int, count: int, kind: np.dtype[Any], width: int) -> npt.NDArray[Any]:
        found = self._document["bufferViews"][_index(view)]
        data = self._buffer(_index(found["buffer"]))
        begin = _index(found.get("byteOffset", 0))
        data = data[begin : begin + _index(found["byteLength"])]
        row = width * kind.itemsize
        stride = _index(found.get("byteStride", 0)) or row
        needed = _index(offset) + (count - 1) * stride + row if count else 0
        if needed > len(data) or stride < row:
            raise ValueError(f"truncated: an accessor needs {needed} bytes but its view has {len(data)}")
        rows: npt.NDArray[Any] = np.ndarray((count, width), kind, data, offset, (stride, kind.itemsize))
        return rows

    def _buffer(self, index: int) -> bytes:
        uri = self._document["buffers"][index].get("uri")
        if uri is None:
            return self._binary
        if not str(uri).startswith("data:"):
            raise ValueError(f"its data are in another file, {str(uri)[:40]!r}; save it as one file")
        return base64.b64decode(str(uri).partition(",")[2])


def _index(value: Any) -> int:
    """Return an index, a count or a length; ValueError if it is not a natural number."""
    if not isinstance(value, int) or value < 0:
        raise ValueError(f"malformed: {value!r} where a natural number is expected")
    return value


def _matrix(node: dict[str, Any]) -> npt.NDArray[np.float64]:
    """Return the transformation (4, 4) of a node: a matrix by columns, or scale, rotation and translation."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = map(float, node.get("rotation", (0, 0, 0, 1)))
    rotation = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix = np.eye(4)
    matrix[:3, :3] = np.array(rotation) * np.array(node.get("scale", (1, 1, 1)), dtype=np.float64)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def _triangles(indices: Integers, mode: int) -> Integers:
    """Return the triangles (n, 3) of a list, a strip or a fan."""
    if mode == _STRIP:
        return strip_triangles(indices)
    if mode == _FAN and len(indices) >= 3:
        return np.stack([np.full(len(indices) - 2, indices[0]), indices[1:-1], indices[2:]], axis=1)
    if len(indices) % 3:
        raise ValueError(f"truncated or malformed: {len(indices)} corners are not whole triangles")
    return indices.reshape(-1, 3)


def glb_bytes(points: Points, faces: Faces) -> bytes:
    """Return the content of a binary glTF file; coordinates are rounded to float32."""
    if float(np.abs(points).max()) > float(np.finfo(np.float32).max):
        raise ValueError("coordinates beyond 3.4e38 do not fit the float32 of GLB; use PLY instead")
    xyz, corners = points.astype("<f4"), faces.astype("<u4")
    views = [
        {"buffer": 0, "byteOffset": 0, "byteLength": corners.nbytes, "target": 34963},  # ELEMENT_ARRAY_BUFFER
        {"buffer": 0, "byteOffset": corners.nbytes, "byteLength": xyz.nbytes, "target": 34962},  # ARRAY_BUFFER
    ]
    low, high = (getattr(xyz, name)(axis=0).astype(float).tolist() for name in ("min", "max"))
    accessors = [
        {"bufferView": 0, "componentType": 5125, "count": corners.size, "type": "SCALAR"},
        {"bufferView": 1, "componentType": 5126, "count": len(xyz), "type": "VEC3", "min": low, "max": high},
    ]
    document = {
        "asset": {"version": "2.0", "generator": "anisomesh"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 1}, "indices": 0, "mode": _TRIANGLES}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": corners.nbytes + xyz.nbytes}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary = corners.tobytes() + xyz.tobytes()
    size = 12 + 8 + len(text) + 8 + len(binary)
    head = b"glTF" + (2).to_bytes(4, "little") + size.to_bytes(4, "little")
    return b"".join([head, _chunk(_JSON, text), _chunk(_BINARY, binary)])


def _chunk(kind: bytes, data: bytes) -> bytes:
    return len(data).to_bytes(4, "little") + kind + data
