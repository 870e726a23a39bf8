"""Extensions of glTF that a file requires: which of them can be read.

Registry: https://github.com/KhronosGroup/glTF/tree/main/extensions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

REQUIRED = "extensionsRequired"
"""The key of the extensions that a document requires."""

LEVELS = "MSFT_lod"
"""The extension by which a node names the nodes with its coarser levels of detail."""

COPIES = "EXT_mesh_gpu_instancing"
"""The extension by which a node shows its mesh several times."""

_GEOMETRY = ("KHR_mesh_quantization", LEVELS, COPIES)
_HANDED_ON = (  # with materials and textures
    "KHR_texture_transform",
    "KHR_texture_basisu",
    "EXT_texture_webp",
    "EXT_texture_avif",
    "MSFT_texture_dds",
    "MSFT_packing_normalRoughnessMetallic",
    "MSFT_packing_occlusionRoughnessMetallic",
)
_NOT_OF_SURFACES = (  # lights, metadata and how a program shows a scene
    "KHR_lights_punctual",
    "EXT_lights_ies",
    "EXT_lights_image_based",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "KHR_animation_pointer",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "CESIUM_primitive_outline",
)
_DESCRIPTIVE = (  # what parts of a surface mean, and how they may move
    "EXT_structural_metadata",
    "EXT_mesh_features",
    "EXT_instance_features",
    "AGI_articulations",
    "VRM",
)
_OF_AVATARS = "VRMC_"  # how names begin; descriptive too
_MATERIALS = ("KHR_materials_", "EXT_materials_", "ADOBE_materials_")  # how names begin; handed on
_COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")


def extensions(document: dict[str, Any], key: str) -> list[str]:
    """Return the extensions that a document requires or uses; ValueError if these are not a list of names."""
    names = document.get(key, [])
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ValueError(f"malformed: its {key} is {str(names)[:40]!r}; expected a list of names")
    return names


def descriptive(names: Sequence[str]) -> list[str]:
    """Return which of some extensions only describe parts of a surface that is complete without them."""
    return [name for name in names if name in _DESCRIPTIVE or name.startswith(_OF_AVATARS)]


def check_compression(names: Sequence[str]) -> None:
    """Raise ValueError if one of some extensions is a compression."""
    used = [name for name in _COMPRESSED if name in names]
    if used:
        raise ValueError(f"it is compressed with {used[0]}, which is not supported; save it without compression")


def check_required(names: Sequence[str]) -> None:
    """Raise ValueError if a file requires an extension without which its surface would be another."""
    known = {*_GEOMETRY, *_HANDED_ON, *_NOT_OF_SURFACES, *descriptive(names)}
    check_compression(names)
    for name in names:
        if name not in known and not name.startswith(_MATERIALS):
            raise ValueError(f"it requires the extension {name!r}, which is not supported; save it without")
