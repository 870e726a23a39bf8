"""Mesh objects of other libraries as polygon soups, told apart by their attributes, so that no library is imported."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, cast

import numpy as np

from anisomesh.io.carried import Array, Carried
from anisomesh.io.cells import Shape, SurfaceCells
from anisomesh.io.formats.region_names import add_set, also_named
from anisomesh.io.formats.vtk.data import NAMES_OF_FEATURE_REGIONS, NAMES_OF_POINT_REGIONS, NAMES_OF_REGIONS
from anisomesh.io.formats.vtk.marks import are_marks
from anisomesh.io.formats.vtk.pieces import Piece, Pieces
from anisomesh.io.objects.trimesh_scenes import scene_soup
from anisomesh.io.polygons import PolygonSoup

BLOCK = "block"
"""Name of the division into the blocks of a ``MultiBlock``."""

CELL_SET = "cell_set"
"""Name of the division into the cell sets of meshio; further ones, for sets that overlap, have a number."""

MESHIO_DIVISIONS = {"gmsh:physical": "physical", "gmsh:geometrical": "geometrical", "medit:ref": "reference"}
"""Our names of divisions of meshio, as the readers of these formats call them."""

_MESHIO_SURFACE = re.compile(r"(?:VTK_LAGRANGE_)?(TRIANGLE|QUAD|POLYGON)(?:RILATERAL)?\d*", re.IGNORECASE)
_MESHIO_OTHER = re.compile(
    r"vertex|line\d*|tetra\d*|hexahedron\d*|wedge\d*|pyramid\d*|penta_prism|hexa_prism|polyhedron\d*"
    r"|VTK_LAGRANGE_(?:CURVE|TETRAHEDRON|HEXAHEDRON|WEDGE|PYRAMID)"
)
_N_DIMENSIONS = 3  # of physical groups that are read: points, lines and faces


def polygon_soup(mesh: Any) -> PolygonSoup | None:
    """Return a mesh object as polygons with everything that it carries; None if it is of another type.

    Parameters
    ----------
    mesh
        A ``trimesh.Trimesh``; a ``trimesh.Scene``, with its transformations applied; a ``meshio.Mesh``; a
        ``pyvista.MultiBlock``, or any data set of PyVista that can become an unstructured grid.

    Raises
    ------
    ValueError
        If there are only cells that are not part of a surface, or some of unknown type.
    """
    readers: list[tuple[tuple[str, ...], Callable[[Any], PolygonSoup]]] = [
        (("n_blocks",), _from_vtk),
        (("cast_to_unstructured_grid",), _from_vtk),
        (("geometry", "graph", "dump"), scene_soup),
        (("points", "cells", "cell_data"), _from_meshio),
        (("vertices", "faces"), scene_soup),
    ]
    for attributes, read in readers:
        if all(hasattr(mesh, name) for name in attributes):
            return read(mesh)
    return None


def _from_vtk(mesh: Any) -> PolygonSoup:
    """Return a data set of PyVista, or all data sets in blocks of blocks."""
    pieces, remarks, fields, blocks = Pieces(), list[str](), dict[str, Array](), list(_blocks(mesh))
    numbered = hasattr(mesh, "n_blocks")
    if numbered and any(BLOCK in getattr(block, "cell_data", {}) for _, block in blocks):
        numbered = False
        pieces.carried.remarks.append(f"left out the names of its blocks, whose cells have data {BLOCK!r}")
    start = int(bool(blocks) and _is_marks(blocks[0][1]))  # the label 0 of lines and vertices is the one for none
    for number, (_, block) in enumerate(blocks, start):
        if not hasattr(block, "cast_to_unstructured_grid"):
            remarks.append(f"left out a block of type {type(block).__name__}, which has no cells")
            continue
        grid, point_data = block.cast_to_unstructured_grid(), block.point_data
        active = {
            "TCoords": point_data.active_texture_coordinates_name or "",
            "Normals": point_data.active_normals_name or "",
            "GlobalIds": getattr(point_data.GetGlobalIds(), "GetName", str)(),
        }
        cell_data = _arrays(grid.cell_data) | ({BLOCK: np.full(grid.n_cells, number)} if numbered else {})
        offsets = grid.cell_offsets if hasattr(grid, "cell_offsets") else grid.offset  # older versions
        cells = np.asarray(grid.celltypes), np.asarray(grid.cell_connectivity), np.asarray(offsets)[1:]
        pieces.add(Piece(np.asarray(grid.points), *cells, _arrays(grid.point_data), cell_data, active))
        for key, values in _arrays(block.field_data).items():
            if not np.array_equal(fields.setdefault(key, values), values):
                pieces.carried.remarks.append(f"left out field data {key!r} of further blocks")
    if numbered:
        text = "\n".join(f"{k} {' '.join(name.split())}" for k, (name, _) in enumerate(blocks, start))
        for beginning in (NAMES_OF_POINT_REGIONS, NAMES_OF_FEATURE_REGIONS, NAMES_OF_REGIONS):
            fields[beginning + BLOCK] = np.frombuffer(text.encode(), np.uint8)
    return pieces.soup({**fields, **_arrays(mesh.field_data)}, tuple(remarks))


def _is_marks(block: Any) -> bool:
    """Return whether a data set has only lines and vertices."""
    return hasattr(block, "cast_to_unstructured_grid") and are_marks(block.cast_to_unstructured_grid().celltypes)


def _blocks(mesh: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the data sets in blocks of blocks with their names, such as ``wing/upper``."""
    if mesh is None or not hasattr(mesh, "n_blocks"):
        yield from () if mesh is None else [(name, mesh)]
        return
    for k, block in enumerate(mesh):
        own = str(mesh.get_block_name(k) or k) if hasattr(mesh, "get_block_name") else str(k)
        yield from _blocks(block, f"{name}/{own}" if name else own)


def _arrays(data: Mapping[str, Any]) -> dict[str, Array]:
    """Return data of PyVista or meshio as arrays by name."""
    return {str(name): np.asarray(values) for name, values in data.items()}


def _from_meshio(mesh: Any) -> PolygonSoup:
    cells, carried = SurfaceCells(), Carried()
    for block in mesh.cells:
        surface = _MESHIO_SURFACE.fullmatch(block.type)
        if surface is not None and surface[1].lower() == "polygon":
            sizes = np.array([len(row) for row in block.data], dtype=np.int64)
            corners = [np.asarray(row, dtype=np.int64) for row in block.data]
            cells.add_polygons(np.concatenate([np.zeros(0, dtype=np.int64), *corners]), sizes)
        elif surface is not None:
            cells.add(cast(Shape, surface[1].lower()), np.asarray(block.data))
        elif _MESHIO_OTHER.fullmatch(block.type):
            cells.ignore(block.type, len(block.data))
            numbers = cells.take_numbers(len(block.data))
        else:
            raise ValueError(f"it has cells of type {block.type!r}, which is not known; convert them to triangles")
        if block.type in ("line", "line3"):
            carried.lines.add(np.asarray(block.data, dtype=np.int64), numbers)
        elif block.type == "vertex":
            carried.fixed_points.add(np.asarray(block.data, dtype=np.int64).ravel(), numbers)
    _carry_meshio(mesh, carried)
    points = np.asarray(mesh.points, dtype=np.float64)
    return cells.soup(np.pad(points, ((0, 0), (0, 3 - points.shape[1]))), carried=carried)


def _carry_meshio(mesh: Any, carried: Carried) -> None:
    """Add point and cell data, physical groups with their names, and sets of points and cells."""
    carried.point_data |= _arrays(mesh.point_data)
    groups = {name: np.ravel(value).tolist() for name, value in mesh.field_data.items()}
    names = [{value[0]: name for name, value in groups.items() if value[1:] == [d]} for d in range(_N_DIMENSIONS)]
    also_named(carried, MESHIO_DIVISIONS["gmsh:physical"], (text for of in names for text in of.values()))
    volumes = [name for name, value in groups.items() if value[1:] == [_N_DIMENSIONS]]
    if volumes:
        carried.remarks.append(f"left out physical groups of volumes: {', '.join(volumes)}")
    for name, blocks in mesh.cell_data.items():
        with carried.optional(f"cell data {name!r}"):
            labelled = names if name == "gmsh:physical" else [None] * _N_DIMENSIONS
            carried.add_data_of_all_cells(MESHIO_DIVISIONS.get(name, name), np.concatenate(blocks), labelled)
    for name, chosen in mesh.point_sets.items():
        with carried.optional(f"the set of points {name!r}"):
            is_in = np.zeros(len(mesh.points), dtype=bool)
            is_in[np.asarray(chosen, dtype=np.int64)] = True
            if carried.point_data.setdefault(name, is_in) is not is_in:
                raise ValueError("point data have its name")
    first = np.cumsum([0, *(len(block.data) for block in mesh.cells)])
    for name, blocks in mesh.cell_sets.items():
        with carried.optional(f"the set of cells {name!r}"):
            rows = [
                np.asarray(() if rows is None else rows, dtype=np.int64) + start
                for rows, start in zip(blocks, first, strict=False)
            ]
            chosen = np.concatenate(rows)
            if len(chosen) == 0:
                also_named(carried, CELL_SET, [name])
            else:
                add_set(carried, CELL_SET, name, chosen, int(first[-1]))
    are_faces = [np.full(len(block.data), _MESHIO_SURFACE.fullmatch(block.type) is not None) for block in mesh.cells]
    for name, division in list(carried.divisions.items()):
        if name.startswith(CELL_SET):
            if not division.labels[np.concatenate(are_faces)].any():
                del carried.divisions[name]
                also_named(carried, name, division.names.values())
            for marked in (carried.fixed_points, carried.lines):
                marked.divide(name, division.labels, division.names)
