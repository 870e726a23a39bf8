"""Materials of glTF as the ones of OBJ and 3MF: colours, opacity, and textures of colours with their images."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.atomic import atomic_path
from anisomesh.io.formats.gltf.read import MATERIAL
from anisomesh.io.formats.gltf.write import given_materials
from anisomesh.io.formats.obj.attributes import LIBRARIES
from anisomesh.io.formats.region_names import in_words, is_number
from anisomesh.io.formats.threemf.properties import TEXTURE, TEXTURES
from anisomesh.io.formats.threemf.textures import image_kind
from anisomesh.io.holding.losses import EMPTY_REGIONS, Losses
from anisomesh.io.materials.files import is_file_name, write_library
from anisomesh.io.materials.for_gltf import DISPLAYED, FILTERS, WRAPS, with_gltf_materials
from anisomesh.io.objects.trimesh_scenes import TRIMESH

_COLOUR, _TEXTURED = "baseColorFactor", "baseColorTexture"
_PHYSICAL = "pbrMetallicRoughness"
_MOVED = "KHR_texture_transform"
_NO_WORDS = {"", "."}  # no names of files
_NOT_IN_FILE_NAMES = re.compile(r"[^\w.-]+")
_SUFFIXES = {"image/png": ".png", "image/jpeg": ".jpg"}


class Look(NamedTuple):
    """How a material of glTF looks: what OBJ and 3MF can hold of it.

    Attributes
    ----------
    name
        Its name, which no other material has.
    colour
        A linear colour with opacity (4,).
    image, file
        The image of a texture, or the name of its file; empty for none.
    image_name
        A name for the image.
    sampler
        How the texture is repeated and interpolated, as glTF has it.
    """

    name: str
    colour: tuple[float, ...]
    image: bytes = b""
    file: str = ""
    image_name: str = ""
    sampler: tuple[tuple[str, Any], ...] = ()


def looks_of(mesh: Mesh, losses: Losses) -> dict[int, Look]:
    """Return the looks of the materials of glTF, or of trimesh, of a mesh by their labels; none if all are mere names.

    What OBJ and 3MF have no place for is added to the losses.
    """
    regions, gltf = mesh.regions.get(MATERIAL), given_materials(mesh)
    given = gltf.get("materials", [])
    tables = [table if isinstance(table, Mapping) else {} for table in given]
    if regions is None or not any(_physical(table).keys() & {_COLOUR, _TEXTURED} for table in tables):
        return {}
    used = set(np.unique(regions.labels).tolist())
    names: dict[int, str] = {}
    for label, table in enumerate(tables):
        name = in_words(regions.names.get(label, "") or str(table.get("name", ""))) or f"region_{label}"
        names[label] = f"{name}_{label}" if name in names.values() else name
        if names[label] != name and label in used:
            losses.renamed(name, names[label])
    looks = {label: _look(names[label], table, gltf, losses) for label, table in enumerate(tables)}
    _say_others([table for label, table in enumerate(tables) if label in used], losses)
    return looks


def without_mere_names(mesh: Mesh, losses: Losses) -> Mesh:
    """Return a mesh without materials of glTF if these have neither colours nor textures: regions have their names.

    Their other properties are added to the losses.
    """
    regions, gltf = mesh.regions.get(MATERIAL), mesh.materials.get("gltf")
    if regions is None or not isinstance(gltf, Mapping) or gltf.get("images"):
        return mesh
    tables = [table if isinstance(table, Mapping) else {} for table in gltf.get("materials", [])]
    if any(_physical(table).keys() & {_COLOUR, _TEXTURED} for table in tables):
        return mesh
    used = set(np.unique(regions.labels).tolist())
    _say_others([table for label, table in enumerate(tables) if label in used], losses)
    names = {label: str(table["name"]) for label, table in enumerate(tables) if table.get("name")}
    losses.add(EMPTY_REGIONS, *(name for label, name in names.items() if label not in used))
    given = {label: name for label, name in names.items() if label in used}
    materials = {name: one for name, one in mesh.materials.items() if name != "gltf"}
    divisions = {**mesh.regions, MATERIAL: Regions(regions.labels, {**given, **regions.names})}
    return replace(mesh, regions=divisions, materials=materials)


def _say_others(tables: Sequence[Mapping[str, Any]], losses: Losses) -> None:
    """Add to the losses the properties of materials that looks do not have."""
    others = sorted({key for table in tables for key in _others(table)})
    if others:
        losses.say(f"the properties {', '.join(others)} of materials")


def _physical(table: Mapping[str, Any]) -> Mapping[str, Any]:
    found = table.get(_PHYSICAL, {})
    return found if isinstance(found, Mapping) else {}


def _others(table: Mapping[str, Any]) -> Iterator[str]:
    """Yield the properties of a material that its look does not have, unless they are as of matt surfaces."""
    usual: dict[str, tuple[Any, ...]] = {
        "alphaMode": ("OPAQUE", "BLEND"),
        "doubleSided": (False,),
        "extras": ({}, [], None),
    }
    yield from (key for key in table if key not in ("name", _PHYSICAL) and table[key] not in usual.get(key, ()))
    for key, value in _physical(table).items():
        if key not in (_COLOUR, _TEXTURED) and (key, value) not in (("metallicFactor", 0), ("roughnessFactor", 1)):
            yield key


def _look(name: str, table: Mapping[str, Any], gltf: Mapping[str, Any], losses: Losses) -> Look:
    """Return the look of a material; its opacity counts if it is blended."""
    physical = _physical(table)
    colour = _rgba(physical.get(_COLOUR))
    if table.get("alphaMode", "OPAQUE") == "OPAQUE":
        colour = (*colour[:3], 1.0)
    look = Look(name, colour)
    if _TEXTURED not in physical:
        return look
    try:
        texture = physical[_TEXTURED]
        if texture.get("texCoord", 0):
            raise ValueError("it has texture coordinates of its own")
        if others := texture.get("extensions", {}):
            raise ValueError("it has a texture transform" if _MOVED in others else f"it has {', '.join(others)}")
        found = gltf["textures"][texture["index"]]
        samplers = gltf.get("samplers", [])
        sampler = samplers[found["sampler"]] if "sampler" in found else {}
        number = found["source"]
        image = gltf["images"][number]
        data, uri = gltf.get("data", {}).get(number, b""), str(image.get("uri", ""))
        if uri.startswith("data:"):
            data, uri = base64.b64decode(uri.partition(",")[2]), ""
        if not (is_file_name(image) or (not uri and image_kind(data))):
            raise ValueError("its image is missing or neither PNG nor JPEG")
        stem = str(image.get("name", "")) or name
        return look._replace(image=data, file=unquote(uri), image_name=stem, sampler=tuple(sorted(sampler.items())))
    except (LookupError, TypeError, AttributeError, ValueError) as error:
        reason = str(error) if type(error) is ValueError else "it is missing"
        losses.say(f"the texture of {name!r}: {reason}")
        return look


def _rgba(given: Any) -> tuple[float, ...]:
    """Return a colour with opacity (4,), white if it is none."""
    try:
        numbers = np.ravel(np.array(given, dtype=np.float64))
    except (TypeError, ValueError):
        return (1.0,) * 4
    is_colour = numbers.shape == (4,) and np.isfinite(numbers).all()
    return tuple(np.clip(numbers, 0.0, 1.0).tolist()) if is_colour else (1.0,) * 4


def with_obj_materials(mesh: Mesh, losses: Losses) -> tuple[Mesh, dict[int, Look]]:
    """Return a mesh without materials of glTF, trimesh and 3MF, and their looks; the same mesh if it has none.

    Materials have the names of their looks.
    """
    if "obj" in mesh.materials:
        return mesh, {}
    given, mesh = mesh, with_gltf_materials([mesh], losses)[0]
    looks = looks_of(mesh, losses)
    if not looks:
        return without_mere_names(given, losses), {}
    regions = mesh.regions[MATERIAL]
    present = set(np.unique(regions.labels).tolist())
    names = {**regions.names, **{label: look.name for label, look in looks.items() if label in present}}
    divisions = {**mesh.regions, MATERIAL: Regions(regions.labels, names)}
    materials = {name: one for name, one in mesh.materials.items() if name not in ("gltf", TRIMESH)}
    return replace(mesh, regions=divisions, materials=materials), looks


def write_obj_library(looks: Mapping[int, Look], path: Path, losses: Losses) -> bytes:
    """Write materials and their images beside an OBJ file, and return the line that names the file of materials.

    Parameters
    ----------
    looks
        The materials.
    path
        The OBJ file.
    losses
        Samplers are added that OBJ cannot hold.

    Notes
    -----
    An image has the name that it has in glTF, and a number if another file has that name; a file with the same content
    is used again.
    """
    lines, clamped = [], False
    for look in looks.values():
        red, green, blue, opacity = look.colour
        lines += [f"newmtl {look.name}", f"Kd {red!r} {green!r} {blue!r}", f"d {opacity!r}"]
        file = _written_image(look, path) if look.image else look.file
        lines += [f"map_Kd {file}"] if file else []
        clamped |= bool(file) and any(key.startswith("wrap") and code != WRAPS["wrap"] for key, code in look.sampler)
    if clamped:
        losses.say("how textures end at their borders, for which the file repeats them")
    name = write_library("\n".join([*lines, ""]), path)
    return f"{LIBRARIES} {name}\n".encode()


def _written_image(look: Look, path: Path) -> str:
    """Write an image into the folder of a file unless it is there, and return its name."""
    suffix = _SUFFIXES[image_kind(look.image)]
    stem = _NOT_IN_FILE_NAMES.sub("_", look.image_name)
    stem = stem[: -len(suffix)] if stem.lower().endswith(suffix) else stem
    stem = "texture" if stem.strip("_") in _NO_WORDS else stem
    number = 0
    while True:
        target = path.parent / (f"{stem}_{number}{suffix}" if number else f"{stem}{suffix}")
        if not target.exists():
            with atomic_path(target) as temporary:
                temporary.write_bytes(look.image)
            return target.name
        if target.is_file() and target.read_bytes() == look.image:
            return target.name
        number += 1


def with_3mf_materials(mesh: Mesh, losses: Losses) -> Mesh:
    """Return a mesh whose materials of glTF or OBJ are base materials and textures of 3MF; the same if it has none.

    Notes
    -----
    A texture takes the place of the colour of its material. Colours are sRGB in 3MF, of 8 bits.
    """
    if mesh.materials.keys() & {DISPLAYED, TEXTURES}:
        return mesh
    mesh = with_gltf_materials([mesh], losses)[0]
    looks = looks_of(mesh, losses)
    if not looks:
        return without_mere_names(mesh, losses)
    elsewhere = [look.name for look in looks.values() if look.file and not look.image]
    if elsewhere:
        losses.say(f"the textures of {', '.join(map(repr, elsewhere))}, which are in other files")
    labels = mesh.regions[MATERIAL].labels
    known = np.where((labels >= 0) & (labels < len(looks)), labels + 1, 0)  # 0 stands for none
    textured = np.isin(known, [label + 1 for label, look in looks.items() if look.image])
    if labels.max() >= len(looks):
        losses.add("regions", MATERIAL)
    regions = {name: division for name, division in mesh.regions.items() if name != MATERIAL}
    materials = {name: one for name, one in mesh.materials.items() if name not in ("gltf", TRIMESH)}
    names = {label + 1: look.name for label, look in looks.items() if not is_number(look.name)}
    if not textured.all():
        plain = np.where(textured, 0, known)
        regions[MATERIAL] = Regions(plain, {k: text for k, text in names.items() if k in plain})
        materials[DISPLAYED] = {label + 1: _displayed(look.colour) for label, look in looks.items()}
    if textured.any():
        of_textures = np.where(textured, known, 0)
        images = {label + 1: look for label, look in looks.items() if look.image}
        texts = {k: look.name + _SUFFIXES[image_kind(look.image)] for k, look in images.items() if k in of_textures}
        regions[TEXTURE] = Regions(of_textures, texts)
        materials[TEXTURES] = {k: _table(look) for k, look in images.items()}
    return replace(mesh, regions=regions, materials=materials)


def _displayed(colour: tuple[float, ...]) -> str:
    """Return a linear colour with opacity (4,) as a colour of sRGB such as #FF8000FF."""
    linear = np.array(colour[:3])
    shares = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)  # the curve of sRGB
    numbers = np.rint(255.0 * np.array([*shares, colour[3]])).astype(int)
    return "#" + bytes(numbers.tolist()).hex().upper()


def _table(look: Look) -> dict[str, Any]:
    """Return a texture of 3MF."""
    sampler = dict(look.sampler)
    wraps = {code: name for name, code in reversed(WRAPS.items())}
    filters = {code: name for name, code in FILTERS.items()}
    found = {
        "tilestyleu": wraps.get(sampler.get("wrapS", 0)),
        "tilestylev": wraps.get(sampler.get("wrapT", 0)),
        "filter": filters.get(sampler.get("magFilter", 0)),
    }
    return {"data": look.image, **{key: value for key, value in found.items() if value}}
