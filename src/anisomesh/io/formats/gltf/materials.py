"""Materials, textures and images of glTF, handed on from file to file."""

from __future__ import annotations

import json
from typing import Any

from anisomesh.io.formats.gltf.document import Document

_LISTS = ("materials", "textures", "samplers", "images")


def read_materials(document: Document) -> dict[str, Any]:
    """Return materials with all that they refer to.

    Returns
    -------
    dict
        The lists ``materials``, ``textures``, ``samplers`` and ``images`` of the document, where it has them; ``data``
        with the bytes of images by their number; ``extensionsUsed`` and ``extensionsRequired`` as far as these lists
        name them.
    """
    kept: dict[str, Any] = {part: document.json[part] for part in _LISTS if part in document.json}
    kept["data"] = {}
    images = []
    for k, image in enumerate(kept.get("images", [])):
        if "bufferView" in image:
            kept["data"][k] = document.view(image["bufferView"])
        images.append({key: value for key, value in image.items() if key != "bufferView"})
    if images:
        kept["images"] = images
    text = json.dumps({part: kept[part] for part in _LISTS if part in kept})
    for key in ("extensionsUsed", "extensionsRequired"):
        names = [name for name in document.json.get(key, []) if json.dumps(name) in text]
        if names:
            kept[key] = names
    return kept


def write_materials(kept: dict[str, Any], document: dict[str, Any], binary: list[bytes]) -> None:
    """Add materials that :func:`read_materials` returned to a document.

    Parameters
    ----------
    kept
        The materials.
    document
        The JSON, to which lists and views are added.
    binary
        The content of the views of the document, to which images are added.
    """
    for key in (*_LISTS, "extensionsUsed", "extensionsRequired"):
        if key in kept:
            document[key] = kept[key]
    images = [dict(image) for image in kept.get("images", [])]
    for image, data in ((images[k], data) for k, data in kept.get("data", {}).items() if k < len(images)):
        image["bufferView"] = len(binary)
        binary.append(data)
    if images:
        document["images"] = images
