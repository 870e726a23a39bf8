"""Meshes and scenes of trimesh, and their materials."""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib import import_module
from typing import Any

import numpy as np

from anisomesh.attributes.model import UNIT
from anisomesh.io.carried import COLOUR, UV, Array, Carried
from anisomesh.io.cells import SurfaceCells
from anisomesh.io.formats.gltf.attributes import Attributes
from anisomesh.io.formats.gltf.document import Document
from anisomesh.io.formats.gltf.materials import read_materials
from anisomesh.io.formats.gltf.read import MATERIAL, NODE
from anisomesh.io.formats.region_names import divide
from anisomesh.io.polygons import PolygonSoup

TRIMESH = "trimesh"
"""Key of the materials of trimesh by their labels."""

_NAMED_BY_TRIMESH = re.compile(r"(geometry|material)_\d+")
_UNIT_NAMES = {  # other names than plurals that end in one s
    **{"inches": "inch", "feet": "foot", "in": "inch", "ft": "foot"},
    **{"m": "meter", "cm": "centimeter", "mm": "millimeter"},
}


def scene_soup(mesh: Any) -> PolygonSoup:
    """Return a mesh, or the meshes of a scene moved to their places, with everything that they carry.

    Notes
    -----
    The nodes of a scene and materials are divisions. Texture coordinates and colours have our names.
    """
    parts = _Parts()
    if hasattr(mesh, "vertices"):
        parts.add(mesh, np.eye(4), "")
    else:
        for node in mesh.graph.nodes_geometry:
            matrix, name = mesh.graph[node]
            parts.add(mesh.geometry[name], matrix, str(node))
    units = str(getattr(mesh, "units", None) or "")
    return parts.soup(_UNIT_NAMES.get(units, units.removesuffix("s")))


class _Parts:
    """Collects the meshes of a scene."""

    def __init__(self) -> None:
        self._cells, self._carried, self._remarks = SurfaceCells(), Carried(), list[str]()
        self._points, self._n_points = [np.zeros((0, 3))], 0
        self._point_data, self._face_data = Attributes(), Attributes()
        self._nodes: list[tuple[str, int]] = []
        self._materials: list[Any] = []
        self._labels: list[Array] = [np.zeros(0, dtype=np.int64)]

    def add(self, mesh: Any, matrix: Array, node: str) -> None:
        """Add a mesh that is moved by a matrix (4, 4), unless it has no faces."""
        if not hasattr(mesh, "faces"):
            self._remarks.append(f"left out {node!r} of type {type(mesh).__name__}, which is not a surface")
            return
        points, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces)
        if faces.dtype.kind not in "iu" or faces.ndim != 2 or points.ndim != 2:
            raise ValueError(f"its faces have type {faces.dtype} and shape {faces.shape}; expected integers (F, 3)")
        if np.linalg.det(matrix[:3, :3]) < 0.0:
            faces = faces[:, ::-1]  # a reflection turns triangles inside out
        self._cells.add("triangle" if faces.shape[1] == 3 else "quad", faces + self._n_points)
        self._points.append(points if (matrix == np.eye(4)).all() else points @ matrix[:3, :3].T + matrix[:3, 3])
        self._n_points += len(points)
        of_points, of_faces = _data(mesh)
        for data, given, count in ((self._point_data, of_points, len(points)), (self._face_data, of_faces, len(faces))):
            fitting = {name: values for name, values in given.items() if values.shape[:1] == (count,)}
            data.add(count, fitting)
            missing = [name for name in given if name not in fitting]
            self._carried.remarks += [f"left out {name!r}: it does not have {count} rows" for name in missing]
        self._nodes.append(("" if _NAMED_BY_TRIMESH.fullmatch(node) else node, len(faces)))
        self._labels.append(self._material_labels(mesh, len(faces)))

    def _material_labels(self, mesh: Any, count: int) -> Array:
        """Return the label (F,) of the material of each face, -1 for none."""
        visual = getattr(mesh, "visual", None)
        material = getattr(visual, "material", None)
        if material is None or _is_default(visual):
            return np.full(count, -1)
        several, of_faces = getattr(material, "materials", None), getattr(visual, "face_materials", None)
        given = list(several) if several and of_faces is not None and len(of_faces) == count else [material]
        labels: list[int] = []
        for one in given:
            known = [k for k, other in enumerate(self._materials) if other is one]
            labels.append(known[0] if known else len(self._materials))
            self._materials += [] if known else [one]
        member = np.zeros(count, dtype=np.int64) if len(given) == 1 else np.asarray(of_faces)
        return np.asarray(np.array(labels)[member])

    def soup(self, unit: str) -> PolygonSoup:
        """Return everything, in this unit of length, empty if it is not known."""
        carried = self._carried
        carried.point_data |= self._point_data.together(carried)
        for name, values in self._face_data.together(carried, "faces").items():
            carried.add_cell_data(name, values)
        texts = [name for name, _ in self._nodes]
        if any(texts) or len(texts) > 1:
            labels = np.repeat(np.arange(len(texts)), [count for _, count in self._nodes])
            divide(carried, NODE, labels, texts, range(len(texts)))
        if self._materials:
            given = {k: str(getattr(one, "name", None) or "") for k, one in enumerate(self._materials)}
            names = {k: name for k, name in given.items() if name and not _NAMED_BY_TRIMESH.fullmatch(name)}
            carried.add_cell_data(MATERIAL, np.concatenate(self._labels), names=names)
            carried.materials[TRIMESH] = dict(enumerate(self._materials))
        if unit:
            carried.materials[UNIT] = unit
        return self._cells.soup(np.concatenate(self._points), tuple(self._remarks), carried)


def _data(mesh: Any) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return the data of the points and of the faces of a mesh by our names."""
    of_points, of_faces = (
        {str(name): np.asarray(values) for name, values in getattr(mesh, attributes, {}).items()}
        for attributes in ("vertex_attributes", "face_attributes")
    )
    visual: Any = getattr(mesh, "visual", None)
    kind = getattr(visual, "kind", None)
    if kind == "vertex":
        of_points[COLOUR] = np.asarray(visual.vertex_colors)
    elif kind == "face":
        of_faces[COLOUR] = np.asarray(visual.face_colors)
    elif kind == "texture":
        of_points |= {name: np.asarray(rows) for name, rows in visual.vertex_attributes.items() if name != UV}
        of_points |= {} if visual.uv is None else {UV: np.asarray(visual.uv)}
    return of_points, of_faces


def _is_default(visual: Any) -> bool:
    """Return whether a material is the one that trimesh makes for texture coordinates alone."""
    default = type(visual)().material
    return hash(visual.material) == hash(default) and visual.material.name == default.name


def materials_as_gltf(given: Mapping[int, Any]) -> dict[str, Any]:
    """Return materials of trimesh by their labels as the materials of glTF, at the place of their label.

    trimesh converts them and their images.
    """
    trimesh: Any = import_module("trimesh")
    scene = trimesh.Scene()
    for label in range(max(given) + 1):
        visual = trimesh.visual.TextureVisuals(uv=np.zeros((3, 2)), material=given.get(label))
        scene.add_geometry(trimesh.Trimesh(np.eye(3), [[0, 1, 2]], visual=visual, process=False))
    document = Document(bytes(scene.export(file_type="glb")))
    materials = [document.json["materials"][mesh["primitives"][0]["material"]] for mesh in document.json["meshes"]]
    return {**read_materials(document), "materials": materials}
