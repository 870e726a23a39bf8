"""Materials of OBJ and 3MF as the ones of glTF: colours, opacity, and textures of colours with their images."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.carried import listed
from anisomesh.io.formats.gltf.read import MATERIAL, NO_MATERIAL
from anisomesh.io.formats.obj.attributes import LIBRARIES
from anisomesh.io.formats.region_names import in_words, region_texts
from anisomesh.io.formats.threemf.properties import TEXTURE, TEXTURES
from anisomesh.io.formats.threemf.textures import image_kind
from anisomesh.io.holding.losses import Losses
from anisomesh.io.materials.textures import texture_line

DISPLAYED = "display_colours"
"""Key of the display colours of 3MF by the labels of base materials."""

WRAPS = {"wrap": 10497, "mirror": 33648, "clamp": 33071, "none": 33071}
FILTERS = {"linear": 9729, "nearest": 9728}
"""Codes of glTF for how textures are repeated, and interpolated, by the words of 3MF."""

_OWN = {"gltf", "trimesh"}  # materials that GLB holds as they are


class _Look(NamedTuple):
    """A linear colour with opacity (4,), the image of a texture, and how it is repeated; empty where not known."""

    colour: tuple[float, ...] = ()
    image: bytes = b""
    sampler: tuple[tuple[str, int], ...] = ()


_Looks = dict[tuple[str, int], _Look]  # by division and label


def with_gltf_materials(meshes: Sequence[Mesh], losses: Losses) -> list[Mesh]:
    """Return meshes whose materials of OBJ or 3MF are materials of glTF, or the same meshes if the first has none.

    Parameters
    ----------
    meshes
        A mesh, and coarser levels of it, whose labels it has too.
    losses
        What has no place in glTF, such as highlights, is added, and images that are missing.

    Notes
    -----
    A texture takes the place of the colour of its material, and a 3MF texture the one of a base material.
    """
    meshes = [_without_unread(mesh, losses if mesh is meshes[0] else Losses()) for mesh in meshes]
    first = meshes[0]
    looks = {} if _OWN & first.materials.keys() else _looks_of_obj(first, losses) or _looks_of_3mf(first, losses)
    if not looks:
        return list(meshes)
    texts = {division: region_texts(first.regions[division], losses) for division, _ in looks}
    names = {k: texts[division][label] for k, (division, label) in enumerate(looks)}
    both = [np.isin(first.regions[d].labels, [label for name, label in looks if name == d]) for d in texts]
    if len(both) == 2 and (both[0] & both[1]).any():
        losses.say(f"the materials of {np.count_nonzero(both[0] & both[1])} face(s) that have a texture")
    gltf = _as_gltf(list(names.values()), list(looks.values()))
    return [_numbered(mesh, list(looks), names, gltf) for mesh in meshes]


def _without_unread(mesh: Mesh, losses: Losses) -> Mesh:
    """Return a mesh without the names of .mtl files whose content is not known; the same mesh if it has none."""
    obj = mesh.materials.get("obj")
    if not isinstance(obj, Mapping) or LIBRARIES not in obj or "text" in obj:
        return mesh
    if MATERIAL in mesh.regions:
        losses.say("the colours of materials, which are unknown since their .mtl files were not read")
    return replace(mesh, materials={name: one for name, one in mesh.materials.items() if name != "obj"})


def _numbered(mesh: Mesh, keys: list[tuple[str, int]], names: dict[int, str], gltf: dict[str, Any]) -> Mesh:
    """Return a mesh with materials of glTF, of which the numbers are labels."""
    labels = np.full(mesh.surface.n_faces, NO_MATERIAL, dtype=np.int64)
    for k, (division, label) in enumerate(keys):
        if division in mesh.regions:
            labels[mesh.regions[division].labels == label] = k
    divisions = {MATERIAL, *(division for division, _ in keys)}
    regions = {name: regions for name, regions in mesh.regions.items() if name not in divisions}
    materials = {name: one for name, one in mesh.materials.items() if name not in ("obj", TEXTURES, DISPLAYED)}
    return replace(mesh, regions={**regions, MATERIAL: Regions(labels, names)}, materials={**materials, "gltf": gltf})


def _looks_of_3mf(mesh: Mesh, losses: Losses) -> _Looks:
    """Return the looks of base materials and textures of a 3MF archive."""
    looks: _Looks = {}
    for division, key in ((MATERIAL, DISPLAYED), (TEXTURE, TEXTURES)):
        given, regions = mesh.materials.get(key, {}), mesh.regions.get(division)
        if regions is None or not isinstance(given, Mapping) or (division == TEXTURE and not given):
            continue
        for label in _labels(regions):
            known, look = given.get(label), _Look()
            if isinstance(known, str):
                look = _Look(colour=_linear(known))
            elif isinstance(known, Mapping) or division == TEXTURE:
                table = known if isinstance(known, Mapping) else {}
                look = _Look(image=_held_image(table.get("data"), regions, label, losses), sampler=_sampler(table))
            looks[division, label] = look
    return looks if any(look != _Look() for look in looks.values()) else {}


def _looks_of_obj(mesh: Mesh, losses: Losses) -> _Looks:
    """Return the looks of materials that .mtl files describe."""
    obj, regions = mesh.materials.get("obj"), mesh.regions.get(MATERIAL)
    if not isinstance(obj, Mapping) or not isinstance(text := obj.get("text"), str) or regions is None:
        return {}
    folder, told, lines = Path(obj.get("folder", "")), dict[str, dict[str, str]](), dict[str, str]()
    for line in text.split("\n"):
        word, _, rest = line.strip().partition(" ")
        if word.lower() == "newmtl":
            lines = told.setdefault(in_words(rest), {})
        elif word and not word.startswith("#"):
            lines[word] = line
    looks, others, options = {}, set[str](), set[str]()
    names = {label: regions.names.get(label, "") for label in _labels(regions)}
    if unknown := [name for name in names.values() if name and name not in told]:
        losses.say(f"the colours of {listed(list(map(repr, unknown)))}, which its .mtl files do not describe")
    for label, name in names.items():
        given = {word.lower(): line for word, line in told.get(name, {}).items()}
        colour = _numbers(given.pop("kd", ""))
        opacity = [*_numbers(given.pop("d", "")), *(1.0 - t for t in _numbers(given.pop("tr", ""))), 1.0][0]
        image = b""
        if "map_kd" in given:
            texture = texture_line(given.pop("map_kd"), folder)
            data = None if texture is None or texture.file is None else texture.file.read_bytes()
            image = _held_image(data, regions, label, losses)
            options.update(() if texture is None else texture.options)
        of_colour = (1.0, 1.0, 1.0) if image else colour if len(colour) == 3 else ()
        looks[MATERIAL, label] = _Look((*of_colour, opacity) if of_colour else (), image)
        others |= given.keys()
    if others:
        losses.say(f"the statements {', '.join(sorted(others))} of materials")
    if options:
        losses.say(f"the options {', '.join(sorted(options))} of map_Kd of materials")
    return looks


def _labels(regions: Regions) -> list[int]:
    """Return the labels of regions but 0 without a name, which stands for none."""
    return [label for label in np.unique(regions.labels).tolist() if label != 0 or label in regions.names]


def _numbers(line: str) -> tuple[float, ...]:
    """Return the shares of 1 behind the word of a line, none if there is anything else."""
    try:
        return tuple(min(max(float(word), 0.0), 1.0) for word in line.split()[1:])
    except ValueError:
        return ()


def _held_image(data: Any, regions: Regions, label: int, losses: Losses) -> bytes:
    """Return an image if GLB holds it."""
    if image_kind(data):
        return bytes(data)
    losses.say(f"the image of {regions.names.get(label, label)!r}, which is missing or neither PNG nor JPEG")
    return b""


def _linear(text: str) -> tuple[float, ...]:
    """Return a colour of sRGB such as #FF8000 or #FF8000FF as glTF has it."""
    try:
        shares = np.array([*bytes.fromhex(text.removeprefix("#")), 255][:4]) / 255.0
    except ValueError:
        return ()
    if len(shares) < 4:
        return ()
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)  # the curve of sRGB
    return (*linear[:3].tolist(), float(shares[3]))


def _sampler(texture: Mapping[str, Any]) -> tuple[tuple[str, int], ...]:
    """Return the sampler of a texture of 3MF."""
    wraps = (
        (key, WRAPS.get(texture.get(name, ""))) for key, name in (("wrapS", "tilestyleu"), ("wrapT", "tilestylev"))
    )
    filters = ((key, FILTERS.get(texture.get("filter", ""))) for key in ("magFilter", "minFilter"))
    return tuple((key, code) for key, code in (*wraps, *filters) if code is not None)


def _as_gltf(names: Sequence[str], looks: Sequence[_Look]) -> dict[str, Any]:
    """Return the lists of a glTF document, with the contents of images by their numbers."""
    images = list(dict.fromkeys(look.image for look in looks if look.image))
    samplers = list(dict.fromkeys(look.sampler for look in looks if look.sampler))
    textures = list(dict.fromkeys((look.image, look.sampler) for look in looks if look.image))
    materials = []
    for name, look in zip(names, looks, strict=True):
        surface: dict[str, Any] = {"metallicFactor": 0.0}
        if look.image:
            surface["baseColorTexture"] = {"index": textures.index((look.image, look.sampler))}
        if look.colour:
            surface["baseColorFactor"] = list(look.colour)
        is_seen_through = look.colour[3:] not in ((), (1.0,))
        materials.append(
            {"name": name, "pbrMetallicRoughness": surface, **({"alphaMode": "BLEND"} if is_seen_through else {})}
        )
    gltf: dict[str, Any] = {"materials": materials, "data": dict(enumerate(images))}
    if images:
        gltf["images"] = [{"mimeType": image_kind(image)} for image in images]
        gltf["textures"] = [
            {"source": images.index(image), **({"sampler": samplers.index(sampler)} if sampler else {})}
            for image, sampler in textures
        ]
    if samplers:
        gltf["samplers"] = [dict(sampler) for sampler in samplers]
    return gltf
