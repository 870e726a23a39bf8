"""Physical groups, entities, and data of nodes and elements in Gmsh files."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

import numpy as np

from anisomesh.io.carried import Array, Carried, Integers, grouped_columns, is_region
from anisomesh.io.formats.gmsh.elements import PHYSICAL, Entities
from anisomesh.io.formats.gmsh.numbers import NumberStream
from anisomesh.io.formats.words import whole

COMMENT = "anisomesh regions"
"""Beginning of the comment that names divisions and regions, in JSON."""

UNLABELLED = "anisomesh points without region"
"""Beginning of the comment with the number of the physical group that only makes points fixed."""

_POINT, _LINE, _SURFACE = 0, 1, 2  # dimensions
_SKIPPED = (b"ElementNodeData", b"Periodic", b"GhostElements", b"PartitionedEntities")


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
        columns: dict[str, Array] = {}
        for section in sections(data, name):
            with carried.optional(f"${name.decode()}"):
                key, values = _data(section, numbers, rows)
                if key in columns:
                    carried.remarks.append(f"left out a further time step of the data {key!r}")
                else:
                    columns[key] = values
        for key, values in grouped_columns(columns).items():
            into[key] = values


def _are_integers(values: Array) -> bool:
    return bool((np.isfinite(values) & (values == np.rint(values))).all()) and values.ndim == 1


def _data(section: bytes, numbers: NumberStream, tags: Integers) -> tuple[str, Array]:
    """Return the name and the rows of data, NaN where there are none."""
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
    given, rows = numbers.of(b"\n".join(lines[at:])).records(count, width)
    order = np.argsort(given, kind="stable")
    place = np.minimum(np.searchsorted(given[order], tags), max(count - 1, 0))
    known = given[order][place] == tags if count else np.zeros(len(tags), dtype=bool)
    if not known.any():
        raise ValueError(f"{name!r} has no row for what is in the file")
    table = np.full((len(tags), width), np.nan)
    table[known] = rows[order][place[known]]
    return name, table[:, 0] if width == 1 else table
