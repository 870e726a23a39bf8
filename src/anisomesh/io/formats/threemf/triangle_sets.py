"""Named sets of the triangles of objects of 3MF.

Format: chapter on triangle sets of
https://github.com/3MFConsortium/spec_core/blob/master/3MF%20Core%20Specification.md.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field

import numpy as np

from anisomesh.io.carried import Carried, Integers
from anisomesh.io.formats.region_names import add_set, also_named
from anisomesh.io.formats.threemf.resources import integer_attributes

TRIANGLE_SETS = "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07"

DIVISION = "triangle_set"
"""Name of the division into sets of triangles; further ones, for sets that overlap, have a number."""


@dataclass
class TriangleSet:
    """A set of triangles of an object: its name, first and last numbers of ranges of triangles, and what is wrong."""

    name: str
    first: array[int] = field(default_factory=lambda: array("q"))
    last: array[int] = field(default_factory=lambda: array("q"))
    fault: str = ""

    def rows(self, count: int) -> Integers:
        """Return the numbers of its triangles (n,), ValueError if one is not among the triangles of its object."""
        if self.fault:
            raise ValueError(self.fault)
        first, last = np.array(self.first, dtype=np.int64), np.array(self.last, dtype=np.int64)
        if (last < first).any():
            k = int(np.argmax(last < first))
            raise ValueError(f"it has a range that begins with {first[k]} and ends with {last[k]}")
        if len(first) and (first.min() < 0 or last.max() >= count):
            raise ValueError(f"it refers to a triangle beyond the {count} triangles of its object")
        change = np.zeros(count + 1, dtype=np.int64)
        np.add.at(change, first, 1)
        np.add.at(change, last + 1, -1)
        return np.flatnonzero(np.cumsum(change)[:count]).astype(np.int64)


def take(sets: list[TriangleSet], element: str, attributes: dict[str, str]) -> None:
    """Take an element of the extension into the sets of an object."""
    if element == "triangleset":
        sets.append(TriangleSet(attributes.get("name", "") or attributes.get("identifier", "")))
    elif element in ("ref", "refrange") and sets:
        keys = ("index", "index") if element == "ref" else ("startindex", "endindex")
        try:
            first, last = integer_attributes(attributes, *keys)
        except KeyError as error:
            sets[-1].fault = f"a part of it lacks the attribute {error}"
        except ValueError as error:
            sets[-1].fault = str(error)
        else:
            sets[-1].first.append(first)
            sets[-1].last.append(last)


class SetsOfObjects:
    """Collects the sets of all objects; copies of an object are in the same sets."""

    def __init__(self) -> None:
        self._n_faces = 0
        self._found: dict[int, tuple[TriangleSet, int, list[int]]] = {}  # by identity: number and first of triangles

    def add(self, sets: list[TriangleSet], count: int) -> None:
        """Add an object with a number of triangles."""
        for each in sets:
            self._found.setdefault(id(each), (each, count, []))[2].append(self._n_faces)
        self._n_faces += count

    def carry(self, carried: Carried) -> None:
        """Add the divisions into sets."""
        for each, count, starts in self._found.values():
            with carried.optional(f"the triangle set {each.name!r}" if each.name else "a triangle set without a name"):
                chosen = (each.rows(count) + np.array(starts)[:, None]).ravel()
                if len(chosen) == 0:
                    also_named(carried, DIVISION, [each.name])
                else:
                    add_set(carried, DIVISION, each.name, chosen, self._n_faces)
