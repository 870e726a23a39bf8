"""Reading and writing mesh files."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.errors import MeshFileError
from anisomesh.io import external, ply, polygons, stl, text_formats
from anisomesh.io.atomic import atomic_path
from anisomesh.mesh.surface import Surface

logger = logging.getLogger(__name__)

PointData = Mapping[str, npt.NDArray[Any]]

READERS: dict[str, Callable[[bytes], polygons.PolygonSoup]] = {
    ".obj": text_formats.read_obj,
    ".off": text_formats.read_off,
    ".ply": ply.read_ply,
    ".stl": stl.read_stl,
    ".glb": external.read_glb,
    ".mesh": text_formats.read_medit,
}
READERS_BY_PATH: dict[str, Callable[[Path], polygons.PolygonSoup]] = {
    ".vtu": external.read_vtu,
    ".msh": external.read_msh,
}
FORMATS = (*READERS, *READERS_BY_PATH)


def load(path: str | os.PathLike[str]) -> Surface:
    """Read a surface mesh.

    Parameters
    ----------
    path
        A file whose extension, in any case, names its format: .obj, .off, .ply, .stl, .glb, .vtu, .msh (Gmsh)
        or .mesh (MEDIT).

    Returns
    -------
    Surface
        The points in the order of the file, as float64, and the polygons as triangles. Nothing is repaired:
        unused points and degenerate faces are kept.

    Raises
    ------
    MeshFileError
        In one line that names the file, if there is no such file, the format is unknown, the file is empty,
        truncated or malformed, an index is out of range, a coordinate is not finite, or there is no face.

    Notes
    -----
    A quadrilateral is split along its shorter diagonal, larger polygons into fans. Lines and volume cells are
    left out. STL holds unconnected triangles; their corners are welded where they are equal, and the log
    says so.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if path.is_dir():
        raise MeshFileError(f"{path}: is a folder; expected a mesh file")
    if not path.exists():
        raise MeshFileError(f"{path}: no such file")
    if suffix not in FORMATS:
        raise MeshFileError(_unknown_format(path))
    try:
        data = path.read_bytes()
    except OSError as error:
        raise MeshFileError(f"{path}: cannot be read: {error.strerror or error}") from error
    if not data.strip():
        raise MeshFileError(f"{path}: the file is empty; expected a mesh")
    try:
        soup = READERS[suffix](data) if suffix in READERS else READERS_BY_PATH[suffix](path)
        polygons.check(soup)
        return Surface(soup.points, polygons.triangulate(soup))
    except Exception as error:
        # Readers say what is wrong as ValueError; anything else is a library stumbling over the file.
        reason = (
            str(error) if type(error) is ValueError else f"malformed or truncated ({type(error).__name__}: {error})"
        )
        reason = " ".join(reason.split())
        raise MeshFileError(f"{path}: cannot be read as {suffix[1:].upper()}: {reason}") from error


def save(surface: Surface, path: str | os.PathLike[str], *, point_data: PointData | None = None) -> None:
    """Write a surface mesh; the file appears only when it is complete.

    Parameters
    ----------
    surface
        What to write.
    path
        The file; its extension names the format, see :func:`load`. An existing file is replaced.
    point_data
        Arrays (V,) or (V, k) to write beside the points. VTU takes all of them, PLY scalars only; what a format
        cannot hold is left out and the log says so.

    Raises
    ------
    MeshFileError
        If the format is unknown, the folder is missing or cannot be written, the disk is full, or a coordinate
        does not fit the format.

    Notes
    -----
    OBJ, OFF, PLY, VTU, MSH and MEDIT keep every float64 exactly; STL and GLB round to float32.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise MeshFileError(_unknown_format(path))
    data = {name: np.asarray(values) for name, values in (point_data or {}).items()}
    for name, values in data.items():
        if len(values) != surface.n_points:
            raise MeshFileError(f"{path}: {name} has {len(values)} rows; expected one per point, {surface.n_points}")
    kept = {
        name: values for name, values in data.items() if suffix == ".vtu" or (suffix == ".ply" and values.ndim == 1)
    }
    for name in data.keys() - kept.keys():
        logger.warning("%s: left out the point data %r, which %s cannot hold", path, name, suffix[1:].upper())
    with atomic_path(path) as temporary:
        try:
            _write(surface, temporary, kept)
        except ValueError as error:
            raise MeshFileError(f"{path}: cannot be written: {error}") from error


def _write(surface: Surface, path: Path, data: dict[str, npt.NDArray[Any]]) -> None:
    points, faces = surface.points, surface.faces
    match path.suffix.lower():
        case ".obj":
            path.write_text(text_formats.obj_text(points, faces))
        case ".off":
            path.write_text(text_formats.off_text(points, faces))
        case ".mesh":
            path.write_text(text_formats.medit_text(points, faces))
        case ".ply":
            path.write_bytes(ply.ply_bytes(points, faces, data))
        case ".stl":
            path.write_bytes(stl.stl_bytes(points, faces))
        case ".glb":
            path.write_bytes(external.glb_bytes(points, faces))
        case ".vtu":
            external.write_vtu(path, points, faces, data)
        case _:
            external.write_msh(path, points, faces)


def _unknown_format(path: Path) -> str:
    return f"{path}: unknown format {path.suffix or '(no extension)'}; known are {', '.join(sorted(FORMATS))}"
