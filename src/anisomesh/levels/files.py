"""Files of levels of detail: one for each level, or one for all where the format has levels."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from anisomesh.attributes.model import Mesh
from anisomesh.errors import MeshFileError
from anisomesh.io.atomic import atomic_paths
from anisomesh.io.formats.gltf.write import glb_levels_bytes
from anisomesh.io.holding.losses import Losses
from anisomesh.io.known_formats import known_suffix
from anisomesh.io.materials.content import file_content, levels_for_glb, warn_of_losses


def level_paths(path: str | os.PathLike[str], count: int, file_format: str | None = None) -> list[Path]:
    """Return the files of a number of levels: ``out.lod0.ply``, ``out.lod1.ply``, ...; for GLB the file itself.

    Raises
    ------
    MeshFileError
        If the format is unknown.
    """
    path = Path(path)
    if known_suffix(path, file_format) == ".glb":
        return [path]
    return [path.with_name(f"{path.stem}.lod{k}{path.suffix}") for k in range(count)]


def save_meshes(meshes: Sequence[Mesh], path: str | os.PathLike[str], *, file_format: str | None = None) -> list[Path]:
    """Write levels of detail, the finest first, all or none of their files.

    Parameters
    ----------
    meshes
        The levels.
    path, file_format
        The file, and its format if the suffix does not name it; see :func:`level_paths`. Existing files are replaced.

    Returns
    -------
    list of Path
        The files that were written.

    Raises
    ------
    MeshFileError
        As for :func:`anisomesh.io.meshes.save`.

    Notes
    -----
    Levels in OBJ share one material file, named as ``path``. What the format cannot hold is said once, of the finest.
    """
    paths, suffix = level_paths(path, len(meshes), file_format), known_suffix(Path(path), file_format)
    losses = Losses()
    each = [losses, *(Losses() for _ in meshes[1:])]
    with atomic_paths(paths) as temporaries:
        if suffix == ".glb":
            contents = [_glb_content(meshes, Path(path), losses)]
        else:
            contents = [file_content(mesh, str(path), suffix, kept) for mesh, kept in zip(meshes, each, strict=True)]
        for temporary, content in zip(temporaries, contents, strict=True):
            temporary.write_bytes(content)
    warn_of_losses(str(path), suffix, losses)
    return paths


def _glb_content(meshes: Sequence[Mesh], path: Path, losses: Losses) -> bytes:
    try:
        return glb_levels_bytes(levels_for_glb(meshes, path, losses), losses)
    except ValueError as error:
        raise MeshFileError(f"{path}: cannot be written: {error}") from error
