"""Read and write mesh files; the extension names the format."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.errors import MeshFileError
from anisomesh.io import polygons
from anisomesh.io.atomic import atomic_path
from anisomesh.io.convert import as_surface
from anisomesh.io.formats import glb, gmsh, medit, obj, off, ply, stl, threemf, vtk_xml
from anisomesh.io.formats.words import BYTE_ORDER_MARK
from anisomesh.mesh.surface import Surface

logger = logging.getLogger(__name__)

PointData = Mapping[str, npt.NDArray[Any]]  # arrays (V,) or (V, k) by name

_READERS: dict[str, Callable[[bytes], polygons.PolygonSoup]] = {
    ".obj": obj.read_obj,
    ".off": off.read_off,
    ".ply": ply.read_ply,
    ".stl": stl.read_stl,
    ".glb": glb.read_glb,
    ".3mf": threemf.read_3mf,
    ".vtu": vtk_xml.read_vtu,
    ".vtp": vtk_xml.read_vtp,
    ".msh": gmsh.read_msh,
    ".mesh": medit.read_medit,
}
_TEXT_FORMATS = (".obj", ".off", ".ply", ".msh", ".mesh")  # may begin with a byte order mark
MESH_FORMATS = tuple(_READERS)
"""Extensions that :func:`load` and :func:`save` know, in lower case with the dot."""


def load(path: str | os.PathLike[str]) -> Surface:
    """Read a surface mesh.

    Parameters
    ----------
    path
        A file with the extension .obj, .off, .ply, .stl, .glb, .3mf, .vtu, .vtp, .msh (Gmsh) or .mesh (MEDIT), in
        either case.

    Returns
    -------
    Surface
        The points in file order, as float64, and the polygons as triangles. Nothing is repaired: unused points and
        degenerate faces are kept.

    Raises
    ------
    MeshFileError
        If the file does not exist, its format is unknown, it is empty, truncated or malformed, an index is out of
        range, a coordinate is not finite, or there is no face.

    Notes
    -----
    Quadrilaterals are split along their shorter diagonal, larger polygons into fans; concave ones by ear clipping.
    Cells of second order are split at the nodes of their sides if the whole surface is of second order; otherwise cells
    of higher order are read as polygons of their corners. Lines and volume cells are ignored. Whatever else is left out
    is named in a warning in the log. STL stores unconnected triangles; corners with equal coordinates are welded, which
    is logged.
    """
    path = _as_path(path)
    try:
        suffix = "" if path.is_dir() else _known_suffix(path)
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise MeshFileError(f"{path}: no such file; expected a mesh file") from error
    except IsADirectoryError as error:
        raise MeshFileError(f"{path}: is a folder; expected a mesh file") from error
    except OSError as error:
        raise MeshFileError(f"{path}: cannot be read: {error.strerror or error}") from error
    if not data.strip():
        raise MeshFileError(f"{path}: the file is empty; expected a mesh")
    try:
        if suffix in _TEXT_FORMATS:
            data = data.removeprefix(BYTE_ORDER_MARK)
        surface, _, remarks = polygons.as_triangles(_READERS[suffix](data))
    except Exception as error:
        # Our readers raise ValueError with an explanation; other exceptions come from libraries.
        reason = str(error)
        if type(error) is not ValueError:
            reason = f"malformed or truncated ({type(error).__name__}: {error})"
        reason = " ".join(reason.split())
        raise MeshFileError(f"{path}: cannot be read as {suffix[1:].upper()}: {reason}") from error
    for remark in remarks:
        logger.warning("%s: %s", path, remark)
    return surface


def save(surface: Any, path: str | os.PathLike[str], *, point_data: PointData | None = None) -> None:
    """Write a surface mesh atomically.

    Parameters
    ----------
    surface
        The mesh to write: a :class:`Surface`, a ``trimesh.Trimesh`` or a ``pyvista.PolyData``.
    path
        The file, with one of the extensions of :func:`load`. An existing file is replaced.
    point_data
        Arrays (V,) or (V, k) by name. VTU and VTP store all of them, PLY scalars only; arrays that the format
        cannot store are omitted with a warning in the log.

    Raises
    ------
    MeshFileError
        If the format is unknown, the folder is missing or cannot be written, the disk is full, an array has the wrong
        length or type, or a coordinate does not fit the format.
    MeshError
        If the object is not a mesh.

    Notes
    -----
    OBJ, OFF, PLY, 3MF, VTU, VTP, MSH and MEDIT keep every float64 exactly; STL and GLB round to float32.
    """
    path, surface = _as_path(path), as_surface(surface)
    suffix = _known_suffix(path)
    data = {}
    for name, values in (point_data or {}).items():
        if not isinstance(name, str) or not name:
            raise MeshFileError(f"{path}: {name!r} is not a name of point data")
        data[name] = _point_array(path, name, values, surface.n_points)
    stored = {
        name: values
        for name, values in data.items()
        if suffix in (".vtu", ".vtp") or (suffix == ".ply" and values.ndim == 1)
    }
    for name in data.keys() - stored.keys():
        logger.warning("%s: omitted the point data %r, which %s cannot store", path, name, suffix[1:].upper())
    with atomic_path(path) as temporary:
        try:
            _write(surface, temporary, stored)
        except ValueError as error:
            raise MeshFileError(f"{path}: cannot be written: {error}") from error


def _as_path(path: str | os.PathLike[str]) -> Path:
    if not isinstance(path, str | os.PathLike):
        raise MeshFileError(f"{path!r} is not a file name")
    return Path(path)


def _point_array(path: Path, name: str, values: Any, n_points: int) -> npt.NDArray[Any]:
    """Return point data as an array (V,) or (V, k) of integers or floats that every format can store."""
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise MeshFileError(f"{path}: {name} cannot be read as an array: {error}") from error
    if array.ndim not in (1, 2) or len(array) != n_points or array.size == 0:
        raise MeshFileError(f"{path}: {name} has shape {array.shape}; expected ({n_points},) or ({n_points}, k)")
    if array.dtype.kind not in "biuf":
        raise MeshFileError(f"{path}: {name} has type {array.dtype}; expected integers or real numbers")
    if array.dtype.kind == "b":
        return array.astype(np.uint8)
    return array.astype(np.float64) if array.dtype.itemsize not in (1, 2, 4, 8) or array.dtype == np.float16 else array


def _write(surface: Surface, path: Path, data: dict[str, npt.NDArray[Any]]) -> None:
    points, faces = surface.points, surface.faces
    sizes = np.full(len(faces), 3, dtype=np.int64)
    match path.suffix.lower():
        case ".obj":
            content: str | bytes = obj.obj_text(points, faces)
        case ".off":
            content = off.off_text(points, faces)
        case ".mesh":
            content = medit.medit_text(points, faces)
        case ".ply":
            content = ply.ply_bytes(points, faces, data)
        case ".stl":
            content = stl.stl_bytes(points, faces)
        case ".glb":
            content = glb.glb_bytes(points, faces)
        case ".3mf":
            content = threemf.bytes_of_3mf(points, faces)
        case ".vtu":
            content = vtk_xml.vtu_bytes(points, faces.ravel(), sizes, data)
        case ".vtp":
            content = vtk_xml.vtp_bytes(points, faces.ravel(), sizes, data)
        case _:
            content = gmsh.msh_bytes(points, faces)
    path.write_bytes(content.encode() if isinstance(content, str) else content)


def _known_suffix(path: Path) -> str:
    """Return the extension in lower case, or raise MeshFileError if the format is unknown."""
    if path.suffix.lower() not in MESH_FORMATS:
        expected = ", ".join(sorted(MESH_FORMATS))
        raise MeshFileError(f"{path}: unknown format {path.suffix or '(no extension)'}; expected one of {expected}")
    return path.suffix.lower()
