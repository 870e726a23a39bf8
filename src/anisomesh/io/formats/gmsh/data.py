"""Physical groups, entities, and data of nodes and elements in Gmsh files."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Array, Carried, Division, Integers, grouped_columns, is_region
from anisomesh.io.formats.gmsh.elements import Entities
from anisomesh.io.formats.gmsh.groups import PHYSICAL, division_name
from anisomesh.io.formats.gmsh.numbers import NumberStream
from anisomesh.io.formats.gmsh.sections import COMMENTS, GmshFile
from anisomesh.io.formats.region_names import also_named
from anisomesh.io.formats.words import text_of, whole

COMMENT = "anisomesh regions"
"""Beginning of the comment that names divisions and regions, in JSON."""

UNLABELLED = "anisomesh points without region"
"""Beginning of the comment with the number of the physical group that only makes points fixed."""

_POINT, _LINE, _SURFACE = 0, 1, 2  # dimensions


def read_comments(file: GmshFile, carried: Carried) -> dict[str, dict[int, str]]:
    """Return the names of regions by division that a comment of ours has."""
    for section in file.named(COMMENTS):
        for line in section.splitlines():
            if line.startswith(COMMENT.encode()):
                with carried.optional("the names of regions"):
                    given = json.loads(line[len(COMMENT) :])
                    return {
                        str(name): {int(label): str(text) for label, text in names.items()}
                        for name, names in given.items()
                    }
    return {}


def read_unlabelled(file: GmshFile) -> int:
    """Return the number of the physical group of points without a label that a comment of ours has, 0 for none."""
    for section in file.named(COMMENTS):
        found = re.search(rb"^" + UNLABELLED.encode() + rb" (\d{1,10})\s*$", section, re.MULTILINE)
        if found is not None:
            return int(found[1])
    return 0


def name_regions(carried: Carried, named: dict[str, dict[int, str]], surface: Integers) -> None:
    """Make cell data divisions that have names of regions, or are called as divisions usually are.

    ``surface`` are the numbers of the cells (n,) that count.
    """
    for name, values in list(carried.cell_data.items()):
        if (name in named or is_region(name)) and _are_integers(values[surface]):
            del carried.cell_data[name]
            labels = np.zeros(len(values), dtype=np.int64)
            labels[surface] = whole(values[surface])
            carried.add_cell_data(name, labels, names=named.get(name))
    for name, names in named.items():
        if name in carried.divisions:
            carried.divisions[name].names.update(names)


def read_physical_names(file: GmshFile, carried: Carried) -> None:
    """Name the physical groups of surfaces, lines and points; names of volumes are left out with a remark."""
    divisions = {
        _POINT: carried.fixed_points.divisions,
        _LINE: carried.lines.divisions,
        _SURFACE: carried.divisions,
    }
    others = []
    for section in file.named("PhysicalNames"):
        for dimension, number, name in re.findall(rb"^\s*(\d)\s+(-?\d+)\s+\"([^\"\n]*)\"", section, re.MULTILINE):
            text = text_of(name)
            if int(dimension) not in divisions:
                others.append(text)
            elif PHYSICAL in divisions[int(dimension)]:
                _division_with(divisions[int(dimension)], int(number)).names[int(number)] = text
            else:
                also_named(carried, PHYSICAL, [text])
    if others:
        carried.remarks.append(f"left out physical groups of volumes: {', '.join(others)}")


def _division_with(divisions: dict[str, Division], group: int) -> Division:
    """Return the division that has a physical group; the first one if none has it."""
    names = [name for name in (division_name(k) for k in range(len(divisions))) if name in divisions]
    found = (divisions[name] for name in names[1:] if (divisions[name].labels == group).any())
    return next(found, divisions[PHYSICAL])


def read_entities(file: GmshFile, numbers: NumberStream, carried: Carried, *, is_40: bool) -> Entities:
    """Return the physical groups of each entity of version 4, and of parts of entities in partitions.

    A part without groups of its own has the ones of its entity.
    """
    entities: Entities = {}
    for section in file.named("Entities"):
        with carried.optional("the physical groups"):
            stream = numbers.of(section)
            for dimension, count in enumerate(whole(stream.take(4, "size")).tolist()):
                for _ in range(count):
                    tag = int(whole(stream.take(1, "<i4"))[0])
                    entities[dimension, tag] = _groups(stream, dimension, is_40=is_40)
    for section in file.named("PartitionedEntities"):
        carried.remarks.append("left out which partitions its elements are in")
        with carried.optional("the physical groups of its partitions"):
            if is_40 and numbers.binary:
                raise ValueError("it is binary of version 4.0; save it as version 4.1")
            _read_parts(numbers.of(section), entities, is_40=is_40)
    return entities


def _read_parts(stream: NumberStream, entities: Entities, *, is_40: bool) -> None:
    """Add the parts of entities in partitions, see :func:`read_entities`."""
    n_ghosts = int(whole(stream.take(2, "size"))[1])
    stream.take(2 * n_ghosts, "<i4")
    for dimension, count in enumerate(whole(stream.take(4, "size")).tolist()):
        for _ in range(count):
            tag, *parent = whole(stream.take(3, "<i4")).tolist()
            _tags(stream)  # the partitions
            groups = _groups(stream, dimension, is_40=is_40)
            entities[dimension, tag] = groups or entities.get((parent[0], parent[1]), [])


def _groups(stream: NumberStream, dimension: int, *, is_40: bool) -> list[int]:
    """Return the physical groups of an entity, behind its position or box, and pass over its boundary."""
    stream.take(3 if dimension == 0 and not is_40 else 6, "<f8")
    groups = _tags(stream)
    if dimension > 0:
        _tags(stream)
    return list(dict.fromkeys(abs(group) for group in groups))  # negative: inverted


def _tags(stream: NumberStream) -> list[int]:
    count = int(whole(stream.take(1, "size"))[0])
    tags: list[int] = whole(stream.take(count, "<i4")).tolist()
    return tags


def read_data(
    file: GmshFile, numbers: NumberStream, carried: Carried, tags: tuple[Integers, Integers], repeats: Integers
) -> None:
    """Read $NodeData and $ElementData, of the first time step each.

    ``tags`` are of the nodes and of the elements, ``repeats`` as of
    :func:`~anisomesh.io.formats.gmsh.groups.each_once`.
    """
    for name, into, rows, repeated in (
        ("NodeData", carried.point_data, tags[0], repeats[:0]),
        ("ElementData", carried.cell_data, tags[1], repeats),
    ):
        into |= _first_steps(file, name, carried, partial(_data, numbers, rows, _Repeated(repeated, carried)))


def read_data_at_corners(
    file: GmshFile, numbers: NumberStream, carried: Carried, tags: tuple[Integers, Integers], repeats: Integers
) -> dict[str, Array]:
    """Return $ElementNodeData of the first time step by name, with a row for each node of each element.

    Parameters
    ----------
    file, numbers
        The file, and a stream of numbers of its type.
    carried
        Remarks are added here.
    tags
        Tags (n,) of the elements, and number of the first node and number of nodes (n, 2) of each.
    repeats
        As of :func:`~anisomesh.io.formats.gmsh.groups.each_once`.
    """
    read = partial(_data_at_corners, numbers, *tags, _Repeated(repeats, carried))
    return _first_steps(file, "ElementNodeData", carried, read)


def _are_integers(values: Array) -> bool:
    return bool((np.isfinite(values) & (values == np.rint(values))).all()) and values.ndim == 1


class _Head(NamedTuple):
    """Name of data, number of components, number of rows, and the bytes behind the head."""

    name: str
    width: int
    n_rows: int
    body: bytes


class _Repeated(NamedTuple):
    """Elements that are left out since they repeat others, by the tags (n, 2) of both; says what is lost of them."""

    tags: Integers
    carried: Carried

    def compare(self, name: str, given: Integers, values: npt.NDArray[np.float64]) -> None:
        """Add a remark if data (n, k, width) of elements with given tags (n,) differ; nodes may be in another order."""
        place, has = _places(given, self.tags[:, 0])
        first, known = _places(given, self.tags[:, 1])
        if has.any():
            mine, other = np.sort(values[place[has]], axis=1), np.sort(values[first[has]], axis=1)
            is_same = ((mine == other) | (np.isnan(mine) & np.isnan(other))).all(axis=(1, 2)) & known[has]
            if n_lost := np.count_nonzero(~is_same):
                self.carried.remarks.append(
                    f"left out data {name!r} of {n_lost} element(s) that repeat others, whose data differ"
                )


def _first_steps(file: GmshFile, section: str, carried: Carried, read: Callable[[_Head], Array]) -> dict[str, Array]:
    """Return the data of all sections of a name by their own names, of the first time step each."""
    columns: dict[str, Array] = {}
    for content in file.named(section):
        with carried.optional(f"${section}"):
            head = _head(content)
            values = read(head)
            if head.name in columns:
                carried.remarks.append(f"left out a further time step of the data {head.name!r}")
            else:
                columns[head.name] = values
    return grouped_columns(columns)


def _head(section: bytes) -> _Head:
    """Return what the tags of data say: texts, real numbers and integers, each with their number in front."""
    lines = section.split(b"\n")
    at, header = 0, []
    for _ in range(3):  # strings, real numbers, integers
        count = int(lines[at]) if at < len(lines) else -1
        if not 0 <= count < len(lines) - at:
            raise ValueError("truncated: its tags do not end")
        header.append(lines[at + 1 : at + 1 + count])
        at += 1 + count
    if not header[0] or len(header[2]) < 3:
        raise ValueError("it has no name, or no number of components and of rows")
    name = text_of(header[0][0].strip().strip(b'"'))
    width, count = int(header[2][1]), int(header[2][2])
    if not (0 < width < 100 and 0 <= count <= len(section)):
        raise ValueError(f"malformed: {name!r} declares {count} rows of {width} numbers")
    return _Head(name, width, count, b"\n".join(lines[at:]))


def _data(numbers: NumberStream, tags: Integers, repeated: _Repeated, head: _Head) -> Array:
    """Return the rows of data, NaN where there are none."""
    given, rows = numbers.of(head.body).records(head.n_rows, head.width)
    place, known = _places(given, tags)
    if not known.any():
        raise ValueError(f"{head.name!r} has no row for what is in the file")
    repeated.compare(head.name, given, rows[:, None])
    table = np.full((len(tags), head.width), np.nan)
    table[known] = rows[place[known]]
    return table[:, 0] if head.width == 1 else table


def _data_at_corners(
    numbers: NumberStream, tags: Integers, places: Integers, repeated: _Repeated, head: _Head
) -> Array:
    """Return the rows of data at the nodes of elements, NaN where there are none."""
    table = np.full((int(places.sum(axis=1).max(initial=0)), head.width), np.nan)
    found = False
    for given, rows in numbers.of(head.body).blocks(head.n_rows, head.width):
        place, known = _places(given, tags)
        found |= bool(known.any())
        repeated.compare(head.name, given, rows)
        for k in range(rows.shape[1]):
            chosen = np.flatnonzero(known & (places[:, 1] > k))
            table[places[chosen, 0] + k] = rows[place[chosen], k]
    if not found:
        raise ValueError(f"{head.name!r} has no row for what is in the file")
    return table[:, 0] if head.width == 1 else table


def _places(given: Integers, tags: Integers) -> tuple[Integers, npt.NDArray[np.bool_]]:
    """Return where tags (n,) are among the given ones (m,), and whether they are."""
    if len(given) == 0:
        return np.zeros(len(tags), dtype=np.int64), np.zeros(len(tags), dtype=bool)
    order = np.argsort(given, kind="stable")
    place = order[np.minimum(np.searchsorted(given[order], tags), len(given) - 1)]
    return place, given[place] == tags
