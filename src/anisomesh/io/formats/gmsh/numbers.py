"""Numbers of a section of a Gmsh file, read one after the other from text or binary."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.io.formats.words import parsed_reals, shown, whole
from anisomesh.io.polygons import Integers


class NumberStream:
    """The numbers of a section.

    Parameters
    ----------
    section
        The bytes between the first and the last line.
    binary
        Whether they are binary.
    order
        Byte order, ``"<"`` or ``">"``.
    size_bytes
        Bytes of a number of type "size".
    """

    def __init__(self, section: bytes, *, binary: bool, order: str, size_bytes: int) -> None:
        self.binary = binary
        self._order = order
        self._size_bytes = size_bytes
        self._bytes = section
        self._words: list[bytes] | None = None
        self._position = 0

    def of(self, section: bytes) -> NumberStream:
        """Return a stream of the same type over another section."""
        return NumberStream(section, binary=self.binary, order=self._order, size_bytes=self._size_bytes)

    def line_count(self) -> int:
        """Return the number in the first line, which is text in binary files too; ValueError if it is not a count."""
        line, _, self._bytes = self._bytes.partition(b"\n")
        if not line.strip().isdigit():
            raise ValueError(f"malformed: {shown(line)} is not a count")
        return int(line)

    def lines(self, count: int) -> list[bytes]:
        """Return the next lines that are not empty, in a text file; ValueError if there are fewer."""
        lines = [line for line in self._bytes.splitlines() if line.strip()]
        if len(lines) < count:
            raise ValueError(f"truncated: it declares {count} lines but {len(lines)} follow")
        self._bytes = b"\n".join(lines[count:])
        return lines[:count]

    @property
    def n_left(self) -> int:
        """How much is left: words of text, or bytes."""
        if self.binary:
            return len(self._bytes[self._position :].strip(b"\0\r\n\t "))
        return len(self._bytes.split()) if self._words is None else len(self._words) - self._position

    def take(self, count: int, kind: str) -> npt.NDArray[Any]:
        """Return the next numbers (count,), float64 in a text file; ValueError if there are fewer.

        Parameters
        ----------
        count
            How many.
        kind
            In a binary file their NumPy type, or ``"size"``.
        """
        dtype = np.dtype(self._order + (f"u{self._size_bytes}" if kind == "size" else kind[1:]))
        start = self._position
        self._position += count * (dtype.itemsize if self.binary else 1)
        if self._words is None and not self.binary:
            self._words = self._bytes.split()
        available = len(self._bytes) if self._words is None else len(self._words)
        if count < 0 or self._position > available:
            raise ValueError(f"truncated or malformed: it declares {count} numbers where fewer follow")
        if self._words is None:
            return np.frombuffer(self._bytes[start : self._position], dtype=dtype)
        return parsed_reals(self._words[start : self._position])

    def records(self, count: int, width: int = 3) -> tuple[Integers, npt.NDArray[np.float64]]:
        """Return the next rows of a tag and ``width`` coordinates: tags (count,), coordinates (count, width)."""
        if not self.binary:
            table = self.take((1 + width) * count, "<f8").reshape(count, 1 + width)
            return whole(table[:, 0]), table[:, 1:]
        dtype = np.dtype([("tag", self._order + "i4"), ("xyz", self._order + "f8", (width,))])
        rows = self.take(count * dtype.itemsize, "<i1").view(dtype)
        return rows["tag"].astype(np.int64), rows["xyz"].astype(np.float64)

    def blocks(self, count: int, width: int) -> list[tuple[Integers, npt.NDArray[np.float64]]]:
        """Return rows of a tag, a number of nodes and ``width`` values for each node, one block for each such number.

        Parameters
        ----------
        count
            How many rows there are.
        width
            Number of values of a node.

        Returns
        -------
        list
            Tags (n,) and values (n, k, width) of the rows with k nodes.

        Raises
        ------
        ValueError
            If the rows do not end within the section.
        """
        per_value = 2 if self.binary else 1  # integers of 4 bytes in a binary value, words in one of text
        words = self.take(len(self._bytes) // 4, "<i4") if self.binary else self.take(len(self._bytes.split()), "<f8")
        first = self._row_starts(words, count, width * per_value)
        found = []
        sizes = whole(words[first + 1])
        for size in np.unique(sizes).tolist():
            chosen = first[sizes == size]
            rows = words[chosen[:, None] + 2 + np.arange(size * width * per_value)]
            values = rows.view(self._order + "f8") if self.binary else rows
            found.append((whole(words[chosen]), values.astype(np.float64).reshape(len(chosen), size, width)))
        return found

    @staticmethod
    def _row_starts(words: npt.NDArray[Any], count: int, per_node: int) -> Integers:
        """Return where rows of a tag, a number of nodes and ``per_node`` words for each node begin (count,)."""
        size = int(whole(words[1:2])[0]) if count and len(words) > 1 else 0
        length = 2 + size * per_node
        if size > 0 and count * length <= len(words) and (words[1 : count * length : length] == size).all():
            return np.arange(count) * length
        first, at = np.zeros(count, dtype=np.int64), 0
        for k in range(count):
            size = int(words[at + 1]) if at + 1 < len(words) else 0
            if size < 1 or at + 2 + size * per_node > len(words):
                raise ValueError(f"truncated or malformed: row {k + 1} of {count} does not end")
            first[k] = at
            at += 2 + size * per_node
        return first
