"""The lines of an OBJ file by their first word."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Integers


@dataclass(frozen=True, eq=False)
class Lines:
    """The lines of a file.

    Attributes
    ----------
    lines
        All lines.
    kinds
        Their first two letters.
    point_lines, face_lines
        The numbers of the lines of points and of faces.
    """

    lines: list[bytes]
    kinds: npt.NDArray[np.bytes_]
    point_lines: Integers
    face_lines: Integers

    def of(self, word: bytes) -> Integers:
        """Return the numbers of the lines that begin with a word."""
        place = np.flatnonzero((self.kinds == (word + b" ")[:2]) | (self.kinds == word[:2]))
        n, after = len(word), b" \t"
        found = [k for k in place.tolist() if (line := self.lines[k].lstrip())[:n] == word and line[n : n + 1] in after]
        return np.array(found, dtype=np.int64)

    def rest(self, number: int) -> str:
        """Return what follows the first word of a line; names may have a # in them, as in files of 3ds Max."""
        words = self.lines[number].strip().split(None, 1)
        return " ".join(words[1].decode("utf-8", errors="replace").split()) if len(words) > 1 else ""

    def numbers(self, chosen: Integers) -> npt.NDArray[np.float64]:
        """Return the numbers of some lines (n, k), as many as the shortest of them has."""
        rows = [self.lines[k].partition(b"#")[0].split() for k in chosen]
        width = min(map(len, rows)) - 1
        table = np.array([float(word) for row in rows for word in row[1 : 1 + width]], dtype=np.float64)
        return table.reshape(len(rows), width)
