"""Physical groups, entities, and data of nodes and elements in Gmsh files."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Array, Carried, Integers, grouped_columns, is_region
from anisomesh.io.formats.gmsh.elements import PHYSICAL, Entities
from anisomesh.io.formats.gmsh.numbers import NumberStream
from anisomesh.io.formats.region_names import also_named
from anisomesh.io.formats.words import whole

COMMENT = "anisomesh regions"
"""Beginning of the comment that names divisions and regions, in JSON."""

UNLABELLED = "anisomesh points without region"
"""Beginning of the comment with the number of the physical group that only makes points fixed."""

_POINT, _LINE, _SURFACE = 0, 1, 2  # dimensions
_SKIPPED = (b"Periodic", b"GhostElements", b"PartitionedEntities")


def sections(data: bytes, name: bytes) -> Iterator[bytes]:
    """Yield the contents of all sections of a name that end."""
    begin, end, at = b"$" + name, b"$End" + name, 0
    while (first := data.find(begin, at)) >= 0:
        start, stop = data.find(b"\n", first) + 1, data.find(end, first)
        if start == 0 or stop < start:
            return
        if data[first + len(begin) : start].strip() == b"":
            yield data[start:stop]
        at = stop + len(end)


def read_comments(data: bytes, carried: Carried) -> dict[str, dict[int, str]]:
    """Return the names of regions by division that a comment of ours has."""
    for section in sections(data, b"Comments"):
        for line in section.splitlines():
            if line.startswith(COMMENT.encode()):
                with carried.optional("the names of regions"):
                    given = json.loads(line[len(COMMENT) :])
                    return {
                        str(name): {int(label): str(text) for label, text in names.items()}
                        for name, names in given.items()
                    }
    return {}


def read_unlabelled(data: bytes) -> int:
    """Return the number of the physical group of points without a label that a comment of ours has, 0 for none."""
    for section in sections(data, b"Comments"):
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


def read_physical_names(data: bytes, carried: Carried) -> None:
    """Name the physical groups of surfaces, lines and points; names of volumes are left out with a remark."""
    divisions = {
        _POINT: carried.fixed_points.divisions,
        _LINE: carried.lines.divisions,
        _SURFACE: carried.divisions,
    }
    others = []
    for section in sections(data, b"PhysicalNames"):
        for dimension, number, name in re.findall(rb"^\s*(\d)\s+(-?\d+)\s+\"([^\"\n]*)\"", section, re.MULTILINE):
            text = name.decode("utf-8", errors="replace")
            if int(dimension) not in divisions:
                others.append(text)
            elif PHYSICAL in divisions[int(dimension)]:
                divisions[int(dimension)][PHYSICAL].names[int(number)] = text
            else:
                also_named(carried, PHYSICAL, [text])
    if others:
        carried.remarks.append(f"left out physical groups of volumes: {', '.join(others)}")
    skipped = [name.decode() for name in _SKIPPED if b"$" + name in data]
    if skipped:
        carried.remarks.append(f"left out its {', '.join(skipped)}")


def read_entities(data: bytes, numbers: NumberStream, carried: Carried, *, is_40: bool) -> Entities:
    """Return the physical group of each entity of version 4 that has one; the first if it is in several."""
    entities: Entities = {}
    n_several = [0, 0, 0, 0]
    for section in sections(data, b"Entities"):
        with carried.optional("the physical groups"):
            stream = numbers.of(section)
            counts = whole(stream.take(4, "size")).tolist()
            for dimension, count in enumerate(counts):
                for _ in range(count):
                    tag = int(whole(stream.take(1, "<i4"))[0])
                    stream.take(3 if dimension == 0 and not is_40 else 6, "<f8")
                    groups = _tags(stream)
                    if dimension > 0:
                        _tags(stream)
                    if groups:
                        entities[dimension, tag] = abs(groups[0])  # negative: turned
                    n_several[dimension] += len(groups) > 1
    for count, what in zip(n_several, ("point(s)", "curve(s)", "surface(s)"), strict=False):
        if count:
            carried.remarks.append(f"{count} {what} are in several physical groups and kept in the first only")
    return entities


def _tags(stream: NumberStream) -> list[int]:
    count = int(whole(stream.take(1, "size"))[0])
    tags: list[int] = whole(stream.take(count, "<i4")).tolist()
    return tags


def read_data(data: bytes, numbers: NumberStream, carried: Carried, tags: tuple[Integers, Integers]) -> None:
    """Read $NodeData and $ElementData, of the first time step each; ``tags`` are of the nodes and of the elements."""
    for name, into, rows in (
        (b"NodeData", carried.point_data, tags[0]),
        (b"ElementData", carried.cell_data, tags[1]),
    ):
        into |= _first_steps(data, name, carried, partial(_data, numbers, rows))


def read_data_at_corners(
    data: bytes, numbers: NumberStream, carried: Carried, tags: Integers, places: Integers
) -> dict[str, Array]:
    """Return $ElementNodeData of the first time step by name, with a row for each node of each element.

    Parameters
    ----------
    data, numbers
        The file, and a stream of numbers of its type.
    carried
        Remarks are added here.
    tags, places
        Tags (n,) of the elements, and number of the first node and number of nodes (n, 2) of each.
    """
    return _first_steps(data, b"ElementNodeData", carried, partial(_data_at_corners, numbers, tags, places))


def _are_integers(values: Array) -> bool:
    return bool((np.isfinite(values) & (values == np.rint(values))).all()) and values.ndim == 1


class _Head(NamedTuple):
    """Name of data, number of components, number of rows, and the bytes behind the head."""

    name: str
    width: int
    n_rows: int
    body: bytes


def _first_steps(data: bytes, section: bytes, carried: Carried, read: Callable[[_Head], Array]) -> dict[str, Array]:
    """Return the data of all sections of a name by their own names, of the first time step each."""
    columns: dict[str, Array] = {}
    for content in sections(data, section):
        with carried.optional(f"${section.decode()}"):
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
    name = header[0][0].strip().strip(b'"').decode("utf-8", errors="replace")
    width, count = int(header[2][1]), int(header[2][2])
    if not (0 < width < 100 and 0 <= count <= len(section)):
        raise ValueError(f"malformed: {name!r} declares {count} rows of {width} numbers")
    return _Head(name, width, count, b"\n".join(lines[at:]))


def _data(numbers: NumberStream, tags: Integers, head: _Head) -> Array:
    """Return the rows of data, NaN where there are none."""
    given, rows = numbers.of(head.body).records(head.n_rows, head.width)
    place, known = _places(given, tags)
    if not known.any():
        raise ValueError(f"{head.name!r} has no row for what is in the file")
    table = np.full((len(tags), head.width), np.nan)
    table[known] = rows[place[known]]
    return table[:, 0] if head.width == 1 else table


def _data_at_corners(numbers: NumberStream, tags: Integers, places: Integers, head: _Head) -> Array:
    """Return the rows of data at the nodes of elements, NaN where there are none."""
    table = np.full((int(places.sum(axis=1).max(initial=0)), head.width), np.nan)
    found = False
    for given, rows in numbers.of(head.body).blocks(head.n_rows, head.width):
        place, known = _places(given, tags)
        found |= bool(known.any())
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
