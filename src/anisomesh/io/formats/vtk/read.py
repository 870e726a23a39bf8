"""VTK's XML files of unstructured grids (VTU) and of polygons (VTP), of one piece or of many.

Format: https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html.
"""

from __future__ import annotations

import re
from typing import Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Carried
from anisomesh.io.cells import SurfaceCells
from anisomesh.io.formats.vtk.arrays import ArrayReader
from anisomesh.io.formats.vtk.data import PieceData, names_by_meaning, read_field_data
from anisomesh.io.polygons import Integers, PolygonSoup
from anisomesh.io.vtk_cells import LINE, POLYGON, STRIP, VERTEX, add_vtk_cells, add_vtk_lines

_ORDERS = {"LittleEndian": "<", "BigEndian": ">"}
_HEADERS = {"UInt32": "u4", "UInt64": "u8"}


def read_vtu(data: bytes) -> PolygonSoup:
    """Read the surface cells of all pieces of a VTK unstructured grid, and their data.

    Notes
    -----
    Lines are features, vertices are fixed points.
    """
    file = _File(data, "UnstructuredGrid")
    for piece in file.pieces():
        first = file.points.add(piece, file.arrays)
        types, connectivity, offsets = (
            _array(piece, "Cells", name, file.arrays) for name in ("types", "connectivity", "offsets")
        )
        declared = piece.get("NumberOfCells", "")
        if declared != str(len(types)):
            raise ValueError(f"truncated or malformed: a piece declares {declared!r} cells but has {len(types)}")
        connectivity = _shifted(connectivity, file.points, first)
        add_vtk_cells(file.cells, types, connectivity, offsets)
        add_vtk_lines(file.carried, types, connectivity, offsets)
        file.add_data(piece, file.points.count - first, len(types))
    return file.soup()


def read_vtp(data: bytes) -> PolygonSoup:
    """Read the polygons and strips of all pieces of VTK polygon data, as :func:`read_vtu` does."""
    file = _File(data, "PolyData")
    for piece in file.pieces():
        first, n_cells = file.points.add(piece, file.arrays), 0
        for section, cell_type in (("Verts", VERTEX), ("Lines", LINE), ("Polys", POLYGON), ("Strips", STRIP)):
            declared = piece.get(f"NumberOf{section}", "0")
            if declared == "0":
                continue
            connectivity, offsets = (_array(piece, section, name, file.arrays) for name in ("connectivity", "offsets"))
            if declared != str(len(offsets)):
                raise ValueError(f"truncated or malformed: {section} declares {declared!r} cells, has {len(offsets)}")
            types, connectivity = np.full(len(offsets), cell_type), _shifted(connectivity, file.points, first)
            add_vtk_cells(file.cells, types, connectivity, offsets)
            add_vtk_lines(file.carried, types, connectivity, offsets)
            n_cells += len(offsets)
        file.add_data(piece, file.points.count - first, n_cells)
    return file.soup()


class _File:
    """A file with the points, cells and data of its pieces."""

    def __init__(self, data: bytes, kind: str) -> None:
        self._root, self.arrays = _parse(data, kind)
        self._kind = kind
        self.points, self.cells, self.carried = _Points(), SurfaceCells(), Carried()
        self._point_data, self._cell_data = PieceData("PointData"), PieceData("CellData")
        self._ours: dict[str, str] = {}

    def pieces(self) -> list[ElementTree.Element]:
        """Return the pieces."""
        return self._root.findall(f"{self._kind}/Piece")

    def add_data(self, piece: ElementTree.Element, n_points: int, n_cells: int) -> None:
        """Add the data of a piece with these numbers of points and cells."""
        self._point_data.add(piece, self.arrays, n_points, self.carried)
        self._cell_data.add(piece, self.arrays, n_cells, self.carried)
        self._ours |= names_by_meaning(piece)

    def soup(self) -> PolygonSoup:
        """Return everything."""
        carried = self.carried
        names = read_field_data(self._root, self._kind, self.arrays, carried)
        for name, values in self._point_data.all(carried).items():
            carried.point_data[self._ours.get(name, name)] = values
        for name, values in self._cell_data.all(carried).items():
            carried.add_cell_data(name, values, names=names.get(name))
        return self.cells.soup(self.points.all(), carried=carried)


class _Points:
    """Points of pieces, one after the other."""

    def __init__(self) -> None:
        self._parts: list[npt.NDArray[np.float64]] = [np.zeros((0, 3))]
        self.count = 0

    def add(self, piece: ElementTree.Element, arrays: ArrayReader) -> int:
        """Add the points of a piece; return the number of points before them."""
        first = self.count
        declared = piece.get("NumberOfPoints", "")
        element = piece.find("Points/DataArray")
        flat = np.zeros(0) if element is None else arrays.read(element)
        if not declared.isdigit() or len(flat) != 3 * int(declared):
            raise ValueError(f"truncated or malformed: a piece declares {declared!r} points but has {len(flat)} / 3")
        self._parts.append(flat.astype(np.float64).reshape(-1, 3))
        self.count += int(declared)
        return first

    def all(self) -> npt.NDArray[np.float64]:
        """Return all points."""
        return np.concatenate(self._parts)


def _shifted(connectivity: npt.NDArray[Any], points: _Points, first: int) -> Integers:
    """Return indices of points of the last piece as indices of all points."""
    shifted: Integers = connectivity.astype(np.int64) + first
    outside = np.flatnonzero((shifted < first) | (shifted >= points.count))
    if len(outside):
        raise ValueError(
            f"a cell refers to point {shifted[outside[0]] - first} (counted from 0) but there are "
            f"{points.count - first} points"
        )
    return shifted


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
