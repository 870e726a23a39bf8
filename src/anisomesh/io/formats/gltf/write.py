"""Writing of binary glTF 2.0 (GLB), in float32."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.carried import Integers
from anisomesh.io.formats.gltf.attributes import Encoded, encoded
from anisomesh.io.formats.gltf.document import BINARY_CHUNK, COMPONENTS, JSON_CHUNK, WIDTHS
from anisomesh.io.formats.gltf.materials import write_materials
from anisomesh.io.formats.gltf.read import MATERIAL, NO_MATERIAL, NODE, TRIANGLES
from anisomesh.io.formats.region_names import region_texts
from anisomesh.io.holding import Losses, by_label, distinct_corners, main_division
from anisomesh.io.objects.trimesh_scenes import TRIMESH, materials_as_gltf

_ALIGNMENT = 4  # bytes
_ELEMENT_ARRAY, _ARRAY = 34963, 34962  # targets of views
_TYPE_OF = {kind: code for code, kind in COMPONENTS.items()}
_SHAPE_OF = {width: name for name, width in WIDTHS.items()}


class _Vertices(NamedTuple):
    """The vertices of a primitive: their points, a corner that each is at, and triangles."""

    points: Integers
    corners: Integers
    triangles: Integers


class _Attribute(NamedTuple):
    """An attribute of all points, or of all corners of faces."""

    data: Encoded
    at_corners: bool


def glb_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return the content of a binary glTF file.

    Notes
    -----
    A division becomes nodes, the one called ``material`` becomes primitives with materials. Points are repeated where
    corner data differ, and between primitives. Regions keep their names, not their numbers.
    """
    if float(np.abs(mesh.surface.points).max()) > float(np.finfo(np.float32).max):
        raise ValueError("coordinates beyond 3.4e38 do not fit the float32 of GLB; use PLY instead")
    nodes, materials = _divisions(mesh, losses)
    losses.add("face data", *mesh.face_data)
    theirs = mesh.materials.get(TRIMESH)
    held = ("gltf", TRIMESH) if isinstance(theirs, Mapping) else ("gltf",)
    losses.add("materials", *(name for name in mesh.materials if name not in held))
    losses.features(mesh)
    writer, attributes = _Writer(), _attributes(mesh, losses)
    given = mesh.materials.get("gltf")
    if given is None and isinstance(theirs, Mapping):
        given = materials_as_gltf(theirs)
    given = given if isinstance(given, dict) else {}
    labels = [np.zeros(mesh.surface.n_faces, dtype=np.int64) if d is None else d.labels for d in (nodes, materials)]
    numbers, names = _material_numbers(materials, given, losses)
    primitives: dict[int, list[dict[str, Any]]] = {}
    for (node, material), chosen in by_label(*labels):
        primitive = _primitive(mesh, np.sort(chosen), writer, attributes)
        if material in numbers:
            primitive["material"] = numbers[material]
        primitives.setdefault(node, []).append(primitive)
    texts = {} if nodes is None else region_texts(nodes, losses)
    for node, parts in primitives.items():
        writer.add_node(parts, texts.get(node, ""))
    if given:
        write_materials(given, writer.document, writer.binary)
    elif names:
        writer.document["materials"] = [{"name": name} for name in names]
    return writer.content()


def _divisions(mesh: Mesh, losses: Losses) -> tuple[Regions | None, Regions | None]:
    """Return the divisions into nodes and into materials."""
    others = {name: regions for name, regions in mesh.regions.items() if name != MATERIAL}
    found = main_division(others, NODE)
    losses.add("regions", *(name for name in others if found is None or name != found[0]))
    return None if found is None else found[1], mesh.regions.get(MATERIAL)


def _material_numbers(
    materials: Regions | None, given: dict[str, Any], losses: Losses
) -> tuple[dict[int, int], list[str]]:
    """Return the number of the material of each label, and the names of new materials; -1 without a name is none.

    With ``given`` materials the labels are their numbers.
    """
    if materials is None:
        return {}, []
    labels = np.unique(materials.labels).tolist()
    if len(labels) > 1 and NO_MATERIAL not in materials.names:
        labels = [label for label in labels if label != NO_MATERIAL]
    if given:
        numbers = {label: label for label in labels if 0 <= label < len(given.get("materials", []))}
        if len(numbers) < len(labels):
            losses.add("regions", MATERIAL)
        return numbers, []
    texts = region_texts(materials, losses)
    return {label: k for k, label in enumerate(labels)}, [texts[label] for label in labels]


def _primitive(mesh: Mesh, chosen: Integers, writer: _Writer, attributes: list[_Attribute]) -> dict[str, Any]:
    """Return a primitive of some faces."""
    vertices = _vertices(mesh, chosen)
    numbers = {}
    for part in attributes:
        rows = part.data.rows[vertices.corners if part.at_corners else vertices.points]
        numbers[part.data.name] = writer.add_rows(part.data._replace(rows=rows))
    corners = Encoded("", vertices.triangles.astype("<u4").reshape(-1, 1), False)
    return {"attributes": numbers, "indices": writer.add_rows(corners, _ELEMENT_ARRAY), "mode": TRIANGLES}


def _vertices(mesh: Mesh, chosen: Integers) -> _Vertices:
    """Return the vertices of some faces: a point for each different row of corner data."""
    faces = mesh.surface.faces.astype(np.int64)
    if len(chosen) == len(faces) and not mesh.corner_data:
        corners = np.zeros(mesh.surface.n_points, dtype=np.int64)
        corners[faces.ravel()] = np.arange(faces.size)
        return _Vertices(np.arange(mesh.surface.n_points), corners, faces)
    corners, numbers = distinct_corners(mesh, chosen)
    return _Vertices(faces.ravel()[corners], corners, numbers)


def _attributes(mesh: Mesh, losses: Losses) -> list[_Attribute]:
    """Return the positions and the other attributes of points and of corners."""
    found = [_Attribute(Encoded("POSITION", mesh.surface.points.astype(np.float32), False), at_corners=False)]
    corner_data = {name: values.reshape(-1, *values.shape[2:]) for name, values in mesh.corner_data.items()}
    for what, data in (("point data", mesh.point_data), ("corner data", corner_data)):
        for name, values in data.items():
            attribute = encoded(name, values) if values.size else None
            if attribute is None or any(attribute.name == other.data.name for other in found):
                losses.add(what, name)
            else:
                found.append(_Attribute(attribute, at_corners=what == "corner data"))
    return found


class _Writer:
    """A document that grows by nodes, and the content of its views."""

    def __init__(self) -> None:
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "anisomesh"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            "nodes": [],
            "meshes": [],
            "accessors": [],
        }
        self.binary: list[bytes] = []
        self._views: dict[int, dict[str, int]] = {}

    def add_node(self, primitives: list[dict[str, Any]], name: str) -> None:
        """Add a node with a mesh."""
        number = len(self.document["nodes"])
        self.document["scenes"][0]["nodes"].append(number)
        self.document["nodes"].append({"mesh": number, **({"name": name} if name else {})})
        self.document["meshes"].append({"primitives": primitives, **({"name": name} if name else {})})

    def add_rows(self, part: Encoded, target: int = _ARRAY) -> int:
        """Add an array (n, k) and return the number of its accessor."""
        rows = part.rows.astype(part.rows.dtype.newbyteorder("<"))
        size = rows.dtype.itemsize * rows.shape[1]
        stride = size if target == _ELEMENT_ARRAY else size + -size % _ALIGNMENT
        padded = np.zeros((len(rows), stride), dtype=np.uint8)
        padded[:, :size] = np.ascontiguousarray(rows).view(np.uint8).reshape(len(rows), size)
        view = {"target": target, **({"byteStride": stride} if stride != size else {})}
        self._views[len(self.binary)] = view
        accessor: dict[str, Any] = {
            "bufferView": len(self.binary),
            "componentType": _TYPE_OF[rows.dtype.str[1:]],
            "count": len(rows),
            "type": _SHAPE_OF[rows.shape[1]],
        }
        if part.normalised:
            accessor["normalized"] = True
        if part.name == "POSITION":
            accessor |= {key: getattr(rows, key)(axis=0).astype(float).tolist() for key in ("min", "max")}
        self.binary.append(padded.tobytes())
        self.document["accessors"].append(accessor)
        return len(self.document["accessors"]) - 1

    def content(self) -> bytes:
        """Return the content of the file."""
        views, at = [], 0
        for k, data in enumerate(self.binary):
            views.append({"buffer": 0, "byteOffset": at, "byteLength": len(data), **self._views.get(k, {})})
            at += len(data) + -len(data) % _ALIGNMENT
        binary = b"".join(data + b"\0" * (-len(data) % _ALIGNMENT) for data in self.binary)
        document = {**self.document, "bufferViews": views, "buffers": [{"byteLength": len(binary)}]}
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % _ALIGNMENT)
        size = 12 + 8 + len(text) + 8 + len(binary)
        head = b"glTF" + (2).to_bytes(4, "little") + size.to_bytes(4, "little")
        return b"".join([head, _chunk(JSON_CHUNK, text), _chunk(BINARY_CHUNK, binary)])


def _chunk(kind: bytes, data: bytes) -> bytes:
    return len(data).to_bytes(4, "little") + kind + data
