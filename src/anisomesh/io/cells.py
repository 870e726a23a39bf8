"""Cells of files that hold more than polygons: surface cells of any order become polygons, the others are counted."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Carried
from anisomesh.io.polygons import Integers, PolygonSoup

Shape = Literal["triangle", "quad"]
N_CORNERS: dict[Shape, int] = {"triangle": 3, "quad": 4}

# Parts of second-order cells by shape and number of nodes: corners first, then the nodes of the sides in order, then
# the middle, in VTK as in Gmsh (https://gmsh.info/doc/texinfo/gmsh.html#Node-ordering). Quadrilaterals of six nodes are
# VTK's, with nodes on the first and the third side.
_PARTS: dict[tuple[Shape, int], list[list[int]]] = {
    ("triangle", 6): [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
    ("triangle", 7): [[0, 3, 6], [3, 1, 6], [1, 4, 6], [4, 2, 6], [2, 5, 6], [5, 0, 6]],
    ("quad", 6): [[0, 4, 5, 3], [4, 1, 2, 5]],
    ("quad", 8): [[0, 4, 7], [4, 1, 5], [5, 2, 6], [6, 3, 7], [4, 5, 6, 7]],
    ("quad", 9): [[0, 4, 8, 7], [4, 1, 5, 8], [8, 5, 2, 6], [7, 8, 6, 3]],
}


class _Block(NamedTuple):
    shape: Shape
    nodes: Integers
    source: Integers
    nodes_on_sides: bool


class SurfaceCells:
    """Collects the cells of a file and makes a polygon soup of its surface cells.

    Notes
    -----
    Second-order cells are split at the nodes of their sides if all surface cells of the file are of second order.
    Otherwise cells of any higher order become polygons of their corners, so that neighbours share whole edges.
    """

    def __init__(self) -> None:
        self._cells: list[_Block] = []
        self._polygons: list[tuple[Integers, Integers, Integers]] = []
        self._others: Counter[str] = Counter()
        self._n_cells = 0
        self._n_cut = 0  # polygons of higher order

    def take_numbers(self, count: int) -> Integers:
        """Return numbers (count,) for the next cells of the file, counted from 0."""
        self._n_cells += count
        return np.arange(self._n_cells - count, self._n_cells)

    def add(
        self,
        shape: Shape,
        nodes: npt.NDArray[Any],
        source: Integers | None = None,
        *,
        nodes_on_sides: bool = True,
    ) -> None:
        """Add triangles or quadrilaterals (n, k) with k nodes each, the corners first.

        Parameters
        ----------
        shape
            Triangles or quadrilaterals.
        nodes
            Indices of points (n, k).
        source
            Numbers (n,) of the cells in the file; by default the next ones.
        nodes_on_sides
            False if nodes other than corners are not points of the surface or in another order.
        """
        numbers = self.take_numbers(len(nodes)) if source is None else source
        self._cells.append(_Block(shape, np.asarray(nodes, dtype=np.int64), numbers, nodes_on_sides))

    def add_polygons(
        self,
        corners: npt.NDArray[Any],
        sizes: Integers,
        source: Integers | None = None,
        *,
        higher_order: bool = False,
    ) -> None:
        """Add polygons.

        Parameters
        ----------
        corners
            Indices of points (sum of sizes,) of all polygons, concatenated.
        sizes
            Number of corners of each polygon (n,).
        source
            Numbers (n,) of the cells in the file; by default the next ones.
        higher_order
            Whether nodes of their sides were left out.
        """
        numbers = self.take_numbers(len(sizes)) if source is None else source
        self._polygons.append((np.asarray(corners, dtype=np.int64), np.asarray(sizes, dtype=np.int64), numbers))
        self._n_cut += len(sizes) if higher_order else 0

    def ignore(self, name: str, count: int = 1) -> None:
        """Count cells of this name that are not part of a surface, such as lines or tetrahedra."""
        self._others[name] += count

    def soup(
        self, points: npt.NDArray[np.float64], remarks: tuple[str, ...] = (), carried: Carried | None = None
    ) -> PolygonSoup:
        """Return the surface cells as polygons, in the order of the file, with what else the file carries.

        Raises
        ------
        ValueError
            If there are only cells of other kinds.
        """
        cells = [block for block in self._cells if len(block.nodes)]
        polygons = [part for part in self._polygons if len(part[1])]
        if not cells and not polygons and any(self._others.values()):
            names = ", ".join(sorted(name for name, count in self._others.items() if count))
            raise ValueError(f"it has only cells of type {names} and no surface; extract the boundary first")
        split = not polygons and all(
            block.nodes_on_sides and (block.shape, block.nodes.shape[1]) in _PARTS for block in cells
        )
        n_higher = self._n_cut
        for shape, nodes, source, _ in cells:
            n_higher += len(nodes) if nodes.shape[1] > N_CORNERS[shape] else 0
            parts = _PARTS[shape, nodes.shape[1]] if split else [list(range(N_CORNERS[shape]))]
            polygons += [
                (nodes[:, part].ravel(), np.full(len(nodes), len(part), dtype=np.int64), source) for part in parts
            ]
        if n_higher:
            way = "split at the nodes of their sides" if split else "read as polygons of their corners"
            remarks = (*remarks, f"{n_higher} cell(s) of higher order were {way}")
        soup = _in_file_order(points, polygons, carried or Carried())
        return replace(soup, remarks=remarks)


def _in_file_order(
    points: npt.NDArray[np.float64], parts: list[tuple[Integers, Integers, Integers]], carried: Carried
) -> PolygonSoup:
    none = np.zeros(0, dtype=np.int64)
    corners, sizes, source = (np.concatenate([none, *(part[k] for part in parts)]) for k in range(3))
    order = np.argsort(source, kind="stable")
    if (np.diff(order) != 1).any():
        first = (np.cumsum(sizes) - sizes)[order]
        sizes, source = sizes[order], source[order]
        step = np.arange(len(corners)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        rows = np.repeat(first, sizes) + step
        corners = corners[rows]
        carried.take_corners(rows)
    return PolygonSoup(points=points, corners=corners, sizes=sizes, source=source, carried=carried)


def strip_triangles(strip: npt.NDArray[Any]) -> Integers:
    """Return the triangles (n, 3) of a strip of points, every other one turned, without the ones of repeated points."""
    strip = np.asarray(strip, dtype=np.int64)
    if len(strip) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    rows = np.stack([strip[:-2], strip[1:-1], strip[2:]], axis=1)
    rows[1::2] = rows[1::2, [1, 0, 2]]
    a, b, c = rows.T
    triangles: Integers = rows[(a != b) & (b != c) & (c != a)]
    return triangles
