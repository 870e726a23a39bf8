"""The attributes of vertices in glTF as point data, and the other way."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import COLOUR, NORMAL, UV, Array, Carried
from anisomesh.io.formats.gltf.document import COMPONENTS, WIDTHS, Document, as_numbers
from anisomesh.io.holding.normals import has_direction
from anisomesh.io.holding.values import share_not_finite
from anisomesh.mesh.geometry import unit

TANGENT = "tangent"
TEXTURE_COORDINATES = "TEXCOORD"
"""How names of texture coordinates begin in glTF."""

_OURS = {TEXTURE_COORDINATES: UV, "COLOR": COLOUR}  # of numbered sets, the first of which has no number
_SKIN = re.compile(r"(JOINTS|WEIGHTS)_\d+")
_SET = re.compile(rf"({UV}|{COLOUR})(\d*)")
_LARGEST_IN_FLOAT32 = 2**24  # up to it every integer has a float32


def read_attributes(
    document: Document, attributes: dict[str, Any], matrix: npt.NDArray[np.float64], carried: Carried
) -> dict[str, Array]:
    """Return the attributes of a primitive but its positions, moved by the matrix (4, 4) of its node."""
    found: dict[str, Array] = {}
    for key, accessor in attributes.items():
        if key == "POSITION":
            continue
        with carried.optional(f"the attribute {key}"):
            rows, normalised = document.rows(accessor)
            if len(rows) != len(document.rows(attributes["POSITION"])[0]):
                raise ValueError(f"it has {len(rows)} rows")
            name, values = _decoded(key, rows, normalised, matrix)
            found[name] = values[:, 0] if values.shape[1] == 1 else values
    return found


def _decoded(key: str, rows: Array, normalised: bool, matrix: npt.NDArray[np.float64]) -> tuple[str, Array]:
    """Return our name and the values of an attribute."""
    kind, _, number = key.partition("_")
    if kind in _OURS and number.isdigit():
        name = _OURS[kind] + (number if int(number) else "")
        if kind == "COLOR":
            return name, rows.copy()
        numbers = as_numbers(rows) if normalised else rows.astype(np.float64)
        return name, np.column_stack([numbers[:, 0], 1.0 - numbers[:, 1]])
    values = as_numbers(rows) if normalised else rows.copy()
    if key == "NORMAL":
        moved = unit(values.astype(np.float64) @ np.linalg.inv(matrix[:3, :3]))
        return NORMAL, values if (matrix == np.eye(4)).all() else moved
    if key == "TANGENT":
        moved = unit(values[:, :3].astype(np.float64) @ matrix[:3, :3].T)
        return TANGENT, values if (matrix == np.eye(4)).all() else np.column_stack([moved, values[:, 3:]])
    return (key if _SKIN.fullmatch(key) else key.removeprefix("_")), values


class Attributes:
    """Collects the attributes of primitives, one after the other."""

    def __init__(self) -> None:
        self._parts: list[tuple[int, dict[str, Array]]] = []

    def add(self, count: int, attributes: dict[str, Array]) -> None:
        """Add the attributes of a number of vertices."""
        self._parts.append((count, attributes))

    def together(self, carried: Carried, of: str = "vertices") -> dict[str, Array]:
        """Return all attributes; where vertices or faces lack one they are white, have 0 or NaN, or it is left out."""
        data: dict[str, Array] = {}
        filled: list[str] = []
        for name in dict.fromkeys(name for _, attributes in self._parts for name in attributes):
            given = [attributes[name] for _, attributes in self._parts if name in attributes]
            lacks = len(given) < sum(count > 0 for count, _ in self._parts)
            if lacks and name in (NORMAL, TANGENT):
                carried.remarks.append(f"left out {name!r}, which some of its meshes lack")
                continue
            with carried.optional(f"the attribute {name!r}"):
                is_colour = bool(_SET.fullmatch(name)) and name.startswith(COLOUR)
                data[name] = _colours(name, self._parts, given) if is_colour else self._filled(name, given[0])
            if lacks:
                filled.append(name)
        if filled:
            carried.remarks.append(f"{of} of its meshes without {', '.join(filled)} get 0, NaN or white")
        return data

    def _filled(self, name: str, example: Array) -> Array:
        """Return an attribute of all vertices, of the width of an example."""
        fill = np.nan if example.dtype.kind == "f" and not name.startswith("WEIGHTS") else 0
        blank = [np.full((count, *example.shape[1:]), fill, dtype=example.dtype) for count, _ in self._parts]
        return np.concatenate([part.get(name, rows) for (_, part), rows in zip(self._parts, blank, strict=True)])


def _colours(name: str, parts: list[tuple[int, dict[str, Array]]], given: list[Array]) -> Array:
    """Return colours of one type and width; white where they are missing."""
    kinds, width = {values.dtype for values in given}, max(values.shape[1] for values in given)
    kind = kinds.pop() if len(kinds) == 1 else np.dtype(np.float64)
    largest = np.iinfo(kind).max if kind.kind in "iu" else 1.0
    rows = []
    for count, attributes in parts:
        values = attributes.get(name, np.full((count, width), largest, dtype=kind))
        if values.dtype != kind and values.dtype.kind in "iu":
            values = as_numbers(values)
        more = np.full((count, width - values.shape[1]), largest, dtype=kind)
        rows.append(np.concatenate([values.astype(kind), more], axis=1))
    return np.concatenate(rows)


class Encoded(NamedTuple):
    """An attribute as glTF has it: its name, its rows (n, k), and whether integers are normalised."""

    name: str
    rows: Array
    normalised: bool


def encoded(name: str, values: Array, where: str = "points") -> Encoded | str:
    """Return data (n,) or (n, k) at points or corners as an attribute of glTF, or why it cannot hold them.

    Texture coordinates may be NaN where they are missing.
    """
    rows = values.reshape(len(values), -1)
    if rows.dtype.kind not in "biuf":
        return f"which are of type {rows.dtype}"
    if rows.shape[1] not in WIDTHS.values():
        return f"which have {rows.shape[1]} components"
    numbered = _SET.fullmatch(name)
    is_uv = numbered is not None and numbered[1] == UV and rows.shape[1] == 2
    given = rows[~np.isnan(rows).any(axis=1)] if is_uv else rows
    if reason := share_not_finite(given if len(given) else rows, where):
        return reason
    if name == NORMAL and rows.shape[1] == 3 and not has_direction(rows).all():
        return "which have no length"
    width, kind = rows.shape[1], rows.dtype.str[1:]
    if numbered and is_uv:
        flipped = np.column_stack([rows[:, 0], 1.0 - rows[:, 1].astype(np.float64)])
        return Encoded(f"{TEXTURE_COORDINATES}_{int(numbered[2] or 0)}", flipped.astype(np.float32), False)
    if numbered and numbered[1] == COLOUR and width in (3, 4) and kind in ("u1", "u2", "f4", "f8"):
        is_real = kind.startswith("f")
        return Encoded(f"COLOR_{int(numbered[2] or 0)}", rows.astype(np.float32) if is_real else rows, not is_real)
    if (name, width) in ((NORMAL, 3), (TANGENT, 4)):
        return Encoded(name.upper(), rows.astype(np.float32), False)
    if _SKIN.fullmatch(name) and width == 4:
        if name.startswith("WEIGHTS"):
            return Encoded(name, rows.astype(np.float32), False)
        if rows.dtype.kind in "iu" and rows.min() >= 0 and rows.max() <= np.iinfo(np.uint16).max:
            return Encoded(name, rows if kind == "u1" else rows.astype(np.uint16), False)
        return "which are not numbers of joints"
    return _custom(name, rows)


def _custom(name: str, rows: Array) -> Encoded | str:
    """Return data without a meaning in glTF, whose names begin with an underscore there, or why it cannot hold them."""
    kind = rows.dtype.str[1:]
    if rows.dtype.kind == "b":
        rows = rows.astype(np.uint8)
    elif kind not in COMPONENTS.values() or kind == "u4":  # u4 is for indices only
        if rows.dtype.kind in "iu" and (rows.min() < -_LARGEST_IN_FLOAT32 or rows.max() > _LARGEST_IN_FLOAT32):
            return "whose integers are too large for float32"
        with np.errstate(over="ignore"):
            rows = rows.astype(np.float32)
    return Encoded("_" + name, rows, False) if np.isfinite(rows).all() else "whose numbers are too large for float32"
