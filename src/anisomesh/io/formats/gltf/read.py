"""Reading of binary glTF 2.0 (GLB).

Format: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.attributes.model import UNIT
from anisomesh.io.carried import Carried, listed
from anisomesh.io.cells import SurfaceCells, strip_triangles
from anisomesh.io.formats.gltf.attributes import Attributes, read_attributes
from anisomesh.io.formats.gltf.document import Document, index_of
from anisomesh.io.formats.gltf.extensions import COPIES, LEVELS, REQUIRED, descriptive, extensions
from anisomesh.io.formats.gltf.materials import read_materials
from anisomesh.io.formats.region_names import also_named, divide, is_number
from anisomesh.io.formats.units import OF_GLB
from anisomesh.io.polygons import Integers, PolygonSoup

NODE, MATERIAL = "node", "material"
"""Names of the divisions into the nodes of the scene and into materials."""

NO_MATERIAL = -1
"""Label of faces without a material."""

TRIANGLES, _STRIP, _FAN = 4, 5, 6  # modes of a primitive
_POINTS, _LINES, _LINE_STRIP = 0, 1, 3
_DEEPEST = 200  # of nodes in nodes
_MAX_INSTANCES = 100_000
_NOT_KEPT = ("animations", "skins", "cameras")


def read_glb(data: bytes) -> PolygonSoup:
    """Read the triangles, strips and fans of all meshes of a binary glTF scene, moved by the nodes they hang on.

    Notes
    -----
    Nodes and materials are divisions; texture coordinates, colours, normals and others are point data, since points are
    repeated along seams. Texture coordinates have their origin at the lower left, as in OBJ.
    """
    try:
        return _Scene(Document(data)).soup()
    except KeyError as error:
        raise ValueError(f"malformed: a part of its JSON lacks {error}") from error


class _Scene:
    """A glTF document, and the meshes found in it so far."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._json = document.json
        self._cells = SurfaceCells()
        self._points: list[npt.NDArray[np.float64]] = [np.zeros((0, 3))]
        self._n_points = self._n_lines = self._n_single_points = 0  # of primitives that are not triangles
        self._n_instances = 0
        self._coarser = _coarser_levels(self._json)
        self._carried = Carried()
        self._seen: dict[int, int] = {}  # mesh of each node that is read, or of itself in a file without scenes
        self._attributes = Attributes()
        self._known: dict[Any, int] = {}  # first point of vertices that several primitives share
        self._nodes: list[Integers] = [np.zeros(0, dtype=np.int64)]
        self._materials: list[Integers] = [np.zeros(0, dtype=np.int64)]

    def soup(self) -> PolygonSoup:
        """Return the meshes of the scene, or all meshes of a file without scenes."""
        scenes = self._json.get("scenes", [])
        if scenes:
            for node in self._document.item("scenes", self._json.get("scene", 0)).get("nodes", []):
                self._add_node(node, np.eye(4), 0)
        else:
            coarser = {self._document.item("nodes", node).get("mesh") for node in self._coarser}
            for mesh in range(len(self._json.get("meshes", []))):
                if mesh not in coarser:
                    self._add_mesh(mesh, np.eye(4), mesh)
        self._carry()
        return self._cells.soup(np.concatenate(self._points), self._left_out(), self._carried)

    def _left_out(self) -> tuple[str, ...]:
        """Return what of the geometry is left out, a line each."""
        remarks = []
        if not self._json.get("scenes") and self._moves_meshes():
            remarks.append("it has no scene: read each of its meshes once, not moved by its nodes")
        counts = [f"{n:,} {what}(s)" for n, what in ((self._n_lines, "line"), (self._n_single_points, "point")) if n]
        if counts:
            alone = [repr(name) for name in map(self._node_name, self._without_triangles()) if name]
            of_them = f", everything in {listed(alone)}" if alone else ""
            remarks.append(f"left out {' and '.join(counts)} that its meshes have besides triangles{of_them}")
        hidden = self._hidden_meshes()
        if hidden:
            remarks.append(f"left out {len(hidden)} mesh(es) that are not in its scene: {listed(hidden)}")
        if self._coarser:
            remarks.append(f"read its finest level of detail; coarser ones left out ({LEVELS}): {len(self._coarser)}")
        return tuple(remarks)

    def _moves_meshes(self) -> bool:
        """Return whether nodes, which are in no scene, move a mesh or show one several times."""
        nodes = self._json.get("nodes", [])
        read = [node for k, node in enumerate(nodes) if k not in self._coarser]
        shown = [node["mesh"] for node in read if "mesh" in node]
        if len(set(shown)) < len(shown):
            return True
        below = [node for node in read if COPIES in node.get("extensions", {}) or (_matrix(node) != np.eye(4)).any()]
        done: set[int] = set()
        for node in below:  # which grows
            if "mesh" in node:
                return True
            new = set(node.get("children", [])) - done - self._coarser
            below += [self._document.item("nodes", child) for child in new]
            done |= new
        return False

    def _without_triangles(self) -> list[int]:
        """Return the nodes that are read, or meshes of a file without scenes, that have lines and points only."""
        modes = {
            node: [primitive.get("mode", TRIANGLES) for primitive in self._document.item("meshes", mesh)["primitives"]]
            for node, mesh in self._seen.items()
        }
        return [node for node, given in modes.items() if given and max(given) < TRIANGLES]

    def _hidden_meshes(self) -> list[str]:
        """Return the names, or numbers, of meshes that the scene does not have, not even as coarser levels."""
        nodes, below, known = self._json.get("nodes", []), list(self._coarser), set(self._seen.values())
        done: set[int] = set()
        while below:
            node = below.pop()
            if node not in done and node < len(nodes):
                done.add(node)
                below += nodes[node].get("children", [])
                known.add(nodes[node].get("mesh"))
        meshes = enumerate(self._json.get("meshes", []))
        return [repr(mesh["name"]) if mesh.get("name") else str(k) for k, mesh in meshes if k not in known]

    def _carry(self) -> None:
        """Collect everything besides triangles."""
        carried = self._carried
        carried.materials[UNIT] = OF_GLB
        with carried.optional("the attributes of points"):
            carried.point_data |= self._attributes.together(carried)
        nodes, materials = np.concatenate(self._nodes), np.concatenate(self._materials)
        with carried.optional("its nodes"):
            used = np.unique(nodes).tolist()
            texts = [self._node_name(label) for label in used]
            bare = self._without_triangles()  # which a line of the geometry names
            also_named(carried, NODE, [self._node_name(node) for node in self._seen if node not in bare])
            if any(texts) or len(used) > 1:
                divide(carried, NODE, nodes, texts, used)
        with carried.optional("its materials"):
            if (materials >= 0).any():
                given = self._json.get("materials", [])
                texts = [str(material.get("name", "")) for material in given]
                if any(map(is_number, texts)) and all(material.keys() == {"name"} for material in given):
                    divide(carried, MATERIAL, materials, texts, range(len(texts)))
                else:  # all are handed on, with their names
                    used = set(np.unique(materials).tolist())
                    names = {k: text for k, text in enumerate(texts) if text and k in used}
                    carried.add_cell_data(MATERIAL, materials, names=names)
                    carried.materials["gltf"] = read_materials(self._document)
        left = [name for name in _NOT_KEPT if self._json.get(name)] + descriptive(extensions(self._json, REQUIRED))
        primitives = [part for mesh in self._json.get("meshes", []) for part in mesh["primitives"]]
        left += ["morph targets"] if any("targets" in part for part in primitives) else []
        if left:
            carried.remarks.append(f"left out its {', '.join(left)}")

    def _node_name(self, label: int) -> str:
        """Return the name of a node or, if it has none, of its mesh."""
        if not self._json.get("scenes"):
            return str(self._document.item("meshes", label).get("name", ""))
        node = self._document.item("nodes", label)
        return str(node.get("name") or self._document.item("meshes", node["mesh"]).get("name", ""))

    def _add_node(self, index: int, above: npt.NDArray[np.float64], depth: int) -> None:
        self._n_instances += 1
        if depth > _DEEPEST or self._n_instances > _MAX_INSTANCES:
            raise ValueError("malformed: its nodes contain each other")
        if index in self._coarser:
            return
        node = self._document.item("nodes", index)
        matrix = above @ _matrix(node)
        if "mesh" in node:
            for place in self._copies(node):
                self._add_mesh(node["mesh"], matrix @ place, index)
        for child in node.get("children", []):
            self._add_node(child, matrix, depth + 1)

    def _copies(self, node: dict[str, Any]) -> list[npt.NDArray[np.float64]]:
        """Return the transformations (4, 4) of the copies of its mesh that a node shows, the identity for one."""
        given = node.get("extensions", {}).get(COPIES, {}).get("attributes", {})
        parts = {key: given[key.upper()] for key in ("translation", "rotation", "scale") if key.upper() in given}
        if not parts:
            return [np.eye(4)]
        rows = {key: self._document.numbers(accessor) for key, accessor in parts.items()}
        counts = sorted({len(values) for values in rows.values()})
        self._n_instances += counts[-1]
        if len(counts) > 1 or self._n_instances > _MAX_INSTANCES:
            raise ValueError(f"malformed: a node has {' or '.join(map(str, counts))} copies of its mesh")
        return [_matrix({key: values[k] for key, values in rows.items()}) for k in range(counts[0])]

    def _add_mesh(self, index: int, matrix: npt.NDArray[np.float64], node: int) -> None:
        self._seen[node] = index
        for primitive in self._document.item("meshes", index)["primitives"]:
            mode = primitive.get("mode", TRIANGLES)
            if mode < TRIANGLES:
                self._cells.ignore("line or point")
                self._count(primitive, mode)
                continue
            if mode > _FAN:
                raise ValueError(f"malformed: a primitive has the mode {mode}; expected 0 to 6")
            points = self._document.numbers(primitive["attributes"]["POSITION"])
            if points.shape[1] != 3:
                raise ValueError(f"malformed: positions have {points.shape[1]} coordinates")
            indices = np.arange(len(points))
            if "indices" in primitive:
                indices = self._document.numbers(primitive["indices"]).astype(np.int64).ravel()
            if len(indices) and indices.max() >= len(points):
                raise ValueError(f"a face refers to point {indices.max()} but its mesh has {len(points)} points")
            triangles = _triangles(indices, mode)
            if np.linalg.det(matrix[:3, :3]) < 0.0:
                triangles = triangles[:, ::-1]  # a reflection turns triangles inside out
            self._cells.add("triangle", triangles + self._first_point(primitive, points, matrix))
            material = primitive.get("material", NO_MATERIAL)
            self._nodes.append(np.full(len(triangles), node))
            self._materials.append(np.full(len(triangles), material if isinstance(material, int) else NO_MATERIAL))

    def _count(self, primitive: dict[str, Any], mode: int) -> None:
        """Count the lines or points of a primitive; by specification nothing is drawn of one without positions."""
        attributes = primitive.get("attributes", {})
        if "POSITION" not in attributes:
            return
        accessor = primitive.get("indices", attributes["POSITION"])
        n = index_of(self._document.item("accessors", accessor)["count"])
        if mode == _POINTS:
            self._n_single_points += n
        else:
            self._n_lines += n // 2 if mode == _LINES else max(n - (mode == _LINE_STRIP), 0)

    def _first_point(self, primitive: dict[str, Any], points: npt.NDArray[Any], matrix: npt.NDArray[np.float64]) -> int:
        """Return the first of the vertices of a primitive, which are added unless another one shares them."""
        key = (str(primitive["attributes"]), matrix.tobytes())
        if key not in self._known:
            self._known[key] = self._n_points
            self._points.append(points.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3])
            self._n_points += len(points)
            found = read_attributes(self._document, primitive["attributes"], matrix, self._carried)
            self._attributes.add(len(points), found)
        return self._known[key]


def _coarser_levels(document: dict[str, Any]) -> set[int]:
    """Return the numbers of the nodes that are coarser levels of detail of others."""
    extensions = [node.get("extensions", {}) for node in document.get("nodes", [])]
    return {index_of(node) for each in extensions if LEVELS in each for node in each[LEVELS]["ids"]}


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
