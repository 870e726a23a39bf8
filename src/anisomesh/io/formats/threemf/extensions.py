"""Extensions of 3MF that a model requires: which of them can be read.

List: https://3mf.io/spec/.
"""

from __future__ import annotations

from collections.abc import Mapping

from anisomesh.io.formats.threemf.resources import CORE, MATERIALS
from anisomesh.io.formats.threemf.triangle_sets import TRIANGLE_SETS

_PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
_SLICES = "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07"
_READABLE = (CORE, MATERIALS, TRIANGLE_SETS, _PRODUCTION, _SLICES)
_BEAM_LATTICES = "http://schemas.microsoft.com/3dmanufacturing/beamlattice"  # how names begin; left out with a line


def check_required(prefixes: str, namespaces: Mapping[str, str]) -> None:
    """Raise ValueError if a model requires an extension without which its surface would be another.

    Parameters
    ----------
    prefixes
        The attribute ``requiredextensions`` of the model, prefixes between blanks.
    namespaces
        Namespaces by their prefixes.
    """
    for prefix in prefixes.split():
        name = namespaces.get(prefix, prefix)
        if name not in _READABLE and not name.startswith(_BEAM_LATTICES):
            raise ValueError(f"it requires the extension {name!r}, which is not supported; save it without")


def check_resolution(attributes: Mapping[str, str]) -> None:
    """Raise ValueError if the mesh of an object, given its attributes, only stands in for its slices."""
    if attributes.get(f"{_SLICES} meshresolution") == "lowres":
        raise ValueError("its surface is given by slices, which are not supported, beside a mesh of low resolution")
