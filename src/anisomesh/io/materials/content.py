"""The content of mesh files, with what they name beside them."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from anisomesh.attributes.model import Mesh
from anisomesh.errors import MeshFileError
from anisomesh.io.formats.units import in_unit_of
from anisomesh.io.holding.losses import Losses
from anisomesh.io.holding.values import without_unnamed
from anisomesh.io.known_formats import WRITERS
from anisomesh.io.materials import files as material_files
from anisomesh.io.materials import from_gltf
from anisomesh.io.materials.for_gltf import with_gltf_materials
from anisomesh.io.materials.textures import relative_name

logger = logging.getLogger(__name__)


def file_content(mesh: Mesh, name: str, suffix: str, losses: Losses, *, in_file: bool = True) -> bytes:
    """Return the content of a mesh file; the material file of an OBJ file is written beside it.

    Parameters
    ----------
    mesh
        The mesh.
    name
        The name of the file, or of a stream for messages.
    suffix
        The extension of the format.
    losses
        What is left out is added here.
    in_file
        Whether it is a file and not a stream.

    Raises
    ------
    MeshFileError
        If the format cannot hold the mesh.
    """
    folder = material_files.folder_of(name) if in_file else Path.cwd()
    mesh = in_unit_of(_named_from(mesh, folder, suffix, losses), suffix, losses)
    looks: dict[int, from_gltf.Look] = {}
    if suffix == ".glb":
        mesh = with_gltf_materials([mesh], losses)[0]
    elif suffix == ".3mf":
        mesh = from_gltf.with_3mf_materials(mesh, losses)
    elif suffix == ".obj" and in_file:
        mesh, looks = from_gltf.with_obj_materials(mesh, losses)
    else:
        mesh = from_gltf.without_mere_names(mesh, losses)
    try:
        content = WRITERS[suffix](mesh, losses)
    except ValueError as error:
        raise MeshFileError(f"{name}: cannot be written: {error}") from error
    if suffix == ".obj" and not looks:
        return material_files.write_beside(content, mesh, Path(name) if in_file else None, losses)
    return from_gltf.write_obj_library(looks, Path(name), losses) + content if looks else content


def levels_for_glb(meshes: Sequence[Mesh], path: Path, losses: Losses) -> list[Mesh]:
    """Return levels of detail, the finest first, as GLB holds them; what it cannot hold is said of the finest."""
    folder = material_files.folder_of(path)
    each = [losses, *(Losses() for _ in meshes[1:])]
    own = [
        in_unit_of(_named_from(mesh, folder, ".glb", kept), ".glb", kept)
        for mesh, kept in zip(meshes, each, strict=True)
    ]
    return with_gltf_materials(own, losses)


def _named_from(mesh: Mesh, folder: Path, suffix: str, losses: Losses) -> Mesh:
    """Return a mesh whose textures have the names of their files from a folder; data without a name are left out.

    Missing files of textures and such data are losses.
    """
    mesh = without_unnamed(mesh, losses)
    material_files.say_missing_textures(mesh, suffix, losses)
    return material_files.with_texture_names(mesh, lambda name: relative_name(name, folder))


def warn_of_losses(name: str, suffix: str, losses: Losses) -> None:
    """Log what was left out of a file, if anything was."""
    if losses.text():
        format_name = "MEDIT" if suffix in (".mesh", ".meshb") else suffix[1:].upper()
        logger.warning("%s: left out what %s cannot hold: %s", name, format_name, losses.text())
