"""Writing of metrics at the points of a mesh to files."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from anisomesh._arrays import PointTensors
from anisomesh.attributes.model import Mesh
from anisomesh.errors import MeshFileError
from anisomesh.io.atomic import atomic_path
from anisomesh.io.carried import Array
from anisomesh.io.formats.medit.solution import sol_bytes, solb_bytes
from anisomesh.io.meshes import save
from anisomesh.mesh.surface import Surface

TENSOR_FORMATS = (".sol", ".solb", ".npy", ".vtu", ".vtp", ".ply", ".msh")
"""Extensions of files that hold a tensor at each point in float64."""


def save_tensors(
    surface: Surface, tensors: PointTensors, path: str | os.PathLike[str], others: Mapping[str, Array] | None = None
) -> None:
    """Write symmetric tensors at the points of a surface, atomically.

    Parameters
    ----------
    surface
        The surface.
    tensors
        Tensors (V, 3, 3).
    path
        A MEDIT solution (.sol, or .solb, which is binary) or an array of NumPy (.npy), which hold the tensors only; or
        .vtu, .vtp, .ply or .msh, which hold the surface too, with the tensors as point data ``metric`` of 9 components,
        row by row.
    others
        Further point data for the formats that hold the surface.

    Raises
    ------
    MeshFileError
        If the extension is another one, or the file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in TENSOR_FORMATS:
        raise MeshFileError(f"{path}: expected a file name ending in one of {', '.join(TENSOR_FORMATS)}")
    if suffix not in (".sol", ".solb", ".npy"):
        save(Mesh(surface=surface), path, point_data={"metric": tensors.reshape(-1, 9), **(others or {})})
        return
    with atomic_path(path) as temporary:
        if suffix == ".npy":
            np.save(temporary, tensors, allow_pickle=False)
        else:
            temporary.write_bytes(solb_bytes(tensors) if suffix == ".solb" else sol_bytes(tensors))
