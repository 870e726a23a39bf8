"""Surfaces from what other libraries call a mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.errors import MeshError
from anisomesh.mesh.surface import Surface


def as_surface(mesh: Any, faces: npt.NDArray[Any] | None = None) -> Surface:
    """Return a :class:`Surface` from points and faces, a surface, a ``trimesh.Trimesh`` or a ``pyvista.PolyData``.

    Raises
    ------
    MeshError
        If the object is none of these, or has faces that are no triangles.
    """
    if isinstance(mesh, Surface):
        return mesh
    if faces is not None:
        return Surface(np.asarray(mesh), np.asarray(faces))
    if hasattr(mesh, "regular_faces"):  # pyvista
        if not mesh.is_all_triangles:
            raise MeshError("the PyVista mesh has faces that are no triangles; call its triangulate() first")
        return Surface(np.asarray(mesh.points), np.asarray(mesh.regular_faces))
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):  # trimesh
        return Surface(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    raise MeshError(
        f"cannot read a mesh from {type(mesh).__name__}; expected points and faces, a Surface, a trimesh.Trimesh or a "
        "pyvista.PolyData"
    )
