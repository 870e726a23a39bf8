"""What a file carries besides points and polygons, as readers find it."""

from __future__ import annotations

import lzma
import re
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
Integers = npt.NDArray[np.int64]

UV, NORMAL, COLOUR = "uv", "normal", "color"
"""Names of texture coordinates, unit normals and colours, whatever a format calls them."""

_BROKEN = (
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    OverflowError,
    RecursionError,
    zlib.error,
    lzma.LZMAError,
)  # what malformed data make readers raise
_FEW_REGIONS = 8  # up to which integers with a telling name are regions in any case; heuristic
_FACES_PER_REGION = 2  # at least, if there are more; heuristic
_SURFACE = 2  # dimension
_MAX_NAMES = 6  # in a remark
_REGION = re.compile(
    r"(gmsh:)?(physical|geometrical)|medit:ref|reference|(domain|part|zone|block|region|material|group|object|solid)s?"
    r"|(cell_?entity|model_?face|domain|part|zone|block|region|material|group|object|face|boundary)_?(ids?|tags?|labels?)",
    re.IGNORECASE,
)


@dataclass(kw_only=True, eq=False)
class Division:
    """A division of the cells of a file into regions: labels (n,), and names of labels."""

    labels: Integers
    names: dict[int, str] = field(default_factory=dict)


@dataclass(kw_only=True, eq=False)
class Marked:
    """Lines or points that a file marks, in blocks, with divisions of them into regions.

    Attributes
    ----------
    blocks
        Arrays of points, (n,) of points, (n, 2) of straight lines or (n, 3) of lines of second order with the node in
        the middle last.
    cells
        For each block the numbers (n,) of the cells of the file, which the labels of divisions belong to, -1 for none.
    divisions
        Divisions by name, with a label for each cell.
    """

    blocks: list[Integers] = field(default_factory=list)
    cells: list[Integers] = field(default_factory=list)
    divisions: dict[str, Division] = field(default_factory=dict)

    def add(self, block: Integers, cells: Integers | None = None) -> None:
        """Add a block, with the numbers of its cells if they have labels."""
        self.blocks.append(block)
        self.cells.append(np.full(len(block), -1, dtype=np.int64) if cells is None else cells)

    def divide(self, name: str, labels: Integers, names: dict[int, str] | None = None) -> None:
        """Add a division by labels of all cells of the file, unless all lines or points have the label 0."""
        used = np.concatenate([np.zeros(0, dtype=np.int64), *self.cells])
        used = used[used >= 0]
        if labels[used].any():
            self.divisions[name] = Division(labels=labels.astype(np.int64), names=names or {})

    def labels(self, name: str) -> Integers:
        """Return the labels (n,) of a division of the rows of all blocks, 0 for none."""
        cells = np.concatenate([np.zeros(0, dtype=np.int64), *self.cells])
        labels: Integers = np.append(self.divisions[name].labels, 0)[cells]
        return labels


@dataclass(kw_only=True, eq=False)
class Carried:
    """What a file carries besides points and polygons, not validated.

    Attributes
    ----------
    point_data, cell_data, corner_data
        Arrays by name, with a row for each point, each face or cell of the file, or each corner of the polygons.
    divisions
        Divisions of the faces or cells of the file by name.
    lines, fixed_points
        Lines and points that a mesh is to keep.
    fixed_cells
        Numbers (n,) of faces or cells of the file that are to stay as they are.
    materials
        Whatever belongs to the file as a whole.
    named
        Names of regions by division that the file gives besides the ones of divisions, since nothing may be in them.
    lost_at_marks
        Names of cell data that hold something at lines or points that a mesh is to keep, which have no data.
    remarks
        What was left out, a line each.
    """

    point_data: dict[str, Array] = field(default_factory=dict)
    cell_data: dict[str, Array] = field(default_factory=dict)
    corner_data: dict[str, Array] = field(default_factory=dict)
    divisions: dict[str, Division] = field(default_factory=dict)
    lines: Marked = field(default_factory=Marked)
    fixed_points: Marked = field(default_factory=Marked)
    fixed_cells: Integers = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    materials: dict[str, Any] = field(default_factory=dict)
    named: dict[str, list[str]] = field(default_factory=dict)
    lost_at_marks: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)

    @contextmanager
    def optional(self, what: str) -> Iterator[None]:
        """Leave out, with a remark, what cannot be read in a block, so that the geometry survives it."""
        try:
            yield
        except _BROKEN as error:
            reason = str(error) if type(error) is ValueError else f"{type(error).__name__}: {error}"
            self.remarks.append(" ".join(f"left out {what}: {reason}".split()))

    def add_cell_data(self, name: str, values: Array, *, names: dict[int, str] | None = None) -> None:
        """Add cell data: a division if its labels have names or it is called as divisions usually are."""
        if _is_division(name, values, names):
            self.divisions[name] = Division(labels=values.astype(np.int64), names=names or {})
        else:
            self.cell_data[name] = values

    def add_data_of_all_cells(self, name: str, values: Array, names: Sequence[dict[int, str] | None]) -> None:
        """Add data of cells among which are lines and fixed points, as data of faces and as divisions of each.

        ``names`` are the ones of regions of points, lines and faces, None where none are given. What is a division of
        points or lines, and 0 elsewhere, is not added to the faces unless they have a list of names, if an empty one.
        """
        elsewhere = np.ones(len(values), dtype=bool)
        found = False
        for marked, own in zip((self.fixed_points, self.lines), names, strict=False):
            cells = np.concatenate([np.zeros(0, dtype=np.int64), *marked.cells])
            elsewhere[cells] = False
            if _is_division(name, values[cells], own):
                marked.divide(name, values, own)
                found |= name in marked.divisions
        if not found or values[elsewhere].any() or names[_SURFACE] is not None:
            self.add_cell_data(name, values, names=names[_SURFACE])
        self.note_marks(name, values)

    def note_marks(self, name: str, values: Array) -> None:
        """Note whether data of all cells of the file hold something at lines or points that are in no such division.

        NaN, 0 and empty strings, which stand for no value there, are nothing.
        """
        for marked in (self.fixed_points, self.lines):
            cells = np.concatenate([np.zeros(0, dtype=np.int64), *marked.cells])
            rows = values[cells[cells >= 0]]
            is_text = rows.dtype.kind in "SU"
            nothing = rows == rows.dtype.type() if is_text else ~rows.astype(bool) | (rows != rows)
            if name not in marked.divisions and name not in self.lost_at_marks and not nothing.all():
                self.lost_at_marks.append(name)

    def take_corners(self, rows: Array) -> None:
        """Take rows of the corner data, given by their numbers or a mask."""
        for name, values in list(self.corner_data.items()):
            with self.optional(f"corner data {name!r}"):
                self.corner_data[name] = values[rows]


def _is_division(name: str, labels: Array, names: dict[int, str] | None) -> bool:
    """Return whether data are a division into regions: their labels have names, or they are called as usual."""
    if labels.ndim != 1 or labels.dtype.kind not in "iu":
        return False
    most = max(_FEW_REGIONS, len(labels) // _FACES_PER_REGION)
    return names is not None or (is_region(name) and len(np.unique(labels)) <= most)


def listed(names: Sequence[str]) -> str:
    """Return some names, and the number of further ones, for a remark."""
    more = f" and {len(names) - _MAX_NAMES:,} more" if len(names) > _MAX_NAMES else ""
    return ", ".join(names[:_MAX_NAMES]) + more


def is_region(name: str) -> bool:
    """Return whether cell data of integers with this name are usually regions."""
    return _REGION.fullmatch(name) is not None


def grouped_columns(columns: dict[str, Array]) -> dict[str, Array]:
    """Return scalars (n,) by name with runs ``a_0``, ``a_1``, ... as one array ``a`` (n, k)."""
    grouped: dict[str, Array] = {}
    for name, values in columns.items():
        base, _, number = name.rpartition("_")
        if base and number.isdigit() and base not in columns:
            width = next(k for k in range(len(columns) + 1) if f"{base}_{k}" not in columns)
            parts = [columns[f"{base}_{k}"] for k in range(width)]
            if width > 1 and len({part.dtype for part in parts}) == 1 and int(number) < width:
                grouped.setdefault(base, np.stack(parts, axis=1))
                continue
        grouped[name] = values
    return grouped


def separate_columns(data: dict[str, Array]) -> dict[str, Array]:
    """Return arrays (n, k) as scalars (n,) with the names ``a_0``, ``a_1``, ...."""
    columns: dict[str, Array] = {}
    for name, values in data.items():
        if values.ndim == 1:
            columns[name] = values
        else:
            rows = values.reshape(len(values), -1)
            alone = rows.shape[1] == 1
            columns |= {name if alone else f"{name}_{k}": rows[:, k] for k in range(rows.shape[1])}
    return columns
