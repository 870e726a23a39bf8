"""Conversion of arrays and of the mesh objects of other libraries to surfaces."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.errors import MeshError
from anisomesh.mesh.surface import Surface


def as_surface(mesh: Any, faces: npt.NDArray[Any] | None = None) -> Surface:
    """Convert a mesh to a :class:`Surface`.

    Parameters
    ----------
    mesh
        Points (V, 3) together with ``faces``, or a :class:`Surface`, a ``trimesh.Trimesh`` or a ``pyvista.PolyData``.
    faces
        Point indices (F, 3) if ``mesh`` is an array of points.

    Raises
    ------
    MeshError
        If the object is none of these, has faces other than triangles, or its arrays are not a mesh.
    """
    if faces is not None:
        if isinstance(mesh, Surface):
            raise MeshError("the mesh is a Surface and has faces; leave out the second argument")
        return Surface(mesh, faces)
    if isinstance(mesh, Surface):
        return mesh
    if hasattr(mesh, "regular_faces"):  # pyvista
        if not mesh.is_all_triangles:
            raise MeshError("the PyVista mesh has faces other than triangles; call its triangulate() first")
        return Surface(np.asarray(mesh.points), np.asarray(mesh.regular_faces))
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):  # trimesh
        return Surface(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    raise MeshError(
        f"cannot read a mesh from {type(mesh).__name__}; expected points and faces, a Surface, a trimesh.Trimesh or a "
        "pyvista.PolyData"
    )
