"""Textures of 3MF archives that are written."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np

from anisomesh.attributes.model import Mesh
from anisomesh.io.carried import UV, Array
from anisomesh.io.formats.region_names import region_texts
from anisomesh.io.formats.threemf.properties import TEXTURE, TEXTURES
from anisomesh.io.formats.threemf.resources import TEXTURE_ATTRIBUTES
from anisomesh.io.formats.words import format_rows
from anisomesh.io.holding.losses import Losses

_FOLDER = "3D/Textures"
_NOT_IN_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_NOT_IN_NAMES = re.compile("[^A-Za-z0-9._-]+")  # of parts of an archive; others would need escapes
_IMAGE_KINDS = {b"\x89PNG": "image/png", b"\xff\xd8\xff": "image/jpeg"}  # by the first bytes of an image

Images = dict[str, tuple[str, bytes]]
"""Kinds and contents of images by the parts of the archive that hold them."""


class Textured(NamedTuple):
    """Textures of faces.

    Attributes
    ----------
    resources
        The textures and the groups of texture coordinates.
    attributes
        Attributes of the triangles as text (F,), empty where there is no texture.
    images
        The images.
    next_number
        The first number that no resource has.
    """

    resources: str
    attributes: Array
    images: Images
    next_number: int


def textured(mesh: Mesh, first: int, losses: Losses) -> Textured | None:
    """Return the textures of a mesh whose division ``texture`` and texture coordinates say where they are.

    Parameters
    ----------
    mesh
        The mesh.
    first
        The first number of a resource that is free.
    losses
        Names of textures that are changed, and textures without an image, are added.

    Returns
    -------
    Textured or None
        None if images, regions or texture coordinates are missing.
    """
    division, given = mesh.regions.get(TEXTURE), mesh.materials.get(TEXTURES)
    uv = _coordinates(mesh)
    if division is None or uv is None or not isinstance(given, Mapping):
        return None
    tables = {
        label: table for label, table in given.items() if isinstance(table, Mapping) and image_kind(table.get("data"))
    }
    has_uv = np.isfinite(uv).all(axis=(1, 2))
    texts = region_texts(division, losses, _as_part, distinct=True)
    attributes = np.full(mesh.surface.n_faces, "", dtype=object)
    resources, images, number = [], dict[str, tuple[str, bytes]](), first
    for label in texts:
        chosen = np.flatnonzero((division.labels == label) & has_uv)
        if label not in tables:
            if label != 0 or label in division.names:
                losses.say(f"the texture {texts[label]!r}, whose image is missing")
            continue
        if (lacking := np.count_nonzero(division.labels == label) - len(chosen)) > 0:
            losses.say(f"the texture {texts[label]!r} at {lacking} face(s), some corners of which have no {UV}")
        if len(chosen) == 0:
            continue
        part, kind = f"{_FOLDER}/{texts[label]}", image_kind(tables[label]["data"])
        images[part] = kind, bytes(tables[label]["data"])
        rows, members = np.unique(uv[chosen].reshape(-1, 2), axis=0, return_inverse=True)
        resources.append(_group(number, part, {**tables[label], "contenttype": kind}, rows))
        corners = zip(chosen.tolist(), members.reshape(-1, 3).tolist(), strict=True)
        for face, (a, b, c) in corners:
            attributes[face] = f' pid="{number + 1}" p1="{a}" p2="{b}" p3="{c}"'
        number += 2
    plain = np.count_nonzero((attributes == "") & has_uv & uv.any(axis=(1, 2)))
    if images and plain:
        losses.say(f"the {UV} of {plain} face(s) without a texture")
    return Textured("".join(resources), attributes, images, number) if images else None


def _coordinates(mesh: Mesh) -> Array | None:
    """Return texture coordinates at corners (F, 3, 2), None if there are none of this shape."""
    at_points = mesh.point_data.get(UV)
    uv = mesh.corner_data.get(UV, None if at_points is None else at_points[mesh.surface.faces])
    if uv is None or uv.dtype.kind not in "fiu" or uv.shape[2:] != (2,) or not np.isfinite(uv).any():
        return None
    return uv.astype(np.float64)


def image_kind(data: Any) -> str:
    """Return the kind of the content of an image, empty if it is none that 3MF and glTF hold."""
    if not isinstance(data, bytes):
        return ""
    return next((kind for begin, kind in _IMAGE_KINDS.items() if data.startswith(begin)), "")


def _group(number: int, part: str, table: Mapping[str, Any], rows: Array) -> str:
    """Return a texture and, with the next number, the group of its texture coordinates (n, 2)."""
    known = "".join(f" {key}={quoteattr(in_xml(str(table[key])))}" for key in TEXTURE_ATTRIBUTES if key in table)
    pairs = format_rows('<m:tex2coord u="%r" v="%r"/>', rows)
    return (
        f'<m:texture2d id="{number}" path="/{part}"{known}/>\n'
        f'<m:texture2dgroup id="{number + 1}" texid="{number}">{pairs}</m:texture2dgroup>\n'
    )


def in_xml(text: str) -> str:
    """Return a text without the characters that XML does not allow."""
    return _NOT_IN_XML.sub(" ", text)


def _as_part(text: str) -> str:
    """Return a name for a part of the archive."""
    return _NOT_IN_NAMES.sub("_", text).strip(".")
