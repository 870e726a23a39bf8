"""Read and write mesh files and streams; the extension names the format, unless it is given."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

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


def load(path: str | os.PathLike[str] | BinaryIO, *, file_format: str | None = None) -> Surface:
    """Read a surface mesh.

    Parameters
    ----------
    path
        A file with the extension .obj, .off, .ply, .stl, .glb, .3mf, .vtu, .vtp, .msh (Gmsh) or .mesh (MEDIT), in
        either case; or a stream that is open for reading bytes, together with ``file_format``.
    file_format
        The format, such as ``"ply"``, if the extension does not name it.

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
    name, suffix, data = _content(path, file_format)
    if not data.strip():
        raise MeshFileError(f"{name}: the file is empty; expected a mesh")
    try:
        if suffix in _TEXT_FORMATS:
            data = data.removeprefix(BYTE_ORDER_MARK)
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is reported by polygons.validate
            soup = _READERS[suffix](data)
        surface, _, remarks = polygons.as_triangles(soup)
    except Exception as error:
        # Our readers raise ValueError with an explanation; other exceptions come from libraries.
        reason = str(error)
        if type(error) is not ValueError:
            reason = f"malformed or truncated ({type(error).__name__}: {error})"
        reason = " ".join(reason.split())
        raise MeshFileError(f"{name}: cannot be read as {suffix[1:].upper()}: {reason}") from error
    for remark in remarks:
        logger.warning("%s: %s", name, remark)
    return surface


def _content(path: str | os.PathLike[str] | BinaryIO, file_format: str | None) -> tuple[str, str, bytes]:
    """Return the name of a file or stream for messages, the extension of its format, and its bytes."""
    if not isinstance(path, str | os.PathLike) and hasattr(path, "read"):
        name = _stream_name(path)
        suffix = _known_suffix(name, file_format)
        try:
            return name, suffix, bytes(path.read())
        except (OSError, TypeError) as error:
            raise MeshFileError(f"{name}: cannot be read: {error}; expected a stream of bytes") from error
    file = _as_path(path)
    try:
        suffix = "" if file.is_dir() else _known_suffix(file, file_format)
        return str(file), suffix, file.read_bytes()
    except FileNotFoundError as error:
        raise MeshFileError(f"{file}: no such file; expected a mesh file") from error
    except IsADirectoryError as error:
        raise MeshFileError(f"{file}: is a folder; expected a mesh file") from error
    except OSError as error:
        raise MeshFileError(f"{file}: cannot be read: {error.strerror or error}") from error


def save(
    surface: Any,
    path: str | os.PathLike[str] | BinaryIO,
    *,
    point_data: PointData | None = None,
    file_format: str | None = None,
) -> None:
    """Write a surface mesh, a file atomically.

    Parameters
    ----------
    surface
        The mesh to write: whatever :func:`~anisomesh.io.convert.as_surface` takes.
    path
        The file, with one of the extensions of :func:`load`; an existing file is replaced. Or a stream that is open for
        writing bytes, together with ``file_format``.
    point_data
        Arrays (V,) or (V, k) by name. VTU and VTP store all of them, PLY scalars only; arrays that the format
        cannot store are omitted with a warning in the log.
    file_format
        The format, such as ``"ply"``, if the extension does not name it.

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
    stream: Any = path if not isinstance(path, str | os.PathLike) and hasattr(path, "write") else None
    name = str(_as_path(path)) if stream is None else _stream_name(stream)
    surface = as_surface(surface)
    suffix = _known_suffix(name, file_format)
    data = {}
    for key, values in (point_data or {}).items():
        if not isinstance(key, str) or not key:
            raise MeshFileError(f"{name}: {key!r} is not a name of point data")
        data[key] = _point_array(name, key, values, surface.n_points)
    stored = {
        key: values
        for key, values in data.items()
        if suffix in (".vtu", ".vtp") or (suffix == ".ply" and values.ndim == 1)
    }
    for key in data.keys() - stored.keys():
        logger.warning("%s: omitted the point data %r, which %s cannot store", name, key, suffix[1:].upper())
    try:
        content = _bytes_of(surface, suffix, stored)
    except ValueError as error:
        raise MeshFileError(f"{name}: cannot be written: {error}") from error
    if stream is not None:
        stream.write(content)
    else:
        with atomic_path(name) as temporary:
            temporary.write_bytes(content)


def _stream_name(stream: Any) -> str:
    name = getattr(stream, "name", None)
    return name if isinstance(name, str) else "stream"


def _as_path(path: Any) -> Path:
    if not isinstance(path, str | os.PathLike):
        raise MeshFileError(f"{path!r} is not a file name")
    return Path(path)


def _point_array(path: str, name: str, values: Any, n_points: int) -> npt.NDArray[Any]:
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


def _bytes_of(surface: Surface, suffix: str, data: dict[str, npt.NDArray[Any]]) -> bytes:
    """Return the content of a file of this format."""
    points, faces = surface.points, surface.faces
    sizes = np.full(len(faces), 3, dtype=np.int64)
    match suffix:
        case ".obj":
            return obj.obj_text(points, faces).encode()
        case ".off":
            return off.off_text(points, faces).encode()
        case ".mesh":
            return medit.medit_text(points, faces).encode()
        case ".ply":
            return ply.ply_bytes(points, faces, data)
        case ".stl":
            return stl.stl_bytes(points, faces)
        case ".glb":
            return glb.glb_bytes(points, faces)
        case ".3mf":
            return threemf.threemf_bytes(points, faces)
        case ".vtu":
            return vtk_xml.vtu_bytes(points, faces, sizes, data)
        case ".vtp":
            return vtk_xml.vtp_bytes(points, faces, sizes, data)
        case _:
            return gmsh.msh_bytes(points, faces)


def _known_suffix(path: str | Path, file_format: str | None) -> str:
    """Return the extension of the format in lower case, or raise MeshFileError if it is unknown."""
    expected = ", ".join(sorted(MESH_FORMATS))
    if file_format is not None:
        suffix = "." + file_format.lower().removeprefix(".") if isinstance(file_format, str) else ""
        if suffix not in MESH_FORMATS:
            raise MeshFileError(f"{path}: unknown format {file_format!r}; expected one of {expected}")
        return suffix
    suffix = Path(path).suffix.lower()
    if suffix not in MESH_FORMATS:
        raise MeshFileError(
            f"{path}: unknown format {Path(path).suffix or '(no extension)'}; expected one of {expected}"
        )
    return suffix
