"""The lines of an OBJ file by their first word."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Integers
from anisomesh.io.formats.words import parsed_reals, quick_table, text_of


@dataclass(frozen=True, eq=False)
class Lines:
    """The lines of a file.

    Attributes
    ----------
    lines
        All lines.
    kinds
        Their first three letters, with a space behind a shorter word.
    point_lines, face_lines
        The numbers of the lines of points and of faces.
    """

    lines: list[bytes]
    kinds: npt.NDArray[np.bytes_]
    point_lines: Integers
    face_lines: Integers

    def of(self, word: bytes) -> Integers:
        """Return the numbers of the lines that begin with a word."""
        if len(word) < 3:
            begin = self.kinds.astype(f"S{len(word) + 1}")
            return np.flatnonzero((begin == word + b" ") | (self.kinds == word))
        place = np.flatnonzero(self.kinds == word[:3])
        return np.array([k for k in place.tolist() if self.lines[k].split(None, 1)[0] == word], dtype=np.int64)

    def rest(self, number: int) -> str:
        """Return what follows the first word of a line; names may have a # in them, as in files of 3ds Max."""
        words = self.lines[number].strip().split(None, 1)
        return " ".join(text_of(words[1]).split()) if len(words) > 1 else ""

    def numbers(self, chosen: Integers) -> npt.NDArray[np.float64]:
        """Return the numbers of some lines (n, k), as many as the shortest of them has."""
        table = quick_table(self.lines, chosen, self.lines[chosen[0]].split(None, 1)[0])
        if table is not None:
            return table
        rows = [self.lines[k].partition(b"#")[0].split() for k in chosen]
        width = min(map(len, rows)) - 1
        return parsed_reals([word for row in rows for word in row[1 : 1 + width]]).reshape(len(rows), width)
