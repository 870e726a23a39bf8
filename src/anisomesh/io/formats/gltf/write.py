"""Writing of binary glTF 2.0 (GLB), in float32."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.carried import UV, Integers
from anisomesh.io.formats.gltf.attributes import TEXTURE_COORDINATES, Encoded, encoded
from anisomesh.io.formats.gltf.document import BINARY_CHUNK, COMPONENTS, JSON_CHUNK, WIDTHS
from anisomesh.io.formats.gltf.extensions import LEVELS
from anisomesh.io.formats.gltf.materials import write_materials
from anisomesh.io.formats.gltf.read import MATERIAL, NO_MATERIAL, NODE, TRIANGLES
from anisomesh.io.formats.region_names import region_texts
from anisomesh.io.holding.corners import distinct_corners
from anisomesh.io.holding.divisions import by_label, main_division
from anisomesh.io.holding.losses import Losses
from anisomesh.io.holding.normals import with_all_normals
from anisomesh.io.objects.trimesh_scenes import TRIMESH, materials_as_gltf

_COVERAGE = "MSFT_screencoverage"  # least share of the screen for each level
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
    writer = _Writer()
    writer.document["scenes"][0]["nodes"] = _add_mesh(mesh, writer, losses)
    writer.add_materials(given_materials(mesh))
    return writer.content()


def glb_levels_bytes(meshes: Sequence[Mesh], losses: Losses) -> bytes:
    """Return the content of a binary glTF file with levels of detail, the finest first.

    Notes
    -----
    The finest is the only node of the scene, and names the nodes of the others, which are in no scene. Programs that do
    not know the extension show the finest. A level is meant for the screen coverage at which its vertices are as dense
    on the screen as the ones of the finest that fills it; the coarsest for any smaller one.

    References
    ----------
    Extension MSFT_lod: https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Vendor/MSFT_lod.
    """
    writer, heads = _Writer(), []
    for mesh in meshes:
        nodes = _add_mesh(mesh, writer, losses if mesh is meshes[0] else Losses())
        heads.append(nodes[0] if len(nodes) == 1 else writer.add_group(nodes))
    writer.document["scenes"][0]["nodes"] = heads[:1]
    writer.add_materials(given_materials(meshes[0]))
    if len(meshes) > 1:
        finest, counts = writer.document["nodes"][heads[0]], [mesh.surface.n_points for mesh in meshes]
        finest["extensions"] = {LEVELS: {"ids": heads[1:]}}
        finest["extras"] = {_COVERAGE: [*(count / counts[0] for count in counts[1:]), 0.0]}
        writer.document["extensionsUsed"] = [*writer.document.get("extensionsUsed", []), LEVELS]
    return writer.content()


def _add_mesh(mesh: Mesh, writer: _Writer, losses: Losses) -> list[int]:
    """Add a mesh and return the numbers of its nodes."""
    if float(np.abs(mesh.surface.points).max()) > float(np.finfo(np.float32).max):
        raise ValueError("coordinates beyond 3.4e38 do not fit the float32 of GLB; use PLY instead")
    nodes, materials = _divisions(mesh, losses)
    losses.add("face data", *mesh.face_data)
    held = ("gltf", TRIMESH) if isinstance(mesh.materials.get(TRIMESH), Mapping) else ("gltf",)
    losses.add("materials", *(name for name in mesh.materials if name not in held))
    losses.features(mesh)
    mesh = with_all_normals(mesh, losses)
    attributes = _attributes(mesh, losses)
    labels = [np.zeros(mesh.surface.n_faces, dtype=np.int64) if d is None else d.labels for d in (nodes, materials)]
    numbers = _material_numbers(materials, given_materials(mesh), writer, losses)
    primitives: dict[int, list[dict[str, Any]]] = {}
    n_filled = 0
    for (node, material), chosen in by_label(*labels):
        primitive, n_lacking = _primitive(mesh, np.sort(chosen), writer, attributes)
        n_filled += n_lacking
        if material in numbers:
            primitive["material"] = numbers[material]
        primitives.setdefault(node, []).append(primitive)
    if n_filled:
        losses.say(f"that {n_filled:,} vertices have no {UV}: they get 0")
    texts = {} if nodes is None else region_texts(nodes, losses)
    return [writer.add_node(parts, texts.get(node, "")) for node, parts in primitives.items()]


def given_materials(mesh: Mesh) -> dict[str, Any]:
    """Return the materials of a mesh as glTF has them, empty if it has none."""
    given, theirs = mesh.materials.get("gltf"), mesh.materials.get(TRIMESH)
    if given is None and isinstance(theirs, Mapping):
        given = materials_as_gltf(theirs)
    return given if isinstance(given, dict) else {}


def _divisions(mesh: Mesh, losses: Losses) -> tuple[Regions | None, Regions | None]:
    """Return the divisions into nodes and into materials."""
    others = {name: regions for name, regions in mesh.regions.items() if name != MATERIAL}
    found = main_division(others, NODE)
    losses.add("regions", *(name for name in others if found is None or name != found[0]))
    return None if found is None else found[1], mesh.regions.get(MATERIAL)


def _material_numbers(
    materials: Regions | None, given: dict[str, Any], writer: _Writer, losses: Losses
) -> dict[int, int]:
    """Return the number of the material of each label, of which new ones are named; -1 without a name is none.

    With ``given`` materials the labels are their numbers.
    """
    if materials is None:
        return {}
    labels = np.unique(materials.labels).tolist()
    if len(labels) > 1 and NO_MATERIAL not in materials.names:
        labels = [label for label in labels if label != NO_MATERIAL]
    if given:
        numbers = {label: label for label in labels if 0 <= label < len(given.get("materials", []))}
        if len(numbers) < len(labels):
            losses.add("regions", MATERIAL)
        return numbers
    texts = region_texts(materials, losses)
    return {label: writer.named_material(label, texts[label]) for label in labels}


def _primitive(
    mesh: Mesh, chosen: Integers, writer: _Writer, attributes: list[_Attribute]
) -> tuple[dict[str, Any], int]:
    """Return a primitive of some faces, and how many of its texture coordinates are 0 since they are missing.

    It has no texture coordinates where all are missing.
    """
    vertices = _vertices(mesh, chosen)
    numbers, count = {}, 0
    for part in attributes:
        rows = part.data.rows[vertices.corners if part.at_corners else vertices.points]
        if part.data.name.startswith(TEXTURE_COORDINATES):
            lacking = np.isnan(rows).any(axis=1)
            if lacking.all():
                continue
            rows[lacking] = (0.0, 1.0)  # the origin at the lower left
            count += int(np.count_nonzero(lacking))
        numbers[part.data.name] = writer.add_rows(part.data._replace(rows=rows))
    corners = Encoded("", vertices.triangles.astype("<u4").reshape(-1, 1), False)
    return {"attributes": numbers, "indices": writer.add_rows(corners, _ELEMENT_ARRAY), "mode": TRIANGLES}, count


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
            where = "points" if data is mesh.point_data else "corners"
            attribute = encoded(name, values, where) if values.size else "which are empty"
            if isinstance(attribute, str):
                losses.because(what, name, attribute)
            elif any(attribute.name == other.data.name for other in found):
                losses.because(what, name, f"whose name in glTF, {attribute.name}, is taken")
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
        self._named: dict[tuple[int, str], int] = {}
        self._views: dict[int, dict[str, int]] = {}

    def add_node(self, primitives: list[dict[str, Any]], name: str) -> int:
        """Add a node with a mesh and return its number."""
        node = {"mesh": len(self.document["meshes"]), **({"name": name} if name else {})}
        self.document["nodes"].append(node)
        self.document["meshes"].append({"primitives": primitives, **({"name": name} if name else {})})
        return len(self.document["nodes"]) - 1

    def add_group(self, nodes: list[int]) -> int:
        """Add a node with other nodes in it and return its number."""
        self.document["nodes"].append({"children": nodes})
        return len(self.document["nodes"]) - 1

    def named_material(self, label: int, name: str) -> int:
        """Return the number of a new material with a label and a name; the same for the same ones."""
        return self._named.setdefault((label, name), len(self._named))

    def add_materials(self, given: dict[str, Any]) -> None:
        """Add given materials, or the new ones if there are none."""
        if given:
            write_materials(given, self.document, self.binary)
        elif self._named:
            self.document["materials"] = [{"name": name} for _, name in self._named]

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
