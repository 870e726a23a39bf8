"""Formats read and written by meshio (VTU, Gmsh MSH) and trimesh (GLB).

Readers raise ValueError with an explanation where a file is wrong; what the libraries print goes to the log.
"""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Callable, Mapping
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh.io.gmsh_counts import check_counts
from anisomesh.io.polygons import PolygonSoup

logger = logging.getLogger(__name__)


def read_vtu(path: Path) -> PolygonSoup:
    """Read the triangles, quadrilaterals and polygons of a VTK unstructured grid."""
    import meshio

    return _surface_cells(_quietly(lambda: meshio.vtu.read(path)))


def read_msh(path: Path) -> PolygonSoup:
    """Read the triangles and quadrilaterals of a Gmsh file, version 2.2, 4.0 or 4.1."""
    import meshio

    check_counts(path.read_bytes())
    return _surface_cells(_quietly(lambda: meshio.gmsh.read(path)))


def read_glb(data: bytes) -> PolygonSoup:
    """Read all meshes of a binary glTF scene, with the transformations of the scene applied."""
    import trimesh

    declared = int.from_bytes(data[8:12], "little")
    if data[:4] != b"glTF":
        raise ValueError("it does not begin with the word glTF as a GLB file does")
    if declared > len(data):
        raise ValueError(f"truncated: it declares {declared} bytes but has {len(data)}")
    scene = _quietly(lambda: trimesh.load_scene(io.BytesIO(data), file_type="glb", process=False))
    meshes = [mesh for mesh in _quietly(scene.dump) if isinstance(mesh, trimesh.Trimesh)]
    if not meshes:
        raise ValueError("it has no face")
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    points = np.concatenate([np.asarray(mesh.vertices, dtype=np.float64) for mesh in meshes])
    faces = [np.asarray(mesh.faces, dtype=np.int64) + start for mesh, start in zip(meshes, first, strict=False)]
    return PolygonSoup.from_array(points, np.concatenate(faces))


def write_vtu(path: Path, points: Points, faces: Faces, point_data: Mapping[str, npt.NDArray[Any]]) -> None:
    """Write a compressed VTK unstructured grid in float64, with data per point."""
    import meshio

    mesh = meshio.Mesh(points, [("triangle", faces)], point_data=dict(point_data))
    _quietly(lambda: meshio.vtu.write(path, mesh))


def write_msh(path: Path, points: Points, faces: Faces) -> None:
    """Write a binary Gmsh file, version 2.2, in float64."""
    import meshio

    tags = [np.ones(len(faces), dtype=np.int32)]
    mesh = meshio.Mesh(points, [("triangle", faces)], cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags})
    _quietly(lambda: meshio.gmsh.write(path, mesh, fmt_version="2.2", binary=True))


def glb_bytes(points: Points, faces: Faces) -> bytes:
    """Return the content of a binary glTF file; coordinates are rounded to float32."""
    import trimesh

    if float(np.abs(points).max()) > float(np.finfo(np.float32).max):
        raise ValueError("coordinates beyond 3.4e38 do not fit the float32 of GLB; use PLY instead")
    mesh = trimesh.Trimesh(points, faces, process=False, validate=False)
    return bytes(_quietly(lambda: mesh.export(file_type="glb")))


def _surface_cells(mesh: Any) -> PolygonSoup:
    """Return the triangles, quadrilaterals and polygons of a meshio mesh."""
    points = np.asarray(mesh.points, dtype=np.float64)
    points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    blocks = [
        np.asarray(block.data, dtype=np.int64).reshape(len(block.data), -1)
        for block in mesh.cells
        if block.type in ("triangle", "quad") or block.type.startswith("polygon")
    ]
    others = sorted({block.type for block in mesh.cells if len(block.data)})
    if not any(len(block) for block in blocks) and others:
        raise ValueError(f"it has only cells of type {', '.join(others)} and no surface; extract the boundary first")
    return PolygonSoup(
        points=points,
        corners=np.concatenate([np.zeros(0, dtype=np.int64), *(block.ravel() for block in blocks)]),
        sizes=np.concatenate([np.zeros(0, dtype=np.int64), *(np.full(len(b), b.shape[1]) for b in blocks)]),
    )


def _quietly(call: Callable[[], Any]) -> Any:
    """Call a library function, log what it prints, and turn SystemExit into ValueError."""
    output = io.StringIO()
    try:
        with redirect_stdout(output), redirect_stderr(output), warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            return call()
    except SystemExit as error:
        raise ValueError(" ".join(output.getvalue().split()) or "the library cannot read the file") from error
    finally:
        if output.getvalue():
            logger.debug("%s", output.getvalue())
