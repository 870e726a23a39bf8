"""Conversion of arrays and of the mesh objects of other libraries to surfaces."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.errors import MeshError
from anisomesh.io.objects import polygon_soup
from anisomesh.io.polygons import as_triangles
from anisomesh.mesh.surface import Surface

logger = logging.getLogger(__name__)


def as_surface(mesh: Any, faces: npt.NDArray[Any] | None = None) -> Surface:
    """Convert a mesh to a :class:`Surface`.

    Parameters
    ----------
    mesh
        Points (V, 3) together with ``faces``, or a :class:`Surface`, a ``trimesh.Trimesh`` or ``trimesh.Scene``, a
        ``meshio.Mesh``, or a data set of PyVista: ``PolyData``, ``UnstructuredGrid``, ``MultiBlock``, ...
    faces
        Point indices (F, 3) if ``mesh`` is an array of points.

    Raises
    ------
    MeshError
        If the object is none of these, has no surface cells or some of unknown type, or its arrays are not a mesh.

    Notes
    -----
    Polygons and cells of higher order become triangles as in :func:`~anisomesh.io.meshes.load`.
    """
    if faces is not None:
        if isinstance(mesh, Surface):
            raise MeshError("the mesh is a Surface and has faces; leave out the second argument")
        return Surface(mesh, faces)
    if isinstance(mesh, Surface):
        return mesh
    name = type(mesh).__name__
    try:
        soup = polygon_soup(mesh)
        if soup is not None:
            triangles = as_triangles(soup)
            for remark in triangles.remarks:
                logger.warning("%s: %s", name, remark)
            return triangles.surface
    except ValueError as error:
        raise MeshError(f"cannot read a surface from {name}: {error}") from error
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):  # trimesh
        return Surface(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    raise MeshError(
        f"cannot read a mesh from {name}; expected points and faces, a Surface, or an object of trimesh, meshio or "
        "PyVista"
    )
