"""Materials, colours and texture coordinates of the triangles of 3MF."""

from __future__ import annotations

from pathlib import PurePosixPath

import numpy as np

from anisomesh.io.carried import COLOUR, UV, Array, Carried, Integers
from anisomesh.io.formats.region_names import divide
from anisomesh.io.formats.threemf.resources import NONE, TEXTURE_ATTRIBUTES, Resources

OBJECT, MATERIAL, TEXTURE = "object", "material", "texture"
"""Names of the divisions into objects, base materials and textures."""

TEXTURES = "textures"
"""Key of the textures by their labels: tables with the content of the image as ``data``, and its attributes."""

_WHITE = (255, 255, 255, 255)


class Properties:
    """Collects the objects of triangles, their materials, and colours and texture coordinates of their corners."""

    def __init__(self) -> None:
        self._names: list[str] = []
        self._counts: list[int] = []
        self._materials: list[Integers] = []
        self._known: dict[tuple[str, str], int] = {}
        self._colours: list[Integers] = []
        self._coordinates: list[Array] = []
        self._textures: list[Integers] = []
        self._n_mixed = self._n_beyond = 0  # faces with several materials, or with missing members
        self._known_textures: dict[str, tuple[int, dict[str, str]]] = {}  # label and attributes by part

    def add(self, name: str, rows: Integers, default: tuple[int, int], model: Resources, *, inverted: bool) -> None:
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
        inverted
            Whether the corners are taken from last to first.
        """
        self._names.append(name)
        self._counts.append(len(rows))
        rows = rows.copy()
        without = rows[:, 0] == NONE
        rows[without, 0] = default[0]
        rows[without & (rows[:, 1] == NONE), 1] = default[1]
        rows[:, 2:] = np.where(rows[:, 2:] == NONE, rows[:, 1:2], rows[:, 2:])
        first = rows[:, 1].copy()
        if inverted:
            rows = rows[:, [0, 3, 2, 1]]
        labels, colours = np.zeros(len(rows), dtype=np.int64), np.full((len(rows), 3, 4), 255, dtype=np.int64)
        textures, coordinates = np.zeros(len(rows), dtype=np.int64), np.full((len(rows), 3, 2), np.nan)
        for group in np.unique(rows[:, 0]).tolist():
            chosen = np.flatnonzero(rows[:, 0] == group)
            if group in model.materials:
                found = [self._known.setdefault(key, len(self._known) + 1) for key in model.materials[group]]
                table = np.array([0, *found])
                labels[chosen] = _members(table, first[chosen])
                self._n_mixed += int(np.count_nonzero((rows[chosen, 1:] != first[chosen, None]).any(axis=1)))
            elif group in model.colours:
                table = np.array([_WHITE, *map(_rgba, model.colours[group])])
                colours[chosen] = _members(table, rows[chosen, 1:])
            elif group in model.texture_groups:
                given = model.texture_groups[group]
                textures[chosen] = self._texture_label(model.textures.get(given.texture, {}))
                table = np.concatenate([np.full((1, 2), np.nan), given.coordinates])
                coordinates[chosen] = _members(table, rows[chosen, 1:])
            else:
                continue
            self._n_beyond += int(np.count_nonzero((rows[chosen, 1:] >= len(table) - 1).any(axis=1)))
        self._materials.append(labels)
        self._colours.append(colours)
        self._textures.append(textures)
        self._coordinates.append(coordinates)

    def _texture_label(self, attributes: dict[str, str]) -> int:
        """Return the label of a texture: the one of the first texture with the same image."""
        path = attributes.get("path", "").lstrip("/")
        return self._known_textures.setdefault(path, (len(self._known_textures) + 1, attributes))[0]

    def carry(self, carried: Carried) -> dict[str, int]:
        """Add the divisions into objects, materials and textures, and colours and texture coordinates of corners.

        Returns the labels of textures by the parts of the archive with their images.
        """
        if len(self._names) > 1 or any(self._names):
            usual = np.arange(1, len(self._names) + 1)
            divide(carried, OBJECT, np.repeat(usual, self._counts), self._names, usual.tolist())
        materials = np.concatenate([np.zeros(0, dtype=np.int64), *self._materials])
        if materials.any():
            names, given = [name for name, _ in self._known], list(self._known.values())
            label_of = divide(carried, MATERIAL, materials, names, given)
            colours_of = {label_of[label]: colour for (_, colour), label in self._known.items()}
            carried.materials["display_colours"] = colours_of
        if self._n_beyond:
            what = "missing materials, colours or texture coordinates"
            carried.remarks.append(f"{self._n_beyond:,} face(s) refer to {what}")
        if self._n_mixed:
            carried.remarks.append(f"{self._n_mixed:,} face(s) have several materials and keep the first only")
        colours = np.concatenate([np.zeros((0, 3, 4), dtype=np.int64), *self._colours])
        if (colours != 255).any():
            carried.corner_data[COLOUR] = colours.reshape(-1, 4).astype(np.uint8)
        textures = np.concatenate([np.zeros(0, dtype=np.int64), *self._textures])
        if not textures.any():
            return {}
        carried.corner_data[UV] = np.concatenate(self._coordinates).reshape(-1, 2)
        texts = [PurePosixPath(path).name for path in self._known_textures]
        label_of = divide(carried, TEXTURE, textures, texts, range(1, len(texts) + 1))
        carried.materials[TEXTURES] = {
            label_of[label]: {key: given[key] for key in TEXTURE_ATTRIBUTES if key in given}
            for label, given in self._known_textures.values()
        }
        return {path: label_of[label] for path, (label, _) in self._known_textures.items()}


def _members(table: Array, members: Integers) -> Array:
    """Return the rows of a table, the first of which stands for members that there are not."""
    place = np.where((members >= 0) & (members < len(table) - 1), members + 1, 0)
    return np.asarray(table[place])


def _rgba(text: str) -> tuple[int, ...]:
    """Return the numbers of a colour such as #FF8000 or #FF8000FF; white for other text."""
    try:
        parts = tuple(bytes.fromhex(text.removeprefix("#")))
    except ValueError:
        return _WHITE
    return {3: (*parts, 255), 4: parts}.get(len(parts), _WHITE)
