"""Units of length of meshes: what files say, and what formats mean by specification."""

from __future__ import annotations

from dataclasses import replace

from anisomesh.attributes.model import UNIT, Mesh
from anisomesh.io.holding.losses import Losses

OF_3MF, OF_GLB = "millimeter", "meter"
"""The unit of 3MF files that name none, and of all GLB files, by specification."""

_WITH_UNITS = (".3mf", ".glb")


def in_unit_of(mesh: Mesh, suffix: str, losses: Losses) -> Mesh:
    """Return a mesh without a unit unless the format says the unit of each file; coordinates are the same.

    Parameters
    ----------
    mesh
        The mesh.
    suffix
        The extension of the format; any other text for objects without units.
    losses
        A unit is added that GLB does not mean. For formats without units their writers add units; metres and
        millimetres, which files usually do not say, are left out without a line.
    """
    unit = mesh.materials.get(UNIT)
    if suffix == ".glb" and isinstance(unit, str) and unit != OF_GLB:
        losses.say(f"the unit {unit}: coordinates stay as they are, and GLB means metres")
    is_left_out = suffix == ".glb" or (suffix not in _WITH_UNITS and unit in (OF_3MF, OF_GLB))
    if not is_left_out or not isinstance(unit, str):
        return mesh
    return replace(mesh, materials={name: one for name, one in mesh.materials.items() if name != UNIT})
