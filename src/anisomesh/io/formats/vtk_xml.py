"""VTK's XML files of unstructured grids (VTU) and of polygons (VTP), of one piece or of many.

Format: https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Points
from anisomesh.io.cells import SurfaceCells
from anisomesh.io.formats.vtk_arrays import ArrayReader, packed_array, type_name
from anisomesh.io.polygons import Integers, PolygonSoup
from anisomesh.io.vtk_cells import POLYGON, QUAD, STRIP, TRIANGLE, add_vtk_cells

Data = Mapping[str, npt.NDArray[Any]]

_ORDERS = {"LittleEndian": "<", "BigEndian": ">"}
_HEADERS = {"UInt32": "u4", "UInt64": "u8"}
_CELL_TYPES = {3: TRIANGLE, 4: QUAD}  # by number of corners; others are polygons


def read_vtu(data: bytes) -> PolygonSoup:
    """Read the surface cells of all pieces of a VTK unstructured grid."""
    root, arrays = _parse(data, "UnstructuredGrid")
    cells, points = SurfaceCells(), _Points()
    for piece in root.iterfind("UnstructuredGrid/Piece"):
        first = points.add(piece, arrays)
        types, connectivity, offsets = (
            _array(piece, "Cells", name, arrays) for name in ("types", "connectivity", "offsets")
        )
        declared = piece.get("NumberOfCells", "")
        if declared != str(len(types)):
            raise ValueError(f"truncated or malformed: a piece declares {declared!r} cells but has {len(types)}")
        add_vtk_cells(cells, types, _shifted(connectivity, points, first), offsets)
    return cells.soup(points.all())


def read_vtp(data: bytes) -> PolygonSoup:
    """Read the polygons and strips of all pieces of VTK polygon data."""
    root, arrays = _parse(data, "PolyData")
    cells, points = SurfaceCells(), _Points()
    for piece in root.iterfind("PolyData/Piece"):
        first = points.add(piece, arrays)
        for section, cell_type in (("Verts", 1), ("Lines", 3), ("Strips", STRIP), ("Polys", POLYGON)):
            declared = piece.get(f"NumberOf{section}", "0")
            if declared == "0":
                continue
            connectivity, offsets = (_array(piece, section, name, arrays) for name in ("connectivity", "offsets"))
            if declared != str(len(offsets)):
                raise ValueError(f"truncated or malformed: {section} declares {declared!r} cells, has {len(offsets)}")
            types = np.full(len(offsets), cell_type)
            add_vtk_cells(cells, types, _shifted(connectivity, points, first), offsets)
    return cells.soup(points.all())


class _Points:
    """Points of pieces, one after the other."""

    def __init__(self) -> None:
        self._parts: list[npt.NDArray[np.float64]] = [np.zeros((0, 3))]
        self.count = 0

    def add(self, piece: ElementTree.Element, arrays: ArrayReader) -> int:
        """Add the points of a piece; return the number of those before."""
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
    offsets = sorted(int(text) for array in root.iter("DataArray") if (text := array.get("offset", "")).isdigit())
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


def vtu_bytes(
    points: Points, corners: npt.NDArray[Any], sizes: Integers, point_data: Data, cell_data: Data | None = None
) -> bytes:
    """Return the content of a compressed VTK unstructured grid.

    Parameters
    ----------
    points
        Coordinates (V, 3).
    corners, sizes
        Point indices of all polygons, concatenated, and the number of corners of each (P,).
    point_data, cell_data
        Arrays (V,) or (V, k) and (P,) or (P, k) by name.
    """
    types = np.full(len(sizes), POLYGON, dtype=np.uint8)
    for size, cell_type in _CELL_TYPES.items():
        types[sizes == size] = cell_type
    arrays: Data = {"connectivity": _indices(corners), "offsets": np.cumsum(sizes), "types": types}
    counts = f'NumberOfCells="{len(sizes)}"'
    return _file("UnstructuredGrid", points, counts, "Cells", arrays, (point_data, cell_data or {}))


def vtp_bytes(points: Points, corners: npt.NDArray[Any], sizes: Integers, point_data: Data) -> bytes:
    """Return the content of compressed VTK polygon data; parameters as for :func:`vtu_bytes`."""
    arrays = {"connectivity": _indices(corners), "offsets": np.cumsum(sizes)}
    counts = f'NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="{len(sizes)}"'
    return _file("PolyData", points, counts, "Polys", arrays, (point_data, {}))


def _indices(corners: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
    return np.asarray(corners, dtype=np.int64).ravel()


def _file(kind: str, points: Points, counts: str, section: str, cells: Data, data: tuple[Data, Data]) -> bytes:
    head = f'type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64"'
    return "\n".join(
        [
            '<?xml version="1.0"?>',
            f'<VTKFile {head} compressor="vtkZLibDataCompressor">',
            f'<{kind}><Piece NumberOfPoints="{len(points)}" {counts}>',
            _section("Points", {"Points": np.asarray(points, dtype=np.float64)}),
            _section(section, cells),
            _section("PointData", data[0]),
            _section("CellData", data[1]),
            f"</Piece></{kind}></VTKFile>\n",
        ]
    ).encode()


def _section(name: str, arrays: Data) -> str:
    lines = []
    for key, values in arrays.items():
        width = "" if values.ndim == 1 else f' NumberOfComponents="{values.shape[1]}"'
        head = f'<DataArray type="{type_name(values)}" Name={quoteattr(key)} format="binary"{width}>'
        lines.append(f"{head}\n{packed_array(values)}\n</DataArray>")
    return "\n".join([f"<{name}>", *lines, f"</{name}>"])
