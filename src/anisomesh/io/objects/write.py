"""Meshes with everything that they carry as objects of other libraries, which must be installed."""

from __future__ import annotations

import io
import logging
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from anisomesh.attributes.model import UNIT, Mesh, Regions
from anisomesh.io.carried import COLOUR, UV, Array, Integers
from anisomesh.io.formats.gltf.read import MATERIAL, NODE
from anisomesh.io.formats.gltf.write import glb_bytes
from anisomesh.io.formats.gmsh.groups import PHYSICAL
from anisomesh.io.formats.region_names import region_texts
from anisomesh.io.formats.units import in_unit_of
from anisomesh.io.formats.vtk.data import ORIGINAL_POINT, blank_rows
from anisomesh.io.formats.vtk.write import active_names, vtk_polygons
from anisomesh.io.holding.corners import continuous_corner_data, with_points_repeated
from anisomesh.io.holding.divisions import by_label
from anisomesh.io.holding.losses import OF_FEATURES, OF_FIXED_POINTS, Losses
from anisomesh.io.materials.from_gltf import without_mere_names
from anisomesh.io.objects.read import CELL_SET, MESHIO_DIVISIONS
from anisomesh.io.objects.trimesh_scenes import TRIMESH
from anisomesh.mesh.surface import Surface

logger = logging.getLogger(__name__)


def to_pyvista(mesh: Mesh) -> Any:
    """Return a mesh as a ``pyvista.PolyData``.

    Parameters
    ----------
    mesh
        The mesh, such as the ``mesh`` of a result. What the object cannot hold is named in one warning in the log.

    Returns
    -------
    pyvista.PolyData
        Triangles with point and cell data. Regions are cell data, with their names in field data; features are lines
        and fixed points vertices, whose cells come first. Points are repeated where corner data differ.

    Notes
    -----
    It is what :func:`~anisomesh.io.meshes.save` writes to VTP files.
    """
    pyvista, numpy_support = import_module("pyvista"), import_module("vtkmodules.util.numpy_support")
    losses = Losses()
    mesh, (cells, (point_data, cell_data, fields)) = vtk_polygons(_plain(mesh, losses), losses)
    data = pyvista.PolyData.from_regular_faces(mesh.surface.points, mesh.surface.faces)
    for name, section in (("verts", "Verts"), ("lines", "Lines")):
        rows = cells[section]
        if len(rows):
            setattr(data, name, np.insert(rows, 0, rows.shape[1], axis=1).ravel())
    active = active_names(point_data)
    numbers = point_data.pop(ORIGINAL_POINT, None)
    for into, given in ((data.point_data, point_data), (data.cell_data, cell_data), (data.field_data, fields)):
        for key, values in given.items():
            into[key] = values
    data.point_data.active_texture_coordinates_name = active.get("TCoords")
    data.point_data.active_normals_name = active.get("Normals")
    if numbers is not None:
        array = numpy_support.numpy_to_vtkIdTypeArray(numbers.astype(np.int64), deep=True)
        array.SetName(ORIGINAL_POINT)
        data.GetPointData().SetGlobalIds(array)
    _warn("PyVista", losses)
    return data


def to_meshio(mesh: Mesh) -> Any:
    """Return a mesh as a ``meshio.Mesh``.

    Parameters
    ----------
    mesh
        As for :func:`to_pyvista`.

    Returns
    -------
    meshio.Mesh
        Triangles, features as lines, and fixed points as vertices. Regions are cell data, called
        ``gmsh:physical`` if they are physical groups; names of the latter are field data.
    """
    meshio = import_module("meshio")
    losses = Losses()
    kinds = [
        _Cells("triangle", mesh.surface.faces, mesh.regions, "regions"),
        _Cells("line", mesh.features, mesh.feature_regions, OF_FEATURES),
        _Cells("vertex", mesh.fixed_points[:, None], mesh.fixed_point_regions, OF_FIXED_POINTS),
    ]
    kinds = [kind for kind in kinds if len(kind.nodes)]
    names = dict.fromkeys(name for kind in kinds for name in kind.divisions)
    theirs = {ours: name for name, ours in MESHIO_DIVISIONS.items()}
    labels = {
        theirs.get(name, name): [kind.labels(name) for kind in kinds] for name in names if not name.startswith(CELL_SET)
    }
    losses.add("face data", *(name for name in mesh.face_data if name in labels))
    losses.add("materials", *_plain(mesh, losses).materials)
    losses.fixed_faces(mesh)
    blank = {
        name: [values, *(blank_rows(values, len(kind.nodes)) for kind in kinds[1:])]
        for name, values in mesh.face_data.items()
    }
    result = meshio.Mesh(
        mesh.surface.points,
        [(kind.name, np.asarray(kind.nodes, dtype=np.int64)) for kind in kinds],
        point_data={**mesh.point_data, **continuous_corner_data(mesh, losses)},
        cell_data={**blank, **labels},
        field_data=_physical_names(kinds, losses),
        cell_sets=_cell_sets(kinds),
    )
    _warn("meshio", losses)
    return result


def _plain(mesh: Mesh, losses: Losses) -> Mesh:
    """Return a mesh for libraries without units and materials, without what is not said to be left out."""
    return in_unit_of(without_mere_names(mesh, losses), "", losses)


class _Cells(NamedTuple):
    """Cells of a type of meshio, their nodes (n, k), and divisions of them, which a warning calls as ``what`` says."""

    name: str
    nodes: Integers
    divisions: Mapping[str, Regions]
    what: str

    def labels(self, name: str) -> Integers:
        """Return the labels of a division, 0 if there is none of this name."""
        division = self.divisions.get(name)
        return np.zeros(len(self.nodes), dtype=np.int64) if division is None else division.labels


def _physical_names(kinds: Sequence[_Cells], losses: Losses) -> dict[str, Array]:
    """Return number and dimension of physical groups by name; names that cells of two types have are lost for one."""
    found: dict[str, Array] = {}
    for kind in kinds:
        lost = [name for name, regions in kind.divisions.items() if regions.names and name != PHYSICAL]
        losses.add(f"names of {kind.what}", *(name for name in lost if not name.startswith(CELL_SET)))
        regions = kind.divisions.get(PHYSICAL)
        for label, text in {} if regions is None else regions.names.items():
            if text in found:
                losses.add(f"names of {kind.what}", PHYSICAL)
            else:
                found[text] = np.array([label, kind.nodes.shape[1] - 1])
    return found


def _cell_sets(kinds: Sequence[_Cells]) -> dict[str, list[Integers]]:
    """Return the regions of the divisions into cell sets, with the numbers of cells of each type."""
    found: dict[str, list[Integers]] = {}
    for k, kind in enumerate(kinds):
        for name, regions in kind.divisions.items():
            if name.startswith(CELL_SET):
                for label, text in regions.names.items():
                    rows = found.setdefault(text, [np.zeros(0, dtype=np.int64) for _ in kinds])
                    rows[k] = np.union1d(rows[k], np.flatnonzero(regions.labels == label)).astype(np.int64)
    return found


def to_trimesh(mesh: Mesh) -> Any:
    """Return a mesh as an object of trimesh.

    Parameters
    ----------
    mesh
        As for :func:`to_pyvista`.

    Returns
    -------
    trimesh.Trimesh or trimesh.Scene
        A scene if there are several nodes or materials, with a mesh for each combination. Point and face data are
        vertex and face attributes, texture coordinates and colours are what trimesh draws. Points are repeated where
        corner data differ, and regions that are neither nodes nor materials are face attributes.
    """
    trimesh: Any = import_module("trimesh")
    losses = Losses()
    losses.features(mesh)
    mesh = with_points_repeated(mesh)[0]
    nodes, materials, table = mesh.regions.get(NODE), mesh.regions.get(MATERIAL), _trimesh_materials(mesh)
    others = [name for name in mesh.regions if name not in (NODE, MATERIAL)]
    losses.names_of_regions(mesh, *others)
    held = [UNIT, *(name for name in (TRIMESH, "gltf") if isinstance(mesh.materials.get(name), Mapping))]
    losses.add("materials", *(name for name in mesh.materials if name not in held))
    none = np.zeros(mesh.surface.n_faces, dtype=np.int64)
    texts = {} if nodes is None else region_texts(nodes, losses, distinct=True)
    scene = trimesh.Scene()
    for (node, material), faces in by_label(*(none if d is None else d.labels for d in (nodes, materials))):
        part = _trimesh_part(mesh, np.sort(faces), table.get(material))
        part.face_attributes.update({name: mesh.regions[name].labels[np.sort(faces)] for name in others})
        name = texts.get(node, "")
        scene.add_geometry(part, node_name=name or None, geom_name=name or None)
    _warn("trimesh", losses)
    is_scene = len(scene.geometry) > 1 or nodes is not None
    found = scene if is_scene else next(iter(scene.geometry.values()))
    if isinstance(mesh.materials.get(UNIT), str):
        found.units = mesh.materials[UNIT]
    return found


def _trimesh_materials(mesh: Mesh) -> dict[int, Any]:
    """Return the materials of trimesh by their labels."""
    trimesh: Any = import_module("trimesh")
    theirs, given = mesh.materials.get(TRIMESH), mesh.materials.get("gltf")
    if isinstance(theirs, Mapping):
        return dict(theirs)
    count = len(given.get("materials", [])) if isinstance(given, Mapping) else 0
    if count == 0:
        return {}
    each = Regions(np.arange(count), {k: str(k) for k in range(count)})
    one_face_each = Mesh(
        surface=Surface(np.tile(np.eye(3), (count, 1)), np.arange(3 * count).reshape(-1, 3)),
        point_data={UV: np.zeros((3 * count, 2))},
        regions={NODE: each, MATERIAL: each},
        materials={"gltf": given},
    )
    scene = trimesh.load(io.BytesIO(glb_bytes(one_face_each, Losses())), file_type="glb")
    return {k: scene.geometry[scene.graph[str(k)][1]].visual.material for k in range(count)}


def _trimesh_part(mesh: Mesh, chosen: Integers, material: Any) -> Any:
    """Return some faces of a mesh without corner data as a ``trimesh.Trimesh``."""
    trimesh: Any = import_module("trimesh")
    used, corners = np.unique(mesh.surface.faces[chosen], return_inverse=True)
    of_points = {name: values[used] for name, values in mesh.point_data.items()}
    of_faces = {name: values[chosen] for name, values in mesh.face_data.items()}
    visual, count = None, len(chosen)
    uv = of_points.get(UV)
    if uv is not None and uv.dtype.kind == "f" and np.isnan(uv).all():
        del of_points[UV]  # of faces without a texture
        uv = None
    if material is not None or uv is not None:
        visual = trimesh.visual.TextureVisuals(uv=of_points.pop(UV, None), material=material)
    elif COLOUR in of_points:
        visual = trimesh.visual.ColorVisuals(vertex_colors=of_points.pop(COLOUR))
    elif COLOUR in of_faces:
        visual = trimesh.visual.ColorVisuals(face_colors=of_faces.pop(COLOUR))
    return trimesh.Trimesh(
        mesh.surface.points[used],
        corners.reshape(count, 3),
        vertex_attributes=of_points,
        face_attributes=of_faces,
        visual=visual,
        process=False,
    )


def _warn(library: str, losses: Losses) -> None:
    if losses.text():
        logger.warning("left out what %s cannot hold: %s", library, losses.text())
