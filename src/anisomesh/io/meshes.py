"""Read and write mesh files and streams; the extension names the format, unless it is given."""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from anisomesh.attributes.model import Mesh
from anisomesh.errors import MeshError, MeshFileError, why_unreadable
from anisomesh.io.assemble import as_mesh
from anisomesh.io.atomic import atomic_path
from anisomesh.io.convert import from_object
from anisomesh.io.formats.words import BYTE_ORDER_MARK
from anisomesh.io.holding.losses import Losses
from anisomesh.io.known_formats import READERS, TEXT_FORMATS, known_suffix, mistaken_format
from anisomesh.io.materials import files as material_files
from anisomesh.io.materials.content import file_content, warn_of_losses
from anisomesh.mesh.surface import Surface

logger = logging.getLogger(__name__)

PointData = Mapping[str, npt.NDArray[Any]]  # arrays (V,) or (V, k) by name


def load(path: str | os.PathLike[str] | BinaryIO, *, file_format: str | None = None) -> Surface:
    """Read a surface mesh without attributes; :func:`load_mesh` reads these too.

    Parameters
    ----------
    path
        A file with the extension .obj, .off, .ply, .stl, .glb, .3mf, .vtu, .vtp, .msh (Gmsh), .mesh or .meshb
        (MEDIT), in either case; or a stream that is open for reading bytes, together with ``file_format``.
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
    of higher order are read as polygons of their corners. Volume cells are ignored. Whatever else is left out of the
    geometry is named in a warning in the log. STL stores unconnected triangles; corners with equal coordinates are
    welded, which is logged.
    """
    return _read(path, file_format)[1].surface


def load_mesh(path: str | os.PathLike[str] | BinaryIO, *, file_format: str | None = None) -> Mesh:
    """Read a surface mesh with everything that the file carries.

    Parameters
    ----------
    path, file_format
        As for :func:`load`.

    Returns
    -------
    Mesh
        The surface that :func:`load` returns, with the data of its points, faces and corners, regions, lines as
        features, and materials. Triangles have the data of the polygon or cell that they are part of.

    Raises
    ------
    MeshFileError
        As for :func:`load`: the geometry must be readable.

    Notes
    -----
    Texture coordinates are called ``uv``, unit normals ``normal`` and colours ``color``, whatever the format calls
    them. Attributes that are broken, or that a :class:`Mesh` cannot hold, are left out, with a line each in the log.
    The materials of an OBJ file are read from the .mtl files beside it.
    """
    name, mesh, losses = _read(path, file_format)
    if isinstance(path, str | os.PathLike):
        mesh, more = material_files.read_beside(mesh, Path(path))
        losses += more
    for loss in losses:
        logger.warning("%s: %s", name, loss)
    return mesh


def _read(path: str | os.PathLike[str] | BinaryIO, file_format: str | None) -> tuple[str, Mesh, tuple[str, ...]]:
    """Return the name of a file or stream, what it contains, and which attributes were left out."""
    name, suffix, data = _content(path, file_format)
    if not data.strip():
        raise MeshFileError(f"{name}: the file is empty; expected a mesh")
    try:
        if suffix in TEXT_FORMATS:
            data = data.removeprefix(BYTE_ORDER_MARK)
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is reported by polygons.validate
            mesh, remarks, losses = as_mesh(READERS[suffix](data))
    except Exception as error:
        # Our readers raise ValueError with an explanation; other exceptions come from libraries.
        reason = str(error)
        if type(error) is not ValueError:
            reason = f"malformed or truncated ({type(error).__name__}: {error})"
        mistaken = mistaken_format(data, suffix)
        reason = f"it seems to be {mistaken}" if mistaken else " ".join(reason.split())
        raise MeshFileError(f"{name}: cannot be read as {suffix[1:].upper()}: {reason}") from error
    for remark in remarks:
        logger.warning("%s: %s", name, remark)
    return name, mesh, losses


def mesh_of(mesh: Any, faces: npt.NDArray[Any] | None = None) -> Mesh:
    """Return a mesh in any form: a mesh with attributes, the name of a file, arrays, or an object of a library.

    Parameters
    ----------
    mesh
        A :class:`Mesh`; a path, read by :func:`load_mesh`; or what :func:`~anisomesh.io.convert.as_surface` takes.
    faces
        Triangles (F, 3) if ``mesh`` is an array of points.

    Raises
    ------
    MeshFileError
        If the file cannot be read.
    MeshError
        If the object is not a mesh, or there are faces besides a file.
    """
    if not isinstance(mesh, str | os.PathLike | Mesh):
        return from_object(mesh, faces)
    if faces is not None:
        what = "a Mesh" if isinstance(mesh, Mesh) else f"the file {os.fspath(mesh)}"
        raise MeshError(f"the mesh is {what} and has faces; leave out the second argument")
    return mesh if isinstance(mesh, Mesh) else load_mesh(mesh)


def _content(path: str | os.PathLike[str] | BinaryIO, file_format: str | None) -> tuple[str, str, bytes]:
    """Return the name of a file or stream for messages, the extension of its format, and its bytes."""
    if not isinstance(path, str | os.PathLike) and hasattr(path, "read"):
        name = _stream_name(path)
        suffix = known_suffix(name, file_format, is_stream=True)
        try:
            return name, suffix, bytes(path.read())
        except (OSError, TypeError) as error:
            raise MeshFileError(f"{name}: cannot be read: {error}; expected a stream of bytes") from error
    file = _as_path(path)
    try:
        suffix = "" if file.is_dir() else known_suffix(file, file_format)
        return str(file), suffix, file.read_bytes()
    except FileNotFoundError as error:
        raise MeshFileError(f"{file}: {why_unreadable(file, error)}; expected a mesh file") from error
    except IsADirectoryError as error:
        raise MeshFileError(f"{file}: is a folder; expected a mesh file") from error
    except OSError as error:
        raise MeshFileError(f"{file}: {why_unreadable(file, error)}") from error


def save(
    mesh: Any,
    path: str | os.PathLike[str] | BinaryIO,
    *,
    point_data: PointData | None = None,
    file_format: str | None = None,
) -> None:
    """Write a surface mesh with everything that it carries, a file atomically.

    Parameters
    ----------
    mesh
        A :class:`Mesh`, or whatever :func:`~anisomesh.io.convert.as_surface` takes.
    path
        The file, with one of the extensions of :func:`load`; an existing file is replaced. Or a stream that is open for
        writing bytes, together with ``file_format``.
    point_data
        Arrays (V,) or (V, k) by name, in addition.
    file_format
        The format, such as ``"ply"``, if the extension does not name it.

    Raises
    ------
    MeshFileError
        If the format is unknown, the folder is missing or cannot be written, the disk is full, an array of
        ``point_data`` has the wrong length or type, or a coordinate does not fit the format.
    MeshError
        If the object is not a mesh.

    Notes
    -----
    What the format cannot hold is left out and named in one warning in the log. OBJ, OFF, PLY, 3MF, VTU, VTP, MSH and
    MEDIT keep every float64 of the coordinates exactly, and so does STL with regions; STL without and GLB round to
    float32.
    """
    stream: Any = path if not isinstance(path, str | os.PathLike) and hasattr(path, "write") else None
    name = str(_as_path(path)) if stream is None else _stream_name(stream)
    mesh = mesh if isinstance(mesh, Mesh) else from_object(mesh)
    suffix = known_suffix(name, file_format, is_stream=stream is not None)
    if point_data:
        mesh = _with_point_data(mesh, name, point_data)
    losses = Losses()
    content = file_content(mesh, name, suffix, losses, in_file=stream is None)
    if stream is not None:
        stream.write(content)
    else:
        with atomic_path(name) as temporary:
            temporary.write_bytes(content)
    warn_of_losses(name, suffix, losses)


def _with_point_data(mesh: Mesh, path: str, point_data: PointData) -> Mesh:
    """Return a mesh with more point data, which replace data of the same name."""
    data = {}
    for key, values in point_data.items():
        if not isinstance(key, str) or not key:
            raise MeshFileError(f"{path}: {key!r} is not a name of point data")
        data[key] = _point_array(path, key, values, mesh.surface.n_points)
    corner_data = {key: values for key, values in mesh.corner_data.items() if key not in data}
    return replace(mesh, point_data={**mesh.point_data, **data}, corner_data=corner_data)


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
