"""Files beside mesh files: materials of OBJ (.mtl), and textures."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

from anisomesh.attributes.model import Mesh
from anisomesh.io.atomic import atomic_path
from anisomesh.io.formats.obj.attributes import LIBRARIES
from anisomesh.io.formats.words import BYTE_ORDER_MARK, text_of, with_line_feeds
from anisomesh.io.holding.losses import Losses
from anisomesh.io.materials import textures
from anisomesh.io.materials.textures import absolute_name, is_file, is_in_text

_MARK = "# materials of a mesh that anisomesh has written\n"


def read_beside(mesh: Mesh, path: Path) -> tuple[Mesh, tuple[str, ...]]:
    """Return a mesh with the text and the folder of its material files, and what is missing, a line each."""
    folder = folder_of(path)
    mesh = with_texture_names(mesh, lambda name: absolute_name(name, folder))
    given = mesh.materials.get("obj")
    if given is None:
        return mesh, ()
    texts, losses = [], []
    for name in _names(given[LIBRARIES], folder):
        file = folder / name
        try:
            if file.suffix.lower() != ".mtl":
                raise OSError("expected a .mtl file")
            text = _library_text(file)
            texts.append(text if file.parent == folder else textures.moved(text, file.parent, folder, Losses()))
        except (OSError, ValueError) as error:
            losses.append(f"left out the materials of {name!r}: {getattr(error, 'strerror', None) or error}")
    found = {**given, "text": "\n".join(texts), "folder": str(folder)} if texts else given
    return replace(mesh, materials={**mesh.materials, "obj": found}), tuple(losses)


def _library_text(file: Path) -> str:
    """Return the text of a material file, with line feeds at the ends of its lines; each is decoded like names."""
    lines = with_line_feeds(file.read_bytes().removeprefix(BYTE_ORDER_MARK)).split(b"\n")
    return "\n".join(map(text_of, lines))


def folder_of(path: str | os.PathLike[str]) -> Path:
    """Return the folder of a file, without links."""
    return Path(os.path.realpath(Path(path).parent))


def with_texture_names(mesh: Mesh, rename: Callable[[str], str]) -> Mesh:
    """Return a mesh with other names of the textures that comments of PLY and images of GLB name."""
    materials = dict(mesh.materials)
    names, gltf = materials.get("texture_files"), materials.get("gltf")
    if isinstance(names, tuple | list):
        materials["texture_files"] = tuple(rename(str(name)) for name in names)
    if isinstance(gltf, Mapping) and any(is_file_name(image) for image in gltf.get("images", ())):
        images = [
            {**image, "uri": quote(rename(unquote(image["uri"])))} if is_file_name(image) else image
            for image in gltf["images"]
        ]
        materials["gltf"] = {**gltf, "images": images}
    return replace(mesh, materials=materials)


def is_file_name(image: Mapping[str, Any]) -> bool:
    """Return whether an image is in a file, not in a view or in the text itself."""
    return isinstance(image.get("uri"), str) and not is_in_text(image["uri"])


def say_missing_textures(mesh: Mesh, suffix: str, losses: Losses) -> None:
    """Add to the losses the files of textures that are missing, of the ones that a format names.

    ``suffix`` is the extension of the format. A name is known to be from a folder if it is absolute.
    """
    names: list[str] = []

    def take(name: str) -> str:
        names.append(name)
        return name

    key = {".ply": "texture_files", ".glb": "gltf", ".obj": "gltf"}.get(suffix)
    with_texture_names(replace(mesh, materials={k: one for k, one in mesh.materials.items() if k == key}), take)
    textures.say_missing((Path(n).name for n in names if Path(n).is_absolute() and not is_file(Path(n))), losses)


def _names(libraries: tuple[str, ...], folder: Path) -> list[str]:
    """Return the names of files in lines, in each of which there may be several, or one with spaces."""
    names = []
    for line in libraries:
        names += [line] if (folder / line).exists() or not line.lower().count(".mtl ") else line.split()
    return names


def write_beside(content: bytes, mesh: Mesh, path: Path | None, losses: Losses) -> bytes:
    """Return the content of an OBJ file with the name of its material file, which is written beside it.

    Parameters
    ----------
    content
        The content without materials.
    mesh
        The mesh.
    path
        The OBJ file; None for a stream, beside which nothing can be written.
    losses
        What is left out is added here.

    Notes
    -----
    In the folder of the input its material files are named again. Elsewhere their content is written to a file with the
    stem of the OBJ file, and textures are named by paths relative to it; they are not copied.
    """
    given = mesh.materials.get("obj")
    if not isinstance(given, Mapping) or LIBRARIES not in given:
        losses.add("materials", *(["obj"] if "obj" in mesh.materials else []))
        return content
    libraries = given[LIBRARIES]
    if "text" not in given or path is None:
        if "text" in given:
            losses.say("the content of material files, since a stream has no folder; it only names them")
    elif str(folder := folder_of(path)) != given.get("folder", ""):
        libraries = (write_library(textures.moved(given["text"], Path(given.get("folder", "")), folder, losses), path),)
    lines = "".join(f"{LIBRARIES} {name}\n" for name in libraries)
    return lines.encode("utf-8", errors="replace") + content


def write_library(text: str, path: Path) -> str:
    """Write materials to a file with the stem of an OBJ file beside it, and return its name."""
    target = _free_name(folder_of(path), path.stem)
    with atomic_path(target) as temporary:
        temporary.write_text(_MARK + text, encoding="utf-8", errors="surrogateescape", newline="")
    return target.name


def _free_name(folder: Path, stem: str) -> Path:
    """Return a name that no file of the user has; a file of ours is replaced."""
    number = 0
    while True:
        target = folder / (f"{stem}_{number}.mtl" if number else f"{stem}.mtl")
        if not target.exists() or (target.is_file() and target.read_bytes().startswith(_MARK.encode())):
            return target
        number += 1
