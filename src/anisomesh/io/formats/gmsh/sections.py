"""The sections of Gmsh files."""

from __future__ import annotations

import re
from collections.abc import Iterator

from anisomesh.io.formats.words import text_of

COMMENTS = "Comments"
"""Name of the section that may be in front of all others."""

HEADER = "MeshFormat"
"""Name of the section that begins a file."""

_BEGIN = re.compile(rb"^\$(\w+)", re.MULTILINE)


class GmshFile:
    """A file by the names of its sections; what looks like a section within another one is not read as one.

    Parameters
    ----------
    data
        The file.

    Raises
    ------
    ValueError
        If it has another beginning, or a section begins that does not end: nothing behind it would be read.
    """

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._places: list[tuple[str, int, int]] = []
        at = 0
        while (found := _BEGIN.search(data, at)) is not None:
            name = text_of(found[1])
            if name not in (COMMENTS, HEADER) and HEADER not in self.names:
                break
            start, stop = data.find(b"\n", found.end()) + 1, data.find(b"$End" + found[1], found.end())
            if stop < 0 or not 0 < start <= stop:
                raise ValueError(f"truncated: its ${name} has no $End{name}")
            self._places.append((name, start, stop))
            at = stop + len(b"$End" + found[1])
        if HEADER not in self.names:
            raise ValueError(f"it does not begin with ${HEADER} as a Gmsh file does")

    @property
    def names(self) -> list[str]:
        """The names of all sections, in order."""
        return [name for name, _, _ in self._places]

    def named(self, name: str) -> Iterator[bytes]:
        """Yield the contents of all sections of a name, without their first and last lines."""
        for other, start, stop in self._places:
            if other == name:
                yield self._data[start:stop]

    def has_content(self, name: str) -> bool:
        """Return whether a section of a name has more in it than white space or a count of 0."""
        return any(content.strip(b"\0\t\r\n ") not in (b"", b"0") for content in self.named(name))

    def first(self, name: str) -> bytes:
        """Return the content of the first section of a name; ValueError if there is none."""
        content = next(self.named(name), None)
        if content is None:
            raise ValueError(f"truncated: it has no ${name} with an $End{name}")
        return content
