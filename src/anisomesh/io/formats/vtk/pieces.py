"""Pieces of data sets of VTK, in files and in memory, put together to one polygon soup."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Array, Carried
from anisomesh.io.cells import SurfaceCells
from anisomesh.io.formats.region_names import also_named
from anisomesh.io.formats.vtk.cells import add_vtk_cells, add_vtk_lines
from anisomesh.io.formats.vtk.data import ORIGINAL_POINT, DataOfPieces, names_by_meaning, names_of_regions
from anisomesh.io.formats.vtk.marks import Marks, are_marks
from anisomesh.io.polygons import Integers, PolygonSoup

# Bits of the array vtkGhostType: https://vtk.org/doc/nightly/html/classvtkDataSetAttributes.html.
_GHOSTS, _GHOST_LEVELS = "vtkGhostType", "vtkGhostLevels"  # the second of VTK 6 and older: 0 or the layer of the ghost
_COPY, _REFINED, _HIDDEN_CELL, _HIDDEN_POINT = 1, 8, 32, 2


class Piece(NamedTuple):
    """A piece: points (V, 3), cells as an unstructured grid has them, data by name, and the names of active arrays.

    ``connectivity`` counts points from 0, ``offsets`` are the ends of cells in it, and ``active`` has the names of
    point data by the attribute that they are, such as ``"TCoords"``.
    """

    points: Array
    types: Array
    connectivity: Array
    offsets: Array
    point_data: dict[str, Array]
    cell_data: dict[str, Array]
    active: Mapping[str, str]


class Pieces:
    """Collects pieces.

    Notes
    -----
    Lines are features, vertices are fixed points, also in pieces of their own, at the points of other pieces that have
    the same coordinates. Cells that are copies of cells of other pieces, or hidden, are left
    out. Points with the same global number and the same coordinates are one.
    """

    def __init__(self) -> None:
        self.carried = Carried()
        self._cells = SurfaceCells()
        self._points: list[npt.NDArray[np.float64]] = [np.zeros((0, 3))]
        self._marks = Marks()
        self._n_points = self._n_copies = self._n_hidden = 0
        self._point_data, self._cell_data = DataOfPieces("PointData"), DataOfPieces("CellData")
        self._ours: dict[str, str] = {}
        self._numbers = ""  # name of the global numbers of points

    def add(self, piece: Piece) -> None:
        """Add a piece; ValueError if a cell is malformed or refers to a point that there is not."""
        points = np.asarray(piece.points, dtype=np.float64).reshape(-1, 3)
        self._ours |= names_by_meaning(piece.active, piece.point_data)
        self._numbers = piece.active.get("GlobalIds", "") or self._numbers
        piece = self._without_ghosts(piece)
        first = 0 if are_marks(piece.types) else self._n_points
        connectivity = _shifted(piece.connectivity, first, first + len(points))
        numbers = add_vtk_cells(self._cells, piece.types, connectivity, piece.offsets)
        if are_marks(piece.types):
            self._marks.add(points, piece.types, connectivity, piece.offsets, numbers)
            self._cell_data.add_marks(piece.cell_data, len(piece.types))
            self._point_data.add_marks(piece.point_data, 0)
            return
        add_vtk_lines(self.carried, piece.types, connectivity, piece.offsets, numbers)
        self._points.append(points)
        self._n_points += len(points)
        self._point_data.add(piece.point_data, len(points))
        self._cell_data.add(piece.cell_data, len(piece.types))

    def _without_ghosts(self, piece: Piece) -> Piece:
        """Return a piece without the cells that are marked as copies or hidden, and without the marks."""
        point_data, cell_data = dict(piece.point_data), dict(piece.cell_data)
        marks = [data.pop(name, None) for data in (cell_data, point_data) for name in (_GHOSTS, _GHOST_LEVELS)]
        piece = piece._replace(point_data=point_data, cell_data=cell_data)
        of_cells, levels, of_points, _ = (None if m is None or m.dtype.kind not in "iu" else m for m in marks)
        ends = np.asarray(piece.offsets, dtype=np.int64)
        sizes = np.diff(ends, prepend=0)
        if (of_cells is None and levels is None and of_points is None) or not (
            len(ends) == len(piece.types) and (sizes >= 0).all() and sizes.sum() == len(piece.connectivity)
        ):
            return piece
        owner = np.repeat(np.arange(len(sizes)), sizes)
        copies, hidden = np.zeros((2, len(sizes)), dtype=bool)
        if of_cells is not None:
            copies, hidden = of_cells & _COPY > 0, of_cells & (_REFINED | _HIDDEN_CELL) > 0
        if levels is not None:
            copies = copies | (levels > 0)
        if of_points is not None:
            hidden[owner[np.isin(piece.connectivity, np.flatnonzero(of_points & _HIDDEN_POINT))]] = True
        hidden &= ~copies
        self._n_copies += int(np.count_nonzero(copies))
        self._n_hidden += int(np.count_nonzero(hidden))
        kept = ~(copies | hidden)
        return piece._replace(
            types=np.asarray(piece.types)[kept],
            connectivity=np.asarray(piece.connectivity)[kept[owner]],
            offsets=np.cumsum(sizes[kept]),
            cell_data={name: values[kept] for name, values in cell_data.items()},
        )

    def soup(self, fields: dict[str, Array], remarks: tuple[str, ...] = ()) -> PolygonSoup:
        """Return everything, with field data by name."""
        carried = self.carried
        self._marks.place(self._points, carried)
        names = names_of_regions(fields, carried)
        for name, texts in (pair for of in names for pair in of.items()):
            also_named(carried, name, texts.values())
        for name in self._point_data.of_marks:
            carried.remarks.append(f"left out PointData {name!r} of lines and vertices")
        for name, values in self._point_data.all(carried).items():
            carried.point_data[self._ours.get(name, name)] = values
        for name, values in self._cell_data.all(carried).items():
            carried.add_data_of_all_cells(name, values, [of.get(name) for of in names])
            if name in self._cell_data.of_marks:
                carried.divisions.pop(name, None)
                carried.cell_data.pop(name, None)
        for count, what in ((self._n_copies, "ghosts, which are copies of others"), (self._n_hidden, "hidden")):
            remarks += (f"left out {count} cell(s) marked as {what}",) if count else ()
        soup = self._cells.soup(np.concatenate(self._points), remarks, carried)
        numbers = carried.point_data.get(self._numbers)
        if numbers is None or numbers.dtype.kind not in "iu" or len(np.unique(numbers)) == len(numbers):
            return soup
        if self._numbers == ORIGINAL_POINT:
            del carried.point_data[ORIGINAL_POINT]
        return _joined(soup, numbers)


def _shifted(connectivity: Array, first: int, count: int) -> Integers:
    """Return indices of points of the last piece as indices of all points."""
    shifted: Integers = connectivity.astype(np.int64) + first
    outside = np.flatnonzero((shifted < first) | (shifted >= count))
    if len(outside):
        raise ValueError(
            f"a cell refers to point {shifted[outside[0]] - first} (counted from 0) but there are "
            f"{count - first} points"
        )
    return shifted


def _joined(soup: PolygonSoup, numbers: Array) -> PolygonSoup:
    """Join points with the same number and coordinates; data in which they differ become corner data."""
    carried, n_points = soup.carried, len(soup.points)
    keys = np.column_stack([numbers.astype(np.int64), soup.points.view(np.int64)])
    _, first, place = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    chosen, place = first[order], rank[place.reshape(-1)]
    if len(chosen) == n_points:
        return soup
    used = np.unique(soup.corners)
    for name, values in list(carried.point_data.items()):
        rows, others = values[used], values[chosen[place[used]]]
        same = (rows == others) | ((rows != rows) & (others != others))
        if not same.all():
            carried.corner_data[name] = carried.point_data.pop(name)[soup.corners]
        else:
            carried.point_data[name] = values[chosen]
    for marked in (carried.lines, carried.fixed_points):
        marked.blocks = [place[block] for block in marked.blocks]
    return replace(soup, points=soup.points[chosen], corners=place[soup.corners])
