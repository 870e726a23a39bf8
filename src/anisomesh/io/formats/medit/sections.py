"""The sections of MEDIT files, text and binary.

Format: Frey, "MEDIT: an interactive mesh visualization software", INRIA RT-0253; the layout of binary files is the one
of libMeshb 7, https://github.com/LoicMarechal/libMeshb.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Integers
from anisomesh.io.formats.medit.keywords import END, KEYWORDS
from anisomesh.io.formats.words import parsed_integers, parsed_reals, text_of, whole, without_end_marks

PLANE, SPACE = 2, 3
"""Dimensions of files: numbers of coordinates of points."""

_NAMES_BY_NUMBER = {code: name for name, code in KEYWORDS.items()}
_LONG_POSITIONS, _LONG_INTEGERS = 3, 4  # first versions whose positions, and whose integers, have 64 bits


class Numbers(NamedTuple):
    """Rows of real numbers (n, k) and of integers (n, m), which are float64 if some do not fit 64 bits."""

    reals: npt.NDArray[np.float64]
    integers: npt.NDArray[Any]


class Section(Protocol):
    """A section of a file, whose numbers are read from the first one on."""

    name: str

    @property
    def n_left(self) -> int:
        """How much is left: words of text, or bytes."""

    @property
    def is_read(self) -> bool:
        """Whether something of it was read."""

    def count(self) -> int:
        """Return the next number, which counts rows."""

    def types(self, count: int) -> list[int]:
        """Return the next integers, which have 32 bits in any version."""

    def rows(self, count: int, reals: int, integers: int) -> Numbers:
        """Return rows of real numbers, with integers behind them."""


class Sections(NamedTuple):
    """A file: the number of coordinates of points, its sections in order, whether it has an end, and text behind it."""

    dimension: int
    sections: list[Section]
    ends: bool
    is_followed: bool

    def named(self, name: str) -> Section | None:
        """Return the last section of a name."""
        return next((section for section in reversed(self.sections) if section.name == name), None)


def table(section: Section, reals: int, integers: int) -> Numbers:
    """Return the rows of a section that begins with their number."""
    return section.rows(section.count(), reals, integers)


def marks(section: Section) -> Integers:
    """Return the numbers (n,), from 0, that a section lists."""
    numbers: Integers = whole(table(section, 0, 1).integers)[:, 0] - 1
    return numbers


def read_sections(data: bytes) -> Sections:
    """Return the sections of a file, text or binary.

    Raises
    ------
    ValueError
        If it is neither, of a version or dimension that is not known, or cut off between sections.
    """
    cookie = {b"\x01\x00\x00\x00": "<", b"\x00\x00\x00\x01": ">"}.get(data[:4])
    found = list(_text_sections(data) if cookie is None else _binary_sections(data, "<" if cookie == "<" else ">"))
    end = next((k for k, section in enumerate(found) if section.name == END), len(found))
    ends = end < len(found)
    is_followed = cookie is None and ends and (end + 1 < len(found) or found[end].n_left > 0)
    found = found[:end]
    dimension = SPACE
    for section in found:
        if section.name == "Dimension" and section.n_left:
            dimension = section.types(1)[0]
            if dimension not in (PLANE, SPACE):
                raise ValueError(f"its dimension is {dimension}; expected {PLANE} or {SPACE}")
    return Sections(dimension, [section for section in found if section.name != "Dimension"], ends, is_followed)


class _Text:
    """A section of text."""

    def __init__(self, name: str, words: list[bytes]) -> None:
        self.name = name
        self._words, self._at = words, 0

    @property
    def n_left(self) -> int:
        return len(self._words) - self._at

    @property
    def is_read(self) -> bool:
        return self._at > 0

    def count(self) -> int:
        if not self.n_left or not self._words[self._at].isdigit():
            raise ValueError(f"truncated: the section {self.name} has no count")
        self._at += 1
        return int(self._words[self._at - 1])

    def types(self, count: int) -> list[int]:
        found: list[int] = whole(self._take(count)).tolist()
        return found

    def rows(self, count: int, reals: int, integers: int) -> Numbers:
        width = reals + integers
        if self.n_left < count * width:
            raise ValueError(
                f"truncated: {self.name} declares {count} rows of {width} but {self.n_left} numbers follow"
            )
        words = self._words[self._at : self._at + count * width]
        self._at += len(words)
        of_reals = [self._numbers(words[k::width]) for k in range(reals)]
        of_integers = [self._integers(words[k::width]) for k in range(reals, width)]
        return Numbers(
            np.stack(of_reals, axis=1) if reals else np.zeros((count, 0)),
            np.stack(of_integers, axis=1) if integers else np.zeros((count, 0), dtype=np.int64),
        )

    def _take(self, count: int) -> npt.NDArray[np.float64]:
        if not 0 <= count <= self.n_left:
            raise ValueError(
                f"truncated: the section {self.name} has {self.n_left} numbers where {count} should follow"
            )
        self._at += count
        return self._numbers(self._words[self._at - count : self._at])

    def _integers(self, words: list[bytes]) -> npt.NDArray[Any]:
        try:
            return parsed_integers(words)
        except ValueError:
            return self._numbers(words)

    def _numbers(self, words: list[bytes]) -> npt.NDArray[np.float64]:
        try:
            return parsed_reals(words)
        except ValueError as error:
            raise ValueError(f"malformed: the section {self.name} should give numbers: {error}") from None


def _text_sections(data: bytes) -> Iterator[Section]:
    words = re.sub(rb"#[^\r\n]*", b"", without_end_marks(data)).split()
    if not words or not words[0].startswith(b"MeshVersionFormatted"):
        raise ValueError("it does not begin with MeshVersionFormatted as a MEDIT text file does")
    starts = [k for k, word in enumerate(words) if word[:1].isalpha() and word.lower() not in (b"nan", b"inf")]
    for k, end in zip(starts, [*starts[1:], len(words)], strict=True):
        yield _Text(text_of(words[k]), words[k + 1 : end])


class _Layout(NamedTuple):
    """Byte order of a binary file, its version, and the bytes of its real numbers."""

    order: Literal["<", ">"]
    version: int
    real_bytes: int

    @property
    def integer(self) -> str:
        return f"{self.order}i{8 if self.version >= _LONG_INTEGERS else 4}"


class _Binary:
    """A section of a binary file."""

    def __init__(self, name: str, data: memoryview, layout: _Layout) -> None:
        self.name = name
        self._data, self._layout, self._size = data, layout, len(data)

    @property
    def n_left(self) -> int:
        return len(self._data)

    @property
    def is_read(self) -> bool:
        return len(self._data) < self._size

    def count(self) -> int:
        count = int(self._take(self._layout.integer, 1)[0])
        if count < 0:
            raise ValueError(f"malformed: the section {self.name} declares {count} rows")
        return count

    def types(self, count: int) -> list[int]:
        found: list[int] = self._take(f"{self._layout.order}i4", count).tolist()
        return found

    def rows(self, count: int, reals: int, integers: int) -> Numbers:
        real = f"{self._layout.order}f{self._layout.real_bytes}"
        rows = self._take(np.dtype([("reals", real, (reals,)), ("integers", self._layout.integer, (integers,))]), count)
        return Numbers(rows["reals"].astype(np.float64), rows["integers"].astype(np.int64))

    def _take(self, kind: npt.DTypeLike, count: int) -> npt.NDArray[Any]:
        dtype = np.dtype(kind)
        size = count * dtype.itemsize
        if not 0 <= size <= len(self._data):
            raise ValueError(
                f"truncated: the section {self.name} has {len(self._data)} bytes where {size} should follow"
            )
        taken, self._data = self._data[:size], self._data[size:]
        return np.frombuffer(taken, dtype=dtype)


def _binary_sections(data: bytes, order: Literal["<", ">"]) -> Iterator[Section]:
    """Yield the sections, each of which says where the next one begins."""
    whole_file = memoryview(data)

    def integers(at: int, kind: str, count: int = 1) -> list[int]:
        size = count * np.dtype(kind).itemsize
        if at + size > len(data):
            raise ValueError(f"truncated: a section should begin at byte {at} of {len(data)}")
        found: list[int] = np.frombuffer(whole_file[at : at + size], dtype=order + kind).tolist()
        return found

    version = integers(4, "i4")[0]
    if not 1 <= version <= _LONG_INTEGERS:
        raise ValueError(f"its version is {version}; expected 1 to {_LONG_INTEGERS}")
    layout = _Layout(order, version, 4 if version == 1 else 8)
    position = "i8" if version >= _LONG_POSITIONS else "i4"
    at = 8
    while 0 < at < len(data):
        code = integers(at, "i4")[0]
        name = _NAMES_BY_NUMBER.get(code, f"of number {code}")
        begin = at + 4 + np.dtype(position).itemsize
        after = 0 if name == END else integers(at + 4, position)[0]
        end = after or max(begin, len(data))
        if not begin <= end <= max(begin, len(data)):
            raise ValueError(f"truncated or malformed: the section {name} ends at byte {end} of {len(data)}")
        section = _Binary(name, whole_file[begin:end], layout)
        if name == "FloatingPointPrecision":
            layout = layout._replace(real_bytes={32: 4, 64: 8}.get(section.count(), layout.real_bytes))
        else:
            yield section
        at = after
