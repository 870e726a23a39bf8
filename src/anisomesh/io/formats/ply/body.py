"""The body of a PLY file: rows of values, text or binary."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Integers
from anisomesh.io.formats.ply.header import Element
from anisomesh.io.formats.words import parsed_integers, parsed_reals, shown

_BLANK = b"\0\t\n\r "


class PropertyValues(NamedTuple):
    """The values of a property in all rows, concatenated, and how many each row has."""

    values: npt.NDArray[np.float64] | Integers
    sizes: Integers


def _truncated(element: Element) -> ValueError:
    return ValueError(f"truncated: the header declares {element.count} x {element.name} and the data ends before")


@contextmanager
def _named(element: Element) -> Iterator[None]:
    """Put the name of an element in front of errors."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"element {element.name}: {error}") from None


class TextBody:
    """The body of an ascii file, read as a stream of words."""

    def __init__(self, words: list[bytes]) -> None:
        self.words = words
        self.position = 0

    @property
    def left(self) -> str:
        """What is behind the elements that were read, in words; empty if nothing is."""
        count = len(self.words) - self.position
        return f"{count} word(s)" if count else ""

    def read(self, element: Element, wanted: Iterable[str]) -> dict[str, PropertyValues]:
        """Read an element; return the properties with these names."""
        if not any(prop.count_type for prop in element.properties):
            return self._table(element, wanted)
        places: dict[str, tuple[list[int], list[int]]] = {name: ([], []) for name in wanted}
        at, limit = self.position, len(self.words)
        for _ in range(element.count):
            for prop in element.properties:
                if at >= limit:
                    raise _truncated(element)
                size = self._size(element, at) if prop.count_type else 1
                if size < 0:
                    raise ValueError(f"element {element.name}: a list of {size} values")
                at += bool(prop.count_type)
                if prop.name in places:
                    places[prop.name][0].append(at)
                    places[prop.name][1].append(size)
                at += size
        if at > limit:
            raise _truncated(element)
        self.position = at
        kinds = {prop.name: prop.type for prop in element.properties}
        with _named(element):
            return {name: self._column(kinds[name], *found) for name, found in places.items()}

    def _size(self, element: Element, at: int) -> int:
        """Return the size of the list that begins with a word."""
        try:
            return int(self.words[at])
        except ValueError:
            raise ValueError(f"element {element.name}: {shown(self.words[at])} is not the size of a list") from None

    def _column(self, kind: str, starts: list[int], sizes: list[int]) -> PropertyValues:
        words = self.words
        flat = [word for start, size in zip(starts, sizes, strict=True) for word in words[start : start + size]]
        return PropertyValues(
            parsed_reals(flat) if kind.startswith("f") else parsed_integers(flat), np.array(sizes, dtype=np.int64)
        )

    def _table(self, element: Element, wanted: Iterable[str]) -> dict[str, PropertyValues]:
        """Read an element of scalars."""
        width = len(element.properties)
        count = element.count * width
        if self.position + count > len(self.words):
            raise _truncated(element)
        self.position += count
        with _named(element):
            table = parsed_reals(self.words[self.position - count : self.position]).reshape(element.count, width)
        names = [prop.name for prop in element.properties]
        ones = np.ones(element.count, dtype=np.int64) if width else np.zeros(0, dtype=np.int64)
        return {name: PropertyValues(table[:, names.index(name)], ones) for name in wanted}


class BinaryBody:
    """The body of a binary file, read from ``start`` on."""

    def __init__(self, data: bytes, start: int, order: str) -> None:
        self.data = data
        self.position = start
        self.order = order

    @property
    def left(self) -> str:
        """What is behind the elements that were read, in words; empty if nothing is but white space."""
        count = len(self.data[self.position :].strip(_BLANK))
        return f"{count} byte(s)" if count else ""

    def read(self, element: Element, wanted: Iterable[str]) -> dict[str, PropertyValues]:
        """Read an element; return the properties with these names."""
        if not element.properties:
            return {}
        columns = self._equal_rows(element, wanted)
        return self._any_rows(element, wanted) if columns is None else columns

    def _equal_rows(self, element: Element, wanted: Iterable[str]) -> dict[str, PropertyValues] | None:
        """Read all rows as one array if their lists have the sizes of the first row's; else return None."""
        fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
        sizes, at = {}, self.position
        for prop in element.properties:
            size = 1
            if prop.count_type:
                if element.count:
                    size, at = self._list_size(prop.count_type, at, element)
                sizes[prop.name] = size
                fields.append((f"count {prop.name}", self.order + prop.count_type))
            fields.append((f"value {prop.name}", self.order + prop.type, (size,)))
            at += size * np.dtype(prop.type).itemsize
        dtype = np.dtype(fields)
        if self.position + element.count * dtype.itemsize > len(self.data):
            if sizes:
                return None
            raise _truncated(element)
        rows = np.frombuffer(self.data, dtype=dtype, count=element.count, offset=self.position)
        if any((rows[f"count {name}"] != size).any() for name, size in sizes.items()):
            return None
        self.position += rows.nbytes
        columns = {}
        for name in wanted:
            lengths = np.full(element.count, sizes.get(name, 1), dtype=np.int64)
            columns[name] = PropertyValues(_native(rows[f"value {name}"].ravel()), lengths)
        return columns

    def _any_rows(self, element: Element, wanted: Iterable[str]) -> dict[str, PropertyValues]:
        """Read row by row."""
        chunks: dict[str, tuple[list[bytes], list[int]]] = {name: ([], []) for name in wanted}
        at = self.position
        for _ in range(element.count):
            for prop in element.properties:
                size = 1
                if prop.count_type:
                    size, at = self._list_size(prop.count_type, at, element)
                width = size * np.dtype(prop.type).itemsize
                if prop.name in chunks:
                    chunks[prop.name][0].append(self.data[at : at + width])
                    chunks[prop.name][1].append(size)
                at += width
            if at > len(self.data):
                raise _truncated(element)
        self.position = at
        kinds = {prop.name: self.order + prop.type for prop in element.properties}
        return {
            name: PropertyValues(
                _native(np.frombuffer(b"".join(found), dtype=kinds[name])), np.array(lengths, dtype=np.int64)
            )
            for name, (found, lengths) in chunks.items()
        }

    def _list_size(self, kind: str, at: int, element: Element) -> tuple[int, int]:
        """Return the size of the list at a position and the position of its first value."""
        dtype = np.dtype(self.order + kind)
        if at + dtype.itemsize > len(self.data):
            raise _truncated(element)
        count = int(np.frombuffer(self.data, dtype=dtype, count=1, offset=at)[0])
        if count < 0:
            raise ValueError(f"element {element.name}: a list of {count} values")
        return count, at + dtype.itemsize


def _native(values: npt.NDArray[Any]) -> npt.NDArray[np.float64] | Integers:
    return values.astype(np.float64) if values.dtype.kind == "f" else values.astype(np.int64)
