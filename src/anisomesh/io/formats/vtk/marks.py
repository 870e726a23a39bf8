"""Lines and vertices in pieces without a surface, at the points of other pieces that have the same coordinates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Array, Carried, Integers
from anisomesh.io.formats.vtk.cells import MARKS, add_vtk_lines

Points = npt.NDArray[np.float64]


def are_marks(types: Array) -> bool:
    """Return whether there are cells and all of them are lines and vertices, given their types (n,)."""
    return len(types) > 0 and bool(np.isin(types, MARKS).all())


class Marks:
    """Collects pieces of lines and vertices."""

    def __init__(self) -> None:
        self._found = Carried()
        self._points: list[Points] = [np.zeros((0, 3))]

    def add(self, points: Points, types: Array, connectivity: Integers, offsets: Array, numbers: Integers) -> None:
        """Add a valid piece: points (V, 3), cells as an unstructured grid has them, and numbers (n,) of the cells."""
        first = sum(map(len, self._points))
        add_vtk_lines(self._found, types, connectivity + first, offsets, numbers)
        self._points.append(points)

    def place(self, pieces: Sequence[Points], carried: Carried) -> None:
        """Add the lines and vertices at points of other pieces, given the points (V, 3) of each.

        Notes
        -----
        The ends of a line are points of one piece, the first that has both. What has no such points is left out with a
        remark.
        """
        marks = np.concatenate(self._points)
        tables = _tables(marks, pieces) if len(marks) else []
        for given, into, what in (
            (self._found.lines, carried.lines, "line(s) whose ends"),
            (self._found.fixed_points, carried.fixed_points, "vertex cell(s) whose points"),
        ):
            n_lost = 0
            for block, cells in zip(given.blocks, given.cells, strict=True):
                placed = _placed(block, tables)
                found = (placed >= 0).reshape(len(placed), -1).all(axis=1)
                into.add(placed[found], cells[found])
                n_lost += int(np.count_nonzero(~found))
            if n_lost:
                carried.remarks.append(f"left out {n_lost} {what} are not points of its surface")


def _tables(marks: Points, pieces: Sequence[Points]) -> list[Integers]:
    """Return for each piece which of all points (m,) has the coordinates of each of some points, -1 for none."""
    _, code = np.unique(np.concatenate([marks, *pieces]) + 0.0, axis=0, return_inverse=True)  # -0 becomes 0
    code = code.reshape(-1)
    tables, first = [], len(marks)
    for piece in pieces:
        index = np.full(code.max() + 1, -1, dtype=np.int64)
        index[code[first : first + len(piece)]] = np.arange(first, first + len(piece)) - len(marks)
        tables.append(index[code[: len(marks)]])
        first += len(piece)
    return tables


def _placed(block: Integers, tables: Sequence[Integers]) -> Integers:
    """Return lines (n, k) or vertices (n,) at the points of the first piece that has all of them, -1 for none."""
    placed = np.full_like(block, -1)
    for table in tables:
        there = table[block]
        new = (there >= 0).reshape(len(block), -1).all(axis=1) & (placed.reshape(len(block), -1) < 0).all(axis=1)
        placed[new] = there[new]
    return placed
