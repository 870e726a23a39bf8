"""Groups of materials, colours and texture coordinates of 3MF, which triangles refer to by their numbers.

Format: https://github.com/3MFConsortium/spec_materials/blob/master/3MF%20Materials%20Extension.md.
"""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from anisomesh.io.carried import Array

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
MATERIALS = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"

NONE = -1
"""No group or member of properties."""

TEXTURE_ATTRIBUTES = ("contenttype", "tilestyleu", "tilestylev", "filter")
"""What a texture says besides its number and the part of the archive with its image."""

_LEFT_OUT = {"compositematerials", "multiproperties"}
_LARGEST_ATTRIBUTE = 2**62
_MAX_SHOWN = 20  # characters of an attribute in a message


def number(text: str) -> int:
    """Return the number of a group or a member, :data:`NONE` for other text."""
    return int(text) if text.isdecimal() and len(text) < 18 else NONE


def real_attributes(attributes: Mapping[str, str], *keys: str) -> list[float]:
    """Return attributes that are real numbers; KeyError if one is missing, ValueError if it is not a number."""
    try:
        return [float(attributes[key]) for key in keys]
    except ValueError:
        raise ValueError(_wrong(attributes, keys, "numbers")) from None


def integer_attributes(attributes: Mapping[str, str], *keys: str) -> list[int]:
    """Return attributes that are integers; KeyError if one is missing, ValueError if it is not an integer."""
    try:
        found = [int(attributes[key]) for key in keys]
    except ValueError:
        raise ValueError(_wrong(attributes, keys, "integers")) from None
    if max(map(abs, found)) > _LARGEST_ATTRIBUTE:
        raise ValueError(_wrong(attributes, keys, "smaller integers"))
    return found


def _wrong(attributes: Mapping[str, str], keys: Sequence[str], expected: str) -> str:
    given = " ".join(f"{key}={attributes[key][:_MAX_SHOWN]!r}" for key in dict.fromkeys(keys))
    return f"it reads {given}; expected {expected}"


@dataclass
class TextureGroup:
    """Texture coordinates u and v in turn, and the number of the texture that they belong to."""

    texture: int
    numbers: array[float] = field(default_factory=lambda: array("d"))

    @property
    def coordinates(self) -> Array:
        """The coordinates (n, 2), the origin at the lower left."""
        return np.array(self.numbers, dtype=np.float64).reshape(-1, 2)


@dataclass
class Resources:
    """The groups of a model by number.

    Attributes
    ----------
    materials
        Names and display colours of base materials.
    colours
        Colours without names.
    textures
        Attributes of textures.
    texture_groups
        Groups of texture coordinates.
    ignored
        Names of elements that are left out.
    """

    materials: dict[int, list[tuple[str, str]]] = field(default_factory=dict)
    colours: dict[int, list[str]] = field(default_factory=dict)
    textures: dict[int, dict[str, str]] = field(default_factory=dict)
    texture_groups: dict[int, TextureGroup] = field(default_factory=dict)
    ignored: set[str] = field(default_factory=set)
    _group: int = NONE

    def take(self, namespace: str, element: str, attributes: dict[str, str]) -> None:
        """Take an element of the core or of the materials extension, unless it is none of the ones above."""
        if namespace == MATERIALS:
            self._take_extension(element, attributes)
        elif namespace == CORE and element == "basematerials":
            self._group = number(attributes.get("id", ""))
            self.materials[self._group] = []
        elif namespace == CORE and element == "base" and self._group in self.materials:
            self.materials[self._group].append((attributes.get("name", ""), attributes.get("displaycolor", "")))

    def _take_extension(self, element: str, attributes: dict[str, str]) -> None:
        own = number(attributes.get("id", ""))
        if element == "colorgroup":
            self._group = own
            self.colours[own] = []
        elif element == "color" and self._group in self.colours:
            self.colours[self._group].append(attributes.get("color", ""))
        elif element == "texture2d":
            self.textures[own] = attributes
        elif element == "texture2dgroup":
            self._group = own
            self.texture_groups[own] = TextureGroup(number(attributes.get("texid", "")))
        elif element == "tex2coord" and self._group in self.texture_groups:
            self.texture_groups[self._group].numbers.extend(real_attributes(attributes, "u", "v"))
        elif element in _LEFT_OUT:
            self.ignored.add(element)
