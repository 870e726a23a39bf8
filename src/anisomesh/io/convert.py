"""Conversion of arrays and of the mesh objects of other libraries to surfaces."""

from __future__ import annotations

import logging
from typing import Any

import numpy.typing as npt

from anisomesh.attributes.model import Mesh
from anisomesh.errors import MeshError
from anisomesh.io.assemble import as_mesh
from anisomesh.io.objects.read import polygon_soup
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
    return _converted(mesh, faces)[0].surface


def from_object(mesh: Any, faces: npt.NDArray[Any] | None = None) -> Mesh:
    """Convert what :func:`as_surface` takes to a mesh with everything that the object carries.

    Raises
    ------
    MeshError
        As :func:`as_surface`.

    Notes
    -----
    Data have the names that :func:`~anisomesh.io.meshes.load_mesh` gives them. Attributes that are broken, or that a
    :class:`Mesh` cannot hold, are left out, with a line each in the log.
    """
    converted, losses = _converted(mesh, faces)
    for loss in losses:
        logger.warning("%s: %s", type(mesh).__name__, loss)
    return converted


def _converted(mesh: Any, faces: npt.NDArray[Any] | None) -> tuple[Mesh, tuple[str, ...]]:
    """Return a mesh, and what was left out of its attributes."""
    if faces is not None:
        if isinstance(mesh, Surface):
            raise MeshError("the mesh is a Surface and has faces; leave out the second argument")
        return Mesh(surface=Surface(mesh, faces)), ()
    if isinstance(mesh, Surface):
        return Mesh(surface=mesh), ()
    name = type(mesh).__name__
    try:
        soup = polygon_soup(mesh)
        found = None if soup is None else as_mesh(soup)
    except ValueError as error:
        raise MeshError(f"cannot read a surface from {name}: {error}") from error
    if found is None:
        raise MeshError(
            f"cannot read a mesh from {name}; expected a Surface, as Surface(points, faces) of two arrays, or an "
            "object of trimesh, meshio or PyVista"
        )
    converted, remarks, losses = found
    for remark in remarks:
        logger.warning("%s: %s", name, remark)
    return converted, losses
