"""Writing of VTK's XML files, compressed, in one piece."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Points
from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.carried import NORMAL, UV, Array
from anisomesh.io.formats.region_names import in_a_line, region_texts
from anisomesh.io.formats.vtk.arrays import packed_array, string_codes, type_name
from anisomesh.io.formats.vtk.cells import LINE, POLYGON, QUAD, TRIANGLE, VERTEX
from anisomesh.io.formats.vtk.data import (
    NAMES_OF_FEATURE_REGIONS,
    NAMES_OF_POINT_REGIONS,
    NAMES_OF_REGIONS,
    ORIGINAL_POINT,
    blank_rows,
)
from anisomesh.io.holding.corners import continuous_corner_data, with_points_repeated
from anisomesh.io.holding.divisions import narrowed
from anisomesh.io.holding.losses import OF_FEATURES, OF_FIXED_POINTS, Losses
from anisomesh.io.holding.values import flat_rows, numeric, without_unnamed
from anisomesh.io.polygons import Integers

Data = Mapping[str, npt.NDArray[Any]]

_CELL_TYPES = {3: TRIANGLE, 4: QUAD}  # by number of corners; others are polygons


def vtu_mesh_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return a mesh as an unstructured grid: triangles, then features as lines and fixed points as vertices.

    Notes
    -----
    Regions are cell data, with their names in field data. Cell data of lines and vertices are NaN, 0 or empty.
    """
    mesh = without_unnamed(mesh, losses, divisions=True)
    points, faces = mesh.surface.points, mesh.surface.faces
    lines, vertices = mesh.features, mesh.fixed_points
    sizes = np.repeat([3, 2, 1], [len(faces), len(lines), len(vertices)])
    types = np.repeat(np.array([TRIANGLE, LINE, VERTEX], dtype=np.uint8), [len(faces), len(lines), len(vertices)])
    connectivity = np.concatenate([faces.ravel(), lines.ravel(), vertices]).astype(np.int64)
    cells: Data = {"connectivity": connectivity, "offsets": np.cumsum(sizes), "types": types}
    point_data, cell_data, fields = _data(mesh, losses, ("faces", "lines", "vertices"))
    counts = f'NumberOfCells="{len(sizes)}"'
    return _file("UnstructuredGrid", points, counts, {"Cells": cells}, (point_data, cell_data, fields))


def vtp_mesh_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return a mesh as polygon data: as :func:`vtu_mesh_bytes`, with vertices and lines in front.

    Notes
    -----
    Points are repeated where corner data differ, so that VTK shows textures. Copies have the same global number.
    """
    mesh, polygons = vtk_polygons(mesh, losses)
    sections: dict[str, Data] = {}
    for name, cells in polygons.cells.items():
        if len(cells):
            ends = np.arange(1, len(cells) + 1) * cells.shape[1]
            sections[name] = {"connectivity": cells.ravel(), "offsets": ends}
    counts = " ".join(f'NumberOf{name}="{len(cells)}"' for name, cells in polygons.cells.items())
    return _file("PolyData", mesh.surface.points, f'{counts} NumberOfStrips="0"', sections, polygons.data)


class Polygons(NamedTuple):
    """Cells (n, k) by section in the order of their data, and point, cell and field data."""

    cells: dict[str, Integers]
    data: tuple[dict[str, Array], dict[str, Array], dict[str, Array]]


def vtk_polygons(mesh: Mesh, losses: Losses) -> tuple[Mesh, Polygons]:
    """Return a mesh with points repeated where corner data differ, and its cells and data for polygon data of VTK."""
    mesh, source = with_points_repeated(without_unnamed(mesh, losses, divisions=True))
    if len(np.unique(source)) < len(source):
        mesh = replace(mesh, point_data={**mesh.point_data, ORIGINAL_POINT: source})
    found = {"Verts": mesh.fixed_points[:, None], "Lines": mesh.features, "Polys": mesh.surface.faces}
    data = _data(mesh, losses, ("vertices", "lines", "faces"))
    return mesh, Polygons({name: rows.astype(np.int64) for name, rows in found.items()}, data)


def _data(
    mesh: Mesh, losses: Losses, order: Sequence[str]
) -> tuple[dict[str, Array], dict[str, Array], dict[str, Array]]:
    """Return the point, cell and field data that hold what a mesh carries.

    ``order`` is the one of the cells: of ``"faces"``, ``"lines"`` and ``"vertices"``.
    """
    point_data = _storable({**mesh.point_data, **continuous_corner_data(mesh, losses)}, "point data", losses)
    cell_data = _storable(mesh.face_data, "face data", losses)
    losses.add("face data", *(name for name in mesh.regions if name in cell_data))
    counts = {"faces": mesh.surface.n_faces, "lines": len(mesh.features), "vertices": len(mesh.fixed_points)}
    none = {kind: np.zeros(counts[kind], dtype=np.int64) for kind in order}
    labels, fields = dict[str, dict[str, Integers]](), dict[str, Array]()
    for kind, beginning, divisions, what in (
        ("faces", NAMES_OF_REGIONS, mesh.regions, "regions"),
        ("lines", NAMES_OF_FEATURE_REGIONS, mesh.feature_regions, OF_FEATURES),
        ("vertices", NAMES_OF_POINT_REGIONS, mesh.fixed_point_regions, OF_FIXED_POINTS),
    ):
        for name, division in divisions.items():
            if kind != "faces" and not division.labels.any():
                continue
            if name in cell_data and name not in mesh.regions:
                losses.add(what, name)
                continue
            labels.setdefault(name, dict(none))[kind] = division.labels
            fields[beginning + name] = _names(division, losses)
    cell_data = {name: _padded(values, order, counts) for name, values in cell_data.items() if name not in labels}
    cell_data |= {name: narrowed(np.concatenate(list(parts.values()))) for name, parts in labels.items()}
    given = mesh.materials.get("field_data", {})
    if isinstance(given, Mapping):
        fields |= _storable({name: np.asarray(values) for name, values in given.items()}, "field data", losses)
    losses.add("materials", *(name for name in mesh.materials if name != "field_data"))
    losses.fixed_faces(mesh)
    return point_data, cell_data, fields


def _storable(data: Mapping[str, Array], what: str, losses: Losses) -> dict[str, Array]:
    """Return arrays of numbers and strings as rows."""
    if "" in data:
        losses.add(what, "")
        data = {name: values for name, values in data.items() if name}
    strings = {name: values.astype(np.str_) for name, values in data.items() if values.dtype.kind in "SU"}
    strings = {name: values for name, values in strings.items() if values.ndim == 1 and values.size}
    numbers = numeric({name: values for name, values in data.items() if name not in strings}, what, losses)
    return {**{name: flat_rows(values) for name, values in numbers.items()}, **strings}


def _names(division: Regions, losses: Losses) -> Array:
    """Return the names of regions as lines of a label and a name, in bytes; a label if there are none."""
    texts = region_texts(division, losses, in_a_line)
    lines = [f"{label} {text}" for label, text in texts.items() if division.names.get(label)]
    text = "\n".join(lines or [str(division.labels[0])])
    return np.frombuffer(text.encode("utf-8", errors="replace"), np.uint8)


def _padded(values: Array, order: Sequence[str], counts: Mapping[str, int]) -> Array:
    """Return an array of faces with rows of NaN, 0 or empty strings for lines and vertices."""
    return np.concatenate([values if kind == "faces" else blank_rows(values, counts[kind]) for kind in order])


def vtu_bytes(
    points: Points, corners: npt.NDArray[Any], sizes: Integers, point_data: Data, cell_data: Data | None = None
) -> bytes:
    """Return polygons as an unstructured grid.

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
    return _file("UnstructuredGrid", points, counts, {"Cells": arrays}, (point_data, cell_data or {}, {}))


def vtp_bytes(points: Points, corners: npt.NDArray[Any], sizes: Integers, point_data: Data) -> bytes:
    """Return polygons as polygon data; parameters as for :func:`vtu_bytes`."""
    arrays = {"connectivity": _indices(corners), "offsets": np.cumsum(sizes)}
    counts = f'NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="{len(sizes)}"'
    return _file("PolyData", points, counts, {"Polys": arrays}, (point_data, {}, {}))


def _indices(corners: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
    return np.asarray(corners, dtype=np.int64).ravel()


def _file(kind: str, points: Points, counts: str, cells: Mapping[str, Data], data: tuple[Data, Data, Data]) -> bytes:
    """Return a file with sections of cells, and point, cell and field data."""
    head = f'type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64"'
    point_data, cell_data, fields = data
    return "\n".join(
        [
            '<?xml version="1.0"?>',
            f'<VTKFile {head} compressor="vtkZLibDataCompressor">',
            f"<{kind}>",
            *([_section("FieldData", fields)] if fields else []),
            f'<Piece NumberOfPoints="{len(points)}" {counts}>',
            _section("Points", {"Points": np.asarray(points, dtype=np.float64)}),
            *(_section(name, arrays) for name, arrays in cells.items()),
            _section("PointData", point_data),
            _section("CellData", cell_data),
            f"</Piece></{kind}></VTKFile>\n",
        ]
    ).encode()


def _section(name: str, arrays: Data) -> str:
    lines = []
    for key, values in arrays.items():
        count = "" if values.ndim == 1 else f' NumberOfComponents="{values.shape[1]}"'
        count += f' NumberOfTuples="{len(values)}"' if name == "FieldData" else ""
        tag, kind, numbers = "DataArray", "", values
        if values.dtype.kind == "U":
            tag, kind, numbers = "Array", "String", string_codes(values)
        count += ' IdType="1"' if key == ORIGINAL_POINT and name == "PointData" else ""
        head = f'<{tag} type="{kind or type_name(values)}" Name={quoteattr(key)} format="binary"{count}>'
        lines.append(f"{head}\n{packed_array(numbers)}\n</{tag}>")
    known = "".join(f' {key}="{ours}"' for key, ours in active_names(arrays).items()) if name == "PointData" else ""
    return "\n".join([f"<{name}{known}>", *lines, f"</{name}>"])


def active_names(point_data: Data) -> dict[str, str]:
    """Return our names of the point data that VTK knows as texture coordinates, normals and global numbers."""
    meanings = [("TCoords", UV, (2, 3)), ("Normals", NORMAL, (3,))]
    found = {key: ours for key, ours, widths in meanings if _width(point_data.get(ours)) in widths}
    return found | ({"GlobalIds": ORIGINAL_POINT} if ORIGINAL_POINT in point_data else {})


def _width(values: Array | None) -> int:
    """Return the number of components of numbers, 0 for none."""
    return 0 if values is None or values.ndim < 2 or values.dtype.kind not in "iuf" else int(values.shape[1])
