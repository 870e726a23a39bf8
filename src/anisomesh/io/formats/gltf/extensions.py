"""Extensions of glTF that a file requires: which of them can be read.

Registry: https://github.com/KhronosGroup/glTF/tree/main/extensions.
"""

from __future__ import annotations

from collections.abc import Sequence

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
_MATERIALS = ("KHR_materials_", "EXT_materials_", "ADOBE_materials_")  # how names begin; handed on
_COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")


def check_compression(names: Sequence[str]) -> None:
    """Raise ValueError if one of some extensions is a compression."""
    used = [name for name in _COMPRESSED if name in names]
    if used:
        raise ValueError(f"it is compressed with {used[0]}, which is not supported; save it without compression")


def check_required(names: Sequence[str]) -> None:
    """Raise ValueError if a file requires an extension without which its surface would be another."""
    known = {*_GEOMETRY, *_HANDED_ON, *_NOT_OF_SURFACES}
    check_compression(names)
    for name in names:
        if name not in known and not str(name).startswith(_MATERIALS):
            raise ValueError(f"it requires the extension {name!r}, which is not supported; save it without")
