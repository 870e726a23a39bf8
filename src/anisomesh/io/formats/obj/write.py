"""Writing of Wavefront's OBJ files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise

import numpy as np

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.carried import COLOUR, NORMAL, UV, Array, Integers
from anisomesh.io.formats.obj.attributes import DIVISIONS, OF_LINES, SMOOTHING
from anisomesh.io.formats.region_names import in_words, region_texts
from anisomesh.io.formats.words import format_rows
from anisomesh.io.holding.divisions import main_division
from anisomesh.io.holding.losses import OF_FEATURES, OF_FIXED_POINTS, Losses
from anisomesh.io.holding.normals import has_direction

States = list[tuple[str, Integers, dict[int, str]]]
"""What changes between elements: the word, the label of each element (n,), and the text for each label."""


def obj_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return the content of an OBJ file.

    Notes
    -----
    Regions keep their names, not their numbers. Faces are in the order of their regions if they would change back and
    forth between them otherwise. Features that are in no region are in front of the faces, in front of the first
    group. Faces have normals, and texture coordinates, if all their corners do.
    """
    faces = mesh.surface.faces
    lines = [_points(mesh)]
    columns: list[Integers | None] = [faces.astype(np.int64) + 1]
    for name, word, widths in ((UV, "vt", (2, 3)), (NORMAL, "vn", (3,))):
        rows, numbers = _at_corners(mesh, name, widths)
        columns.append(numbers)
        partly = 0 if numbers is None else np.count_nonzero((numbers > 0).any(axis=1) & (numbers == 0).any(axis=1))
        if partly:
            losses.say(f"the {name} at {partly} face(s), some corners of which have none")
        if rows is not None:
            lines.append(format_rows(word + " %r" * rows.shape[1] + "\n", rows))
    states = _states(mesh, losses)
    of_lines = _states_of_lines(mesh, states, losses)
    is_labelled = np.any([np.zeros(len(mesh.features), dtype=bool), *(state[1] != 0 for state in of_lines)], axis=0)
    lines.append(format_rows("l %d %d\n", mesh.features[~is_labelled] + 1))
    lines.append(_in_states(partial(_lines_of_faces, columns), len(faces), states))
    labelled = [(word, labels[is_labelled], texts) for word, labels, texts in of_lines]
    ends = mesh.features[is_labelled] + 1
    lines.append(_in_states(lambda chosen: format_rows("l %d %d\n", ends[chosen]), len(ends), labelled))
    lines.append(format_rows("p %d\n", mesh.fixed_points + 1))
    held = [name for name, numbers in zip((UV, NORMAL), columns[1:], strict=True) if numbers is not None]
    losses.add("corner data", *(name for name in mesh.corner_data if name not in held))
    held += [] if _colours(mesh) is None else [COLOUR]
    losses.add("point data", *(name for name in mesh.point_data if name not in held))
    losses.add("materials", *(name for name in mesh.materials if name != "obj"))
    losses.fixed_faces(mesh)
    losses.add(OF_FIXED_POINTS, *mesh.fixed_point_regions)
    return "".join(lines).encode("utf-8", errors="replace")


def _points(mesh: Mesh) -> str:
    """Return the lines of points, with colours."""
    colours = _colours(mesh)
    if colours is None:
        return format_rows("v %r %r %r\n", mesh.surface.points)
    rows = np.concatenate([mesh.surface.points, colours], axis=1)
    return format_rows("v" + " %r" * rows.shape[1] + "\n", rows)


def _colours(mesh: Mesh) -> Array | None:
    """Return the colours of points as float64 (V, 3) or (V, 4); integers are shares of their largest."""
    colours = mesh.point_data.get(COLOUR)
    if colours is None or colours.ndim != 2 or colours.shape[1] not in (3, 4) or colours.dtype.kind not in "uf":
        return None
    largest = np.iinfo(colours.dtype).max if colours.dtype.kind == "u" else 1.0
    return colours.astype(np.float64) / largest


def _at_corners(mesh: Mesh, name: str, widths: tuple[int, ...]) -> tuple[Array | None, Integers | None]:
    """Return different rows of data at points or corners, and the number of the row of each corner (F, 3) from 1.

    The number is 0 where a corner has no direction, or numbers that are not finite; both are None if no corner has any.
    """
    faces = mesh.surface.faces.astype(np.int64)
    given = mesh.corner_data.get(name, mesh.point_data.get(name))
    if given is None or given.dtype.kind not in "fiu" or given.shape[-1:] not in [(width,) for width in widths]:
        return None, None
    at_points = name in mesh.point_data
    if given.ndim != (2 if at_points else 3):
        return None, None
    rows = given.reshape(-1, given.shape[-1]).astype(np.float64)
    has = has_direction(rows) if name == NORMAL else np.isfinite(rows).all(axis=1)
    numbers = np.zeros(len(rows), dtype=np.int64)
    if at_points:
        rows, numbers[has] = rows[has], np.arange(1, np.count_nonzero(has) + 1)
        numbers = numbers[faces]
    elif has.any():
        rows, place = np.unique(rows[has], axis=0, return_inverse=True)
        numbers[has] = place.reshape(-1) + 1
    return (rows, numbers.reshape(-1, 3)) if numbers.any() else (None, None)


def _states(mesh: Mesh, losses: Losses) -> States:
    """Return what changes between faces."""
    found = _in_slots(mesh.regions, tuple(DIVISIONS), "regions", losses)
    states = [
        (DIVISIONS[name].decode(), found[name].labels, region_texts(found[name], losses, in_words, distinct=True))
        for name in DIVISIONS
        if name in found
    ]
    smoothing = mesh.face_data.get(SMOOTHING)
    is_held = smoothing is not None and smoothing.ndim == 1 and smoothing.dtype.kind in "iu"
    losses.add("face data", *(name for name in mesh.face_data if name != SMOOTHING or not is_held))
    if smoothing is not None and is_held:
        labels = smoothing.astype(np.int64)
        states.append(("s", labels, {label: str(label) if label else "off" for label in np.unique(labels).tolist()}))
    return states


def _states_of_lines(mesh: Mesh, of_faces: States, losses: Losses) -> States:
    """Return what changes between features; a word without a text where they are in no region."""
    given = {name: division for name, division in mesh.feature_regions.items() if division.labels.any()}
    found = _in_slots(given, OF_LINES, OF_FEATURES, losses)
    words_of_faces = {word for word, _, _ in of_faces}
    states: States = []
    for name in OF_LINES:
        word = DIVISIONS[name].decode()
        if name in found:
            states.append((word, found[name].labels, {0: ""} | _texts_of_lines(found[name], losses)))
        elif found and word in words_of_faces:  # which would go on
            states.append((word, np.zeros(len(mesh.features), dtype=np.int64), {0: ""}))
    return states


def _texts_of_lines(division: Regions, losses: Losses) -> dict[int, str]:
    """Return the text of each region of features."""
    in_regions = Regions(division.labels[division.labels != 0], division.names)
    return region_texts(in_regions, losses, in_words, distinct=True)


def _in_slots(regions: Mapping[str, Regions], slots: tuple[str, ...], what: str, losses: Losses) -> dict[str, Regions]:
    """Return the divisions that OBJ knows, and others in the place of objects and groups; the rest is lost."""
    others = dict(regions)
    found = {name: others.pop(name) for name in slots if name in others}
    for slot in OF_LINES:
        other = main_division(others)
        if slot not in found and other is not None:
            found[slot] = others.pop(other[0])
    losses.add(what, *others)
    return found


def _lines_of_faces(columns: list[Integers | None], chosen: Integers) -> str:
    """Return the lines of some faces (n,), with the columns that have a number at all corners of a face."""
    rows = [None if column is None else column[chosen] for column in columns]
    full = np.stack([np.zeros(len(chosen), dtype=bool) if c is None else (c > 0).all(axis=1) for c in rows], axis=1)
    begin = [0, *(np.flatnonzero((full[1:] != full[:-1]).any(axis=1)) + 1).tolist(), len(chosen)]
    lines = []
    for first, end in pairwise(begin):
        _, has_texture, has_normal = full[first].tolist()
        corner = "%d" + ("/%d" if has_texture else "/" if has_normal else "") + ("/%d" if has_normal else "")
        held = [
            c[first:end] for c, is_full in zip(rows, full[first].tolist(), strict=True) if is_full and c is not None
        ]
        lines.append(format_rows(f"f {corner} {corner} {corner}\n", np.stack(held, axis=2).reshape(end - first, -1)))
    return "".join(lines)


def _in_states(lines_of: Callable[[Integers], str], count: int, states: States) -> str:
    """Return the lines of a number of elements, given as a function of some, with a line wherever a state changes."""
    if not states or count == 0:
        return lines_of(np.arange(count)) if count else ""
    labels = np.stack([state[1] for state in states], axis=1)
    order = np.arange(count)
    changes = (labels[1:] != labels[:-1]).any(axis=1)
    if np.count_nonzero(changes) >= len(np.unique(labels, axis=0)):
        order = np.lexsort(labels.T[::-1])
        changes = (labels[order][1:] != labels[order][:-1]).any(axis=1)
    begin = [0, *(np.flatnonzero(changes) + 1).tolist(), count]
    lines: list[str] = []
    before: list[int | None] = [None] * len(states)
    for first, end in pairwise(begin):
        now = labels[order[first]].tolist()
        for k, (word, _, texts) in enumerate(states):
            if now[k] != before[k] and not (before[k] is None and word == "s" and now[k] == 0):
                lines.append(f"{word} {texts[now[k]]}".rstrip() + "\n")
                before[k] = now[k]
        lines.append(lines_of(order[first:end]))
    return "".join(lines)
