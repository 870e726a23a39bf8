"""Materials and colours of the triangles of 3MF."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from anisomesh.io.carried import COLOUR, Carried, Integers
from anisomesh.io.formats.region_names import divide

OBJECT, MATERIAL = "object", "material"
"""Names of the divisions into objects and into base materials."""

NONE = -1
"""No group or member of properties."""

_WHITE = (255, 255, 255, 255)


class _Groups(Protocol):
    groups: dict[int, list[tuple[str, str]]]
    colours: dict[int, list[str]]


def number(text: str) -> int:
    """Return the number of a group or a member, :data:`NONE` for other text."""
    return int(text) if text.isdecimal() and len(text) < 18 else NONE


class Properties:
    """Collects the objects of triangles, their materials and the colours of their corners."""

    def __init__(self) -> None:
        self._names: list[str] = []
        self._counts: list[int] = []
        self._materials: list[Integers] = []
        self._known: dict[tuple[str, str], int] = {}
        self._colours: list[Integers] = []

    def add(self, name: str, rows: Integers, default: tuple[int, int], model: _Groups, *, turned: bool) -> None:
        """Add an object.

        Parameters
        ----------
        name
            Its name, empty for none.
        rows
            The group and three members of each triangle (n, 4).
        default
            Group and member of triangles without.
        model
            Where groups are looked up.
        turned
            Whether the corners are taken from last to first.
        """
        self._names.append(name)
        self._counts.append(len(rows))
        rows = rows.copy()
        without = rows[:, 0] == NONE
        rows[without, 0] = default[0]
        rows[without & (rows[:, 1] == NONE), 1] = default[1]
        rows[:, 2:] = np.where(rows[:, 2:] == NONE, rows[:, 1:2], rows[:, 2:])
        if turned:
            rows = rows[:, [0, 3, 2, 1]]
        labels, colours = np.zeros(len(rows), dtype=np.int64), np.full((len(rows), 3, 4), 255, dtype=np.int64)
        for group in np.unique(rows[:, 0]).tolist():
            chosen = np.flatnonzero(rows[:, 0] == group)
            if group in model.groups:
                found = [self._known.setdefault(key, len(self._known) + 1) for key in model.groups[group]]
                labels[chosen] = _members(np.array([0, *found]), rows[chosen, 1])
            elif group in model.colours:
                table = np.array([_WHITE, *map(_rgba, model.colours[group])])
                colours[chosen] = _members(table, rows[chosen, 1:])
        self._materials.append(labels)
        self._colours.append(colours)

    def carry(self, carried: Carried) -> None:
        """Add the divisions into objects and materials, and the colours of corners."""
        if len(self._names) > 1 or any(self._names):
            usual = np.arange(1, len(self._names) + 1)
            divide(carried, OBJECT, np.repeat(usual, self._counts), self._names, usual.tolist())
        materials = np.concatenate([np.zeros(0, dtype=np.int64), *self._materials])
        if materials.any():
            names, given = [name for name, _ in self._known], list(self._known.values())
            label_of = divide(carried, MATERIAL, materials, names, given)
            colours_of = {label_of[label]: colour for (_, colour), label in self._known.items()}
            carried.materials["display_colours"] = colours_of
        colours = np.concatenate([np.zeros((0, 3, 4), dtype=np.int64), *self._colours])
        if (colours != 255).any():
            carried.corner_data[COLOUR] = colours.reshape(-1, 4).astype(np.uint8)


def _members(table: Integers, members: Integers) -> Integers:
    """Return the rows of a table, the first of which stands for members that there are not."""
    place = np.where((members >= 0) & (members < len(table) - 1), members + 1, 0)
    found: Integers = table[place]
    return found


def _rgba(text: str) -> tuple[int, ...]:
    """Return the numbers of a colour such as #FF8000 or #FF8000FF; white for other text."""
    try:
        parts = tuple(bytes.fromhex(text.removeprefix("#")))
    except ValueError:
        return _WHITE
    return {3: (*parts, 255), 4: parts}.get(len(parts), _WHITE)
