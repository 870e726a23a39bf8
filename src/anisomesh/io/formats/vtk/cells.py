"""The cell types of VTK, in files and in memory. Numbers: https://vtk.org/doc/nightly/html/vtkCellType_8h.html."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Carried
from anisomesh.io.cells import N_CORNERS, Shape, SurfaceCells, strip_triangles
from anisomesh.io.polygons import Integers

VERTEX, LINE, TRIANGLE, STRIP, POLYGON, PIXEL, QUAD, QUADRATIC_POLYGON = 1, 3, 5, 6, 7, 8, 9, 36

_POLY_VERTEX, _POLY_LINE, _QUADRATIC_EDGE = 2, 4, 21
_N_TYPES = 256  # of one byte

_VTK_SHAPES: dict[int, Shape] = {
    **dict.fromkeys((TRIANGLE, 22, 34, 61, 69, 76), "triangle"),
    **dict.fromkeys((PIXEL, QUAD, 23, 28, 30, 62, 70, 77), "quad"),
}
_NODES_ON_SIDES = (22, 23, 28, 30, 34, 69, 70)  # the others of higher order have control points or another order
_VTK_OTHERS = {
    **dict.fromkeys((0, 1, 2), "vertex"),
    **dict.fromkeys((3, 4, 21, 35, 51, 60, 68, 75), "line"),
    **dict.fromkeys((10, 24, 55, 64, 71, 78), "tetra"),
    **dict.fromkeys((11, 12, 25, 29, 33, 56, 67, 72, 79), "hexahedron"),
    **dict.fromkeys((13, 26, 31, 32, 65, 73, 80), "wedge"),
    **dict.fromkeys((14, 27, 37, 66, 74, 81), "pyramid"),
    **dict.fromkeys((15, 16, 41, 42), "polyhedron"),
}

MARKS = tuple(kind for kind, name in _VTK_OTHERS.items() if name in ("vertex", "line"))
"""Types of cells that mark points and edges of a surface."""


def add_vtk_cells(
    cells: SurfaceCells, types: npt.NDArray[Any], connectivity: npt.NDArray[Any], offsets: npt.NDArray[Any]
) -> Integers:
    """Add cells as an unstructured grid of VTK has them, and return their numbers (n,) among all cells.

    Parameters
    ----------
    cells
        The cells are added here.
    types
        Type of each cell (n,).
    connectivity
        Point indices of all cells, concatenated.
    offsets
        End of each cell in ``connectivity`` (n,).

    Raises
    ------
    ValueError
        If offsets are not plausible, a cell has a wrong number of points, or its type is unknown.
    """
    types, ends = np.asarray(types, dtype=np.int64), np.asarray(offsets, dtype=np.int64)
    sizes = np.diff(ends, prepend=0)
    if len(types) != len(ends) or (sizes < 0).any() or (len(ends) and ends[-1] > len(connectivity)):
        raise ValueError("malformed: the offsets of the cells do not fit their points and types")
    unknown = np.flatnonzero((types < 0) | (types >= _N_TYPES))
    if len(unknown):
        raise ValueError(f"malformed: cell {unknown[0]} is of type {types[unknown[0]]}; expected 0 to {_N_TYPES - 1}")
    connectivity = np.asarray(connectivity, dtype=np.int64)
    source = cells.take_numbers(len(types))
    kind = sizes * _N_TYPES + types
    for key in np.unique(kind).tolist():
        size, cell_type = divmod(key, _N_TYPES)
        chosen = np.flatnonzero(kind == key)
        if cell_type in _VTK_OTHERS:
            cells.ignore(_VTK_OTHERS[cell_type], len(chosen))
        else:
            nodes = connectivity[(ends[chosen] - size)[:, None] + np.arange(size)]
            _add_surface_cells(cells, cell_type, nodes, source[chosen])
    return source


def add_vtk_lines(
    carried: Carried, types: npt.NDArray[Any], connectivity: Integers, offsets: npt.NDArray[Any], numbers: Integers
) -> None:
    """Add the lines of a valid grid, and its vertices as fixed points.

    ``numbers`` are the ones that :func:`add_vtk_cells` returns, whose parameters the others are.
    """
    types, ends = np.asarray(types, dtype=np.int64), np.asarray(offsets, dtype=np.int64)
    sizes = np.diff(ends, prepend=0)
    for cell_type, size in ((VERTEX, 1), (_POLY_VERTEX, 0), (LINE, 0), (_POLY_LINE, 0), (_QUADRATIC_EDGE, 3)):
        chosen = np.flatnonzero((types == cell_type) & (sizes >= (size or 1)))
        if len(chosen) == 0:
            continue
        if cell_type in (VERTEX, _POLY_VERTEX):
            rows = np.repeat(ends[chosen] - sizes[chosen], sizes[chosen])
            step = np.arange(len(rows)) - np.repeat(np.cumsum(sizes[chosen]) - sizes[chosen], sizes[chosen])
            carried.fixed_points.add(connectivity[rows + step], np.repeat(numbers[chosen], sizes[chosen]))
        elif cell_type == _QUADRATIC_EDGE:
            carried.lines.add(connectivity[(ends[chosen] - 3)[:, None] + np.arange(3)], numbers[chosen])
        else:
            owner = np.repeat(np.arange(len(ends)), sizes)
            within = (owner[1:] == owner[:-1]) & (types[owner[1:]] == cell_type)
            start = np.flatnonzero(within)
            carried.lines.add(np.stack([connectivity[start], connectivity[start + 1]], axis=1), numbers[owner[start]])


def _add_surface_cells(cells: SurfaceCells, cell_type: int, nodes: Integers, source: Integers) -> None:
    n, size = nodes.shape
    if cell_type == STRIP:
        triangles = [strip_triangles(strip) for strip in nodes]
        numbers = np.repeat(source, [len(rows) for rows in triangles])
        cells.add("triangle", np.concatenate(triangles), numbers)
    elif cell_type == POLYGON:
        cells.add_polygons(nodes.ravel(), np.full(n, size), source)
    elif cell_type == QUADRATIC_POLYGON:
        cells.add_polygons(nodes[:, : size // 2].ravel(), np.full(n, size // 2), source, higher_order=True)
    elif cell_type in _VTK_SHAPES:
        shape = _VTK_SHAPES[cell_type]
        if size < N_CORNERS[shape]:
            raise ValueError(f"malformed: cell {source[0]} of type {cell_type} has {size} points")
        nodes = nodes[:, [0, 1, 3, 2]] if cell_type == PIXEL and size == 4 else nodes
        cells.add(shape, nodes, source, nodes_on_sides=cell_type in _NODES_ON_SIDES)
    else:
        raise ValueError(f"cell {source[0]} is of type {cell_type}, which is not known; convert it to triangles")
