"""Point, cell and field data of VTK's XML files."""

from __future__ import annotations

from collections.abc import Container, Mapping
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from anisomesh.io.carried import NORMAL, UV, Array, Carried
from anisomesh.io.formats.region_names import label_of
from anisomesh.io.formats.vtk.arrays import ArrayReader
from anisomesh.io.formats.words import text_of

NAMES_OF_REGIONS = "regions of "
"""Beginning of the names of field data that make cell data a division.

They are text in UTF-8 as bytes, since not every library reads strings: lines of a label and, after a space, its name.
"""

NAMES_OF_FEATURE_REGIONS, NAMES_OF_POINT_REGIONS = "line regions of ", "vertex regions of "
"""The same for divisions of lines and of vertices."""

ORIGINAL_POINT = "original point"
"""Name of our array of global numbers, which points that are repeated have in common."""

_ARRAY_TAGS = ("DataArray", "Array")  # the second of strings
_MEANINGS = (  # attribute of the section, names of arrays in use, our name
    ("TCoords", ("Texture Coordinates", "TextureCoordinates", "TCoords"), UV),
    ("Normals", ("Normals",), NORMAL),
)


class _Data(NamedTuple):
    data: dict[str, Array]
    n_rows: int
    of_marks: bool


def blank_rows(like: Array, count: int) -> Array:
    """Return rows (count, ...) for cells that have no value, of the type of others: NaN, 0 or empty strings."""
    fill: Any = {"f": np.nan, "U": ""}.get(like.dtype.kind, 0)
    return np.full((count, *like.shape[1:]), fill, dtype=like.dtype)


class DataOfPieces:
    """The data of one section, such as point data, of all pieces.

    Parameters
    ----------
    section
        ``"PointData"`` or ``"CellData"``.
    """

    def __init__(self, section: str) -> None:
        self._section = section
        self._pieces: list[_Data] = []

    def add(self, data: dict[str, Array], count: int) -> None:
        """Add the data of a piece with a number of points or cells, unless it has none."""
        if count:
            self._pieces.append(_Data(data, count, of_marks=False))

    def add_marks(self, data: dict[str, Array], count: int) -> None:
        """Add the data of a piece of lines and vertices, with a number of cells, or of points that are not kept."""
        self._pieces.append(_Data(data, count, of_marks=True))

    @property
    def of_marks(self) -> set[str]:
        """Names of the data that only pieces of lines and vertices have."""
        given = [{name for piece in self._pieces if piece.of_marks == kind for name in piece.data} for kind in (0, 1)]
        return given[1] - given[0]

    def all(self, carried: Carried) -> dict[str, Array]:
        """Return the arrays that every piece has; the others are left out with a remark.

        Pieces of lines and vertices need not have them, nor need other pieces have the ones of these: rows of 0, NaN or
        empty strings stand for them.
        """
        together: dict[str, Array] = {}
        whole = [piece for piece in self._pieces if not piece.of_marks]
        for name in dict.fromkeys(name for piece in self._pieces if piece.n_rows for name in piece.data):
            lacking = sum(name not in piece.data for piece in whole)
            if lacking > 0 and name not in self.of_marks:
                carried.remarks.append(
                    f"left out {self._section} {name!r}, which {lacking} of {len(whole)} pieces lack"
                )
                continue
            with carried.optional(f"{self._section} {name!r}"):
                like = next(piece.data[name] for piece in (*whole, *self._pieces) if name in piece.data)
                parts = [
                    blank_rows(like, piece.n_rows) if name not in piece.data else piece.data[name]
                    for piece in self._pieces
                    if piece.n_rows
                ]
                together[name] = np.concatenate(parts) if len(parts) > 1 else parts[0]
        return together


def read_section(piece: Element, section: str, arrays: ArrayReader, count: int, carried: Carried) -> dict[str, Array]:
    """Return the point or cell data of a piece with a number of points or cells."""
    found: dict[str, Array] = {}
    for element in piece.iterfind(f"{section}/*"):
        name = element.get("Name", "")
        if not count or element.tag not in _ARRAY_TAGS:
            continue
        if not name:
            carried.remarks.append(f"left out {section} without a name")
        else:
            with carried.optional(f"{section} {name!r}"):
                found[name] = _rows(element, arrays, count)
    return found


def _rows(element: Element, arrays: ArrayReader, count: int) -> Array:
    """Return an array (count,) or (count, k)."""
    values = arrays.read(element)
    width = element.get("NumberOfComponents", "1")
    if not width.isdigit() or len(values) != count * int(width):
        raise ValueError(f"it has {len(values)} values of {width[:10]} components; expected {count} rows")
    return values.reshape(count, int(width)) if int(width) > 1 else values


def read_field_data(root: Element, kind: str, arrays: ArrayReader, carried: Carried) -> dict[str, Array]:
    """Return the field data of a file."""
    found: dict[str, Array] = {}
    for element in root.iterfind(f"{kind}/FieldData/*"):
        name = element.get("Name", "")
        if element.tag in _ARRAY_TAGS and not name:
            carried.remarks.append("left out FieldData without a name")
        elif element.tag in _ARRAY_TAGS:
            with carried.optional(f"FieldData {name!r}"):
                values, width = arrays.read(element), element.get("NumberOfComponents", "1")
                found[name] = values.reshape((-1, int(width)) if width.isdigit() and int(width) > 1 else (-1,))
    return found


def names_of_regions(fields: dict[str, Array], carried: Carried) -> list[dict[str, dict[int, str]]]:
    """Return the names of regions by division, of vertices, lines and faces each, from field data.

    Other field data are materials.
    """
    beginnings = (NAMES_OF_POINT_REGIONS, NAMES_OF_FEATURE_REGIONS, NAMES_OF_REGIONS)
    names: list[dict[str, dict[int, str]]] = [{}, {}, {}]
    others: dict[str, Array] = {}
    for name, values in fields.items():
        with carried.optional(f"FieldData {name!r}"):
            found = [k for k, beginning in enumerate(beginnings) if name.startswith(beginning)]
            if found and values.dtype == np.uint8:
                key = name.removeprefix(beginnings[found[0]])
                names[found[0]][key] = _labels(text_of(values.tobytes()))
            else:
                others[name] = values
    if others:
        carried.materials["field_data"] = others
    return names


def _labels(text: str) -> dict[int, str]:
    found = {}
    for line in text.split("\n"):
        digits, _, name = line.partition(" ")
        label = label_of(digits)
        if label is None:
            raise ValueError(f"{line[:40]!r} is not a label and its name")
        if name:
            found[label] = name
    return found


def active_arrays(piece: Element) -> dict[str, str]:
    """Return the names of the point data of a piece by the attribute that they are, such as ``"TCoords"``."""
    section = piece.find("PointData")
    return {} if section is None else dict(section.attrib)


def names_by_meaning(active: Mapping[str, str], present: Container[str]) -> dict[str, str]:
    """Return our names of point data that VTK knows as normals or texture coordinates."""
    found = {}
    for attribute, usual, ours in _MEANINGS:
        name = next((name for name in (active.get(attribute, ""), *usual) if name and name in present), None)
        if name is not None and ours not in present:
            found[name] = ours
    return found
