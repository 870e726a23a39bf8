"""The faces of a mesh that an option selects: by the names or labels of regions, or as a mask."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from anisomesh._arrays import FaceMask
from anisomesh.attributes.model import Mesh
from anisomesh.errors import OptionError

_MAX_LISTED = 20  # regions that a message names


def selected_faces(name: str, mesh: Mesh, selection: Any) -> FaceMask:
    """Return which faces of a mesh (F,) an option selects.

    Parameters
    ----------
    name
        Name of the option, for messages.
    mesh
        The mesh.
    selection
        A mask of its faces (F,), the name or label of a region, or several of these; None for no faces. A name may have
        the name of the division before it, as ``"material steel"``; so does the label of a region without a name. A
        name or label that several divisions have stands for all these regions.

    Raises
    ------
    OptionError
        If a mask has another length or selects nothing, or the mesh does not have the region.
    """
    chosen = np.zeros(mesh.surface.n_faces, dtype=bool)
    if selection is None:
        return chosen
    if isinstance(selection, np.ndarray | Sequence) and not isinstance(selection, str):
        values = np.asarray(selection)
        if values.dtype == bool:
            return _mask(name, values, mesh)
        wanted = values.ravel().tolist() if isinstance(selection, np.ndarray) else list(selection)
    else:
        wanted = [selection]
    for each in wanted:
        chosen |= _faces_of(name, mesh, each)
    return chosen


def _mask(name: str, values: FaceMask, mesh: Mesh) -> FaceMask:
    if values.shape != (mesh.surface.n_faces,):
        raise OptionError(
            f"{name} is a mask of shape {values.shape}; expected ({mesh.surface.n_faces},), a value for each triangle "
            "after reading, when polygons are split into triangles and other cells left out"
        )
    if not values.any():
        raise OptionError(f"{name} is a mask that selects no face; select some, or leave it out")
    return values


def _faces_of(name: str, mesh: Mesh, wanted: Any) -> FaceMask:
    """Return the faces (F,) of the regions with a name or label."""
    if isinstance(wanted, bool) or not isinstance(wanted, str | int | np.integer):
        raise OptionError(f"{name} = {wanted!r}; expected the name or label of a region, or a mask of faces")
    found = np.zeros(mesh.surface.n_faces, dtype=bool)
    for division, label, names in _regions(mesh):
        if wanted in names if isinstance(wanted, str) else wanted == label:
            found |= mesh.regions[division].labels == label
    if not found.any() and isinstance(wanted, str) and wanted.lstrip("-").isdecimal():
        return _faces_of(name, mesh, int(wanted))
    if not found.any():
        raise OptionError(
            f"{name} = {wanted!r} is not a region of the mesh; {_remedy(mesh)}; groups of lines or points cannot be "
            "selected"
        )
    return found


def _regions(mesh: Mesh) -> Iterator[tuple[str, int, tuple[str, ...]]]:
    """Yield division, label and names of each region: its own, with the division in front, and with its label."""
    for division, regions in mesh.regions.items():
        for label in np.unique(regions.labels).tolist():
            own = [regions.names[label]] if label in regions.names else []
            yield division, label, (*own, *(f"{division} {each}" for each in own), f"{division} {label}")


def _remedy(mesh: Mesh) -> str:
    """Return what to select instead."""
    names = [repr(names[len(names) // 2]) for _, _, names in _regions(mesh)]  # with the division in front
    if not names:
        return "it has no regions: give it some, or in Python a mask of faces"
    more = f" and {len(names) - _MAX_LISTED:,} more" if len(names) > _MAX_LISTED else ""
    return f"its regions are {', '.join(names[:_MAX_LISTED])}{more}"
