"""Elements of Gmsh files: the types, and the blocks of versions 2 and 4."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Array, Carried, Integers, Marked, listed
from anisomesh.io.cells import N_CORNERS, Shape, SurfaceCells
from anisomesh.io.formats.gmsh.groups import PHYSICAL, Block, division_name, separate, stacked
from anisomesh.io.formats.gmsh.numbers import NumberStream
from anisomesh.io.formats.words import shown, whole
from anisomesh.io.polygons import PolygonSoup

TRIANGLE, LINE, POINT = 2, 1, 15  # types of elements of first order

# Number of nodes by type of element; of triangles and quadrilaterals of third order and more, corners come first.
_TRIANGLES = {2: 3, 9: 6, 20: 9, 21: 10, 22: 12, 23: 15, 24: 15, 25: 21, 42: 28, 43: 36, 44: 45, 45: 55, 46: 66}
_QUADS = {3: 4, 10: 9, 16: 8, 36: 16, 37: 25, 38: 36, 39: 12, 40: 16, 41: 20, 47: 49, 48: 64, 49: 81, 50: 100, 51: 121}
_GMSH_OTHERS: dict[str, dict[int, int]] = {
    "point": {15: 1},
    "line": {1: 2, 8: 3, 26: 4, 27: 5, 28: 6, 62: 7, 63: 8, 64: 9, 65: 10, 66: 11},
    "tetra": {4: 4, 11: 10, 29: 20, 30: 35, 31: 56, 71: 84, 72: 120, 73: 165, 74: 220, 75: 286},
    "hexahedron": {5: 8, 12: 27, 17: 20, 92: 64, 93: 125, 94: 216, 95: 343, 96: 512, 97: 729, 98: 1000},
    "prism": {6: 6, 13: 18, 18: 15, 90: 40, 91: 75, 106: 126, 107: 196, 108: 288, 109: 405, 110: 550},
    "pyramid": {7: 5, 14: 14, 19: 13},
}
_GMSH_SHAPES: dict[int, Shape] = {**dict.fromkeys(_TRIANGLES, "triangle"), **dict.fromkeys(_QUADS, "quad")}
_NAMES = {kind: name for name, kinds in _GMSH_OTHERS.items() for kind in kinds}
_N_NODES = {**_TRIANGLES, **_QUADS, **{kind: n for kinds in _GMSH_OTHERS.values() for kind, n in kinds.items()}}

_QUADRATIC_LINE = 8

GEOMETRICAL = "geometrical"
"""Name of the division into entities."""

Entities = dict[tuple[int, int], list[int]]  # physical groups of an entity, by dimension and tag


class Elements:
    """Collects the elements of a file with their numbers, physical groups and geometrical entities.

    Parameters
    ----------
    table
        Finds nodes by their tags.
    """

    def __init__(self, table: TagTable) -> None:
        self._cells = SurfaceCells()  # of numbers of nodes of elements, not of points
        self._nodes: list[Integers] = [np.zeros(0, dtype=np.int64)]  # point of each node of each element
        self._n_nodes = 0
        self._first: list[Integers] = [np.zeros((0, 2), dtype=np.int64)]
        self._table = table
        self._blocks: list[Block] = []
        self._count = 0
        self._lines, self._points = Marked(), Marked()
        self._n_unknown = 0  # lines and points of nodes that are not in the file

    def take_numbers(self, count: int) -> Integers:
        """Return numbers (count,) for the next cells of the file, counted from 0."""
        self._count += count
        return self._cells.take_numbers(count)

    def add(self, block: Block) -> None:
        """Add elements of a type."""
        self._blocks.append(block)
        kind, nodes, source, _, groups = block
        if kind in _GMSH_SHAPES:
            self._add_surface(kind, self._table.indices(nodes), source)
            return
        self._cells.ignore(_NAMES[kind], len(nodes))
        if _NAMES[kind] == "line":
            nodes = nodes[:, : 3 if kind == _QUADRATIC_LINE else 2]
            known = self._table.has(nodes).all(axis=1)
            self._lines.add(self._table.indices(nodes[known]), source[known])
            self._n_unknown += int(np.count_nonzero(~known))
        elif kind == POINT:
            known = self._table.has(nodes[:, 0])
            self._n_unknown += int(np.count_nonzero(~known))
            known &= groups.any(axis=1)
            self._points.add(self._table.indices(nodes[known, 0]), source[known])

    def _add_surface(self, kind: int, points: Integers, source: Integers) -> None:
        """Add triangles or quadrilaterals of a type, by their points (n, k)."""
        numbers = self._n_nodes + np.arange(points.size).reshape(points.shape)
        self._n_nodes += points.size
        self._nodes.append(points.ravel())
        self._first.append(np.stack([numbers[:, 0], np.full(len(points), points.shape[1])], axis=1))
        shape = _GMSH_SHAPES[kind]
        self._cells.add(shape, numbers, source, nodes_on_sides=_N_NODES[kind] <= 2 * N_CORNERS[shape] + 1)

    def soup(self, points: npt.NDArray[np.float64], carried: Carried, at_nodes: dict[str, Array]) -> PolygonSoup:
        """Return the elements of the surface as polygons.

        Parameters
        ----------
        points
            The points (V, 3).
        carried
            What the file carries besides.
        at_nodes
            Data by name with a row for each node of each element, as :attr:`node_places` numbers them, which become
            corner data.
        """
        soup = self._cells.soup(points, carried=carried)
        carried.corner_data |= {name: values[soup.corners] for name, values in at_nodes.items()}
        return replace(soup, corners=np.concatenate(self._nodes)[soup.corners])

    def carry(self, carried: Carried, named: Collection[str], unlabelled: int) -> Integers:
        """Add lines, points and divisions to what the file carries; return the numbers of the elements (n,).

        Divisions that are ``named`` are added in any case, others only if they are not trivial. Points of the physical
        group ``unlabelled`` have no label.
        """
        carried.lines, carried.fixed_points = self._lines, self._points
        if self._n_unknown:
            carried.remarks.append(f"left out {self._n_unknown} line(s) or point(s) of nodes that it does not have")
        table = np.zeros((self._count, 2), dtype=np.int64)
        for block in self._blocks:
            table[block.source] = block.tags
        for k, labels in enumerate(self._labels(_GMSH_OTHERS["line"], carried)):
            carried.lines.divide(division_name(k), labels)
        for k, labels in enumerate(self._labels(_GMSH_OTHERS["point"], carried)):
            carried.fixed_points.divide(division_name(k), np.where(labels == unlabelled, 0, labels))
        of_surface = self._labels(_GMSH_SHAPES, carried)
        for k, labels in enumerate(of_surface):
            if labels.any() or PHYSICAL in named:
                carried.add_cell_data(division_name(k), labels, names={})
        physical, entity = of_surface[0][self.surface], table[self.surface, 1]
        if GEOMETRICAL in named or (len(np.unique(entity)) > 1 and (entity != entities_of(physical)).any()):
            carried.add_cell_data(GEOMETRICAL, table[:, 1], names={})
        numbers: Integers = table[:, 0]
        return numbers

    def _labels(self, kinds: Collection[int], carried: Carried) -> list[Integers]:
        """Return the divisions of the elements of some types into physical groups, with a label for each cell (n,)."""
        blocks = [block for block in self._blocks if block.kind in kinds]
        divisions, left_out = separate(stacked([block.groups for block in blocks]))
        if left_out:
            numbers = listed([str(group) for group in left_out])
            carried.remarks.append(f"left out the physical group(s) {numbers}, which overlap too many others")
        labels = np.zeros((len(divisions), self._count), dtype=np.int64)
        labels[:, _sources(blocks)] = divisions
        return list(labels)

    @property
    def surface(self) -> Integers:
        """Numbers of the cells of the surface (n,)."""
        return _sources([block for block in self._blocks if block.kind in _GMSH_SHAPES])

    @property
    def node_places(self) -> Integers:
        """Number of the first node and number of nodes (n, 2) of the cells of the surface."""
        return np.concatenate(self._first)


def _sources(blocks: Sequence[Block]) -> Integers:
    """Return the numbers of the cells (n,) of blocks."""
    return np.concatenate([np.zeros(0, dtype=np.int64), *(block.source for block in blocks)])


def entities_of(physical: Integers) -> Integers:
    """Return the entities of elements (n,) if there is one for each physical group: its number, or one from 1."""
    if len(physical) and physical.min() > 0:
        return physical
    return np.unique(physical, return_inverse=True)[1].reshape(-1).astype(np.int64) + 1


def elements_2_text(numbers: NumberStream, elements: Elements) -> list[Block]:
    """Return elements of version 2, one a line: number, type, number of tags, tags, nodes."""
    count = numbers.line_count()
    by_type: dict[int, tuple[list[list[int]], list[int], list[list[int]]]] = {}
    for k, line in enumerate(numbers.lines(count)):
        row = list(map(int, line.split()))
        kind = row[1] if len(row) > 2 else 0
        n_tags = row[2] if len(row) > 2 else -1
        nodes = row[3 + n_tags :] if n_tags >= 0 else []
        if kind in _N_NODES and len(nodes) != _N_NODES[kind]:
            raise ValueError(f"truncated or malformed: element line {k + 1} reads {shown(line)}")
        rows, places, tags = by_type.setdefault(kind, ([], [], []))
        rows.append(nodes)
        places.append(k)
        given = row[3 : 3 + min(n_tags, 2)] if n_tags >= 0 else []
        tags.append([row[0] if row else 0, *given, *[0] * (2 - len(given))])
    source = elements.take_numbers(count)
    blocks = []
    for kind, (rows, places, tags) in by_type.items():
        _check_type(kind)
        blocks.append(_block(kind, np.array(rows, dtype=np.int64), source[places], np.array(tags, dtype=np.int64)))
    return blocks


def _block(kind: int, nodes: Integers, source: Integers, tags: Integers) -> Block:
    """Return a block of version 2, whose elements have number, physical group and entity (n, 3) as tags."""
    return Block(kind, nodes, source, tags[:, [0, 2]], tags[:, 1:2])


def elements_2_binary(numbers: NumberStream, elements: Elements) -> list[Block]:
    """Return elements of version 2 in blocks: type, number, number of tags, then number, tags and nodes of each."""
    left, blocks = numbers.line_count(), []
    while left > 0:
        kind, count, n_tags = whole(numbers.take(3, "<i4")).tolist()
        _check_type(kind)
        if count <= 0 or n_tags < 0:
            raise ValueError(f"malformed: a block declares {count} elements with {n_tags} tags each")
        width = 1 + n_tags + _N_NODES[kind]
        rows = whole(numbers.take(count * width, "<i4")).reshape(count, width)
        tags = np.zeros((count, 3), dtype=np.int64)
        tags[:, : 1 + min(n_tags, 2)] = rows[:, : 1 + min(n_tags, 2)]
        blocks.append(_block(kind, rows[:, 1 + n_tags :], elements.take_numbers(count), tags))
        left -= count
    return blocks


def elements_4(numbers: NumberStream, elements: Elements, entities: Entities, *, is_40: bool) -> list[Block]:
    """Return elements of version 4 in blocks: entity, type, number, then number and nodes of each."""
    n_blocks, declared = whole(numbers.take(2 if is_40 else 4, "size"))[:2].tolist()
    blocks = []
    for _ in range(n_blocks):
        first, second, kind = whole(numbers.take(3, "<i4")).tolist()
        dimension, entity = (second, first) if is_40 else (first, second)
        count = int(whole(numbers.take(1, "size"))[0])
        _check_type(kind)
        width = 1 + _N_NODES[kind]
        rows = whole(numbers.take(count * width, "<i4" if is_40 else "size")).reshape(count, width)
        tags = np.column_stack([rows[:, 0], np.full(count, entity, dtype=np.int64)])
        groups = np.tile(np.array(entities.get((dimension, entity), []), dtype=np.int64), (count, 1))
        blocks.append(Block(kind, rows[:, 1:], elements.take_numbers(count), tags, groups))
    found = sum(len(block.nodes) for block in blocks)
    if found != declared:
        raise ValueError(f"truncated or malformed: it declares {declared} elements but has {found}")
    return blocks


def _check_type(kind: int) -> None:
    if kind not in _N_NODES:
        raise ValueError(f"it has elements of type {kind}, which is not known; save it with elements of lower order")


class TagTable:
    """Finds nodes by their tags."""

    def __init__(self, tags: Integers) -> None:
        self._order = np.argsort(tags, kind="stable")
        self._sorted = tags[self._order]
        twice = np.flatnonzero(self._sorted[1:] == self._sorted[:-1])
        if len(twice):
            raise ValueError(f"malformed: two nodes have the tag {self._sorted[twice[0]]}")

    def indices(self, tags: npt.NDArray[Any]) -> Integers:
        """Return the indices of the nodes with these tags, of the same shape."""
        if len(self._sorted) == 0 and np.size(tags):
            raise ValueError("it has elements but no node")
        place = np.minimum(np.searchsorted(self._sorted, tags), len(self._sorted) - 1)
        missing = self._sorted[place] != tags
        if missing.any():
            raise ValueError(f"an element refers to node {tags[missing][0]}, which is not among the nodes")
        found: Integers = self._order[place]
        return found

    def has(self, tags: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
        """Return whether nodes have these tags, of the same shape."""
        return np.isin(tags, self._sorted)
