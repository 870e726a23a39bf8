"""VTK's XML files of unstructured grids (VTU) and of polygons (VTP), of one piece or of many.

Format: https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html.
"""

from __future__ import annotations

import re
from typing import Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Array
from anisomesh.io.formats.vtk.arrays import ArrayReader
from anisomesh.io.formats.vtk.cells import LINE, POLYGON, STRIP, VERTEX
from anisomesh.io.formats.vtk.data import active_arrays, read_field_data, read_section
from anisomesh.io.formats.vtk.pieces import Piece, Pieces
from anisomesh.io.polygons import PolygonSoup

_ORDERS = {"LittleEndian": "<", "BigEndian": ">"}
_HEADERS = {"UInt32": "u4", "UInt64": "u8"}


def read_vtu(data: bytes) -> PolygonSoup:
    """Read the surface cells, lines and vertices of all pieces of a VTK unstructured grid, and their data."""
    file = _File(data, "UnstructuredGrid")
    for piece in file.pieces():
        types, connectivity, offsets = (
            _array(piece, "Cells", name, file.arrays) for name in ("types", "connectivity", "offsets")
        )
        declared = piece.get("NumberOfCells", "")
        if declared != str(len(types)):
            raise ValueError(f"truncated or malformed: a piece declares {declared!r} cells but has {len(types)}")
        file.add(piece, types, connectivity, offsets)
    return file.soup()


def read_vtp(data: bytes) -> PolygonSoup:
    """Read all pieces of VTK polygon data, as :func:`read_vtu` does."""
    file = _File(data, "PolyData")
    for piece in file.pieces():
        types, connectivity, ends = ([np.zeros(0, dtype=np.int64)] for _ in range(3))
        for section, cell_type in (("Verts", VERTEX), ("Lines", LINE), ("Polys", POLYGON), ("Strips", STRIP)):
            declared = piece.get(f"NumberOf{section}", "0")
            if declared == "0":
                continue
            corners, offsets = (_array(piece, section, name, file.arrays) for name in ("connectivity", "offsets"))
            if declared != str(len(offsets)):
                raise ValueError(f"truncated or malformed: {section} declares {declared!r} cells, has {len(offsets)}")
            types.append(np.full(len(offsets), cell_type))
            ends.append(offsets.astype(np.int64) + sum(map(len, connectivity)))
            connectivity.append(corners.astype(np.int64))
        file.add(piece, *map(np.concatenate, (types, connectivity, ends)))
    return file.soup()


class _File:
    """A file and what was read of its pieces."""

    def __init__(self, data: bytes, kind: str) -> None:
        self._root, self.arrays = _parse(data, kind)
        self._kind = kind
        self._pieces = Pieces()

    def pieces(self) -> list[ElementTree.Element]:
        """Return the pieces."""
        return self._root.findall(f"{self._kind}/Piece")

    def add(self, piece: ElementTree.Element, types: Array, connectivity: Array, offsets: Array) -> None:
        """Add a piece with these cells."""
        points, carried = _points(piece, self.arrays), self._pieces.carried
        point_data = read_section(piece, "PointData", self.arrays, len(points), carried)
        cell_data = read_section(piece, "CellData", self.arrays, len(types), carried)
        active = active_arrays(piece)
        self._pieces.add(Piece(points, types, connectivity, offsets, point_data, cell_data, active))

    def soup(self) -> PolygonSoup:
        """Return everything."""
        return self._pieces.soup(read_field_data(self._root, self._kind, self.arrays, self._pieces.carried))


def _points(piece: ElementTree.Element, arrays: ArrayReader) -> Array:
    """Return the points (V, 3) of a piece."""
    declared, element = piece.get("NumberOfPoints", ""), piece.find("Points/DataArray")
    flat = np.zeros(0) if element is None else arrays.read(element)
    if not declared.isdigit() or len(flat) != 3 * int(declared):
        raise ValueError(f"truncated or malformed: a piece declares {declared!r} points but has {len(flat)} / 3")
    return flat.reshape(-1, 3)


def _parse(data: bytes, kind: str) -> tuple[ElementTree.Element, ArrayReader]:
    """Return the elements of a file of this kind, and what reads their arrays."""
    begin = re.search(rb"<AppendedData\b[^>]*>", data)
    appended, in_base64 = b"", False
    if begin:
        in_base64 = re.search(rb"encoding\s*=\s*[\"']base64", begin[0]) is not None
        start = data.find(b"_", begin.end()) + 1
        end = data.rfind(b"</AppendedData")
        if start == 0 or end < start:
            raise ValueError("truncated: the section AppendedData does not end")
        appended = data[start:end]
        data = data[: begin.start()] + b"</VTKFile>"
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise ValueError(f"truncated or malformed: {error}") from None
    if root.tag != "VTKFile" or root.get("type") != kind:
        raise ValueError(f"it is a {root.get('type') or root.tag} file; expected a VTKFile of type {kind}")
    order, header = root.get("byte_order", "LittleEndian"), root.get("header_type", "UInt32")
    if order not in _ORDERS or header not in _HEADERS:
        raise ValueError(f"malformed: its byte order is {order!r} and its headers are {header!r}")
    offsets = sorted(int(text) for array in root.iter() if (text := array.get("offset", "")).isdigit())
    return root, ArrayReader(
        order=_ORDERS[order],
        header=np.dtype(_ORDERS[order] + _HEADERS[header]),
        compressor=root.get("compressor", ""),
        appended=appended,
        in_base64=in_base64,
        offsets=offsets,
    )


def _array(piece: ElementTree.Element, section: str, name: str, arrays: ArrayReader) -> npt.NDArray[Any]:
    """Return an array of integers of a piece; empty if the piece has no cell and leaves it out."""
    for element in piece.iterfind(f"{section}/DataArray"):
        if element.get("Name") == name:
            values = arrays.read(element)
            if values.dtype.kind not in "iu":
                raise ValueError(f"malformed: the array {name} is of type {values.dtype}; expected integers")
            return values
    if piece.get("NumberOfCells") == "0":
        return np.zeros(0, dtype=np.int64)
    raise ValueError(f"truncated or malformed: a piece has no array {name!r} in {section}")
