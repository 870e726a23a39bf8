"""What an OBJ file says of points, corners and faces besides their coordinates."""

from __future__ import annotations

import numpy as np

from anisomesh.io.carried import COLOUR, NORMAL, UV, Array, Carried, Integers
from anisomesh.io.formats.obj.lines import Lines
from anisomesh.io.formats.region_names import also_named, divide, numbered_regions
from anisomesh.io.formats.words import LINES_AT_ONCE, parsed_integers, quick_numbers, shown, span, word_starts

SMOOTHING = "smoothing_group"
"""Name of the smoothing groups (``s``) as face data."""

DIVISIONS = {"object": b"o", "group": b"g", "material": b"usemtl"}
"""The words that begin the regions of divisions."""

OF_LINES = ("object", "group")
"""The divisions that lines have too."""

_WITH_WEIGHT, _WITH_OPACITY = 4, 7  # numbers of a point with a weight, and with a colour and its opacity
_DEFAULT = "default"  # the name of what has none, by specification

LIBRARIES = "mtllib"
"""Key of the names of the material files."""


def take_colours(file: Lines, carried: Carried) -> None:
    """Add the colours of points, which follow their coordinates, as (V, 3) or with opacity (V, 4)."""
    if len(file.point_lines) == 0:
        return
    with carried.optional("the colours of points"):
        rows = file.numbers(file.point_lines)
        widths = {len(file.lines[k].partition(b"#")[0].split()) - 1 for k in file.point_lines.tolist()}
        if rows.shape[1] >= 6:
            carried.point_data[COLOUR] = rows[:, 3:7]
        elif max(widths) > _WITH_WEIGHT:  # which only curved surfaces have
            raise ValueError(f"not every point has one: lines of points have {span(widths)} numbers")
        if min(widths) >= 6 and max(widths) > _WITH_OPACITY:
            carried.remarks.append("left out the numbers behind the colours of points")


def corner_numbers(lines: list[bytes], face_lines: Integers) -> tuple[Integers, Integers] | None:
    """Return the numbers of point, texture and normal of corners (n, 3), 0 for none, and how many corners faces have.

    None if they are not all written alike, as 1, 1/2, 1//3 or 1/2/3, or if anything else is there.
    """
    tables, sizes = [np.zeros((0, 3), dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for first in range(0, len(face_lines), LINES_AT_ONCE):
        rows = face_lines[first : first + LINES_AT_ONCE].tolist()
        text = b"\n".join([lines[k] for k in rows])
        if text.count(b"f") != len(rows):
            return None
        text = text.replace(b"f", b" ")
        starts, codes = word_starts(text), np.frombuffer(text + b" ", dtype=np.uint8)
        columns = _columns_of(text, codes, starts)
        numbers = None if columns is None else quick_numbers(text.replace(b"/", b" "), np.int64)
        if columns is None or numbers is None or len(numbers) != len(columns) * len(starts):
            return None
        tables.append(np.zeros((len(starts), 3), dtype=np.int64))
        tables[-1][:, columns] = numbers.reshape(-1, len(columns))
        ends = np.append(np.flatnonzero(codes == ord("\n")), len(codes))
        sizes.append(np.diff(np.searchsorted(starts, ends), prepend=0))
    return np.concatenate(tables), np.concatenate(sizes)


def _columns_of(text: bytes, codes: Array, starts: Integers) -> list[int] | None:
    """Return which of point, texture and normal all words of a text give; None if they differ."""
    slashes = np.flatnonzero(codes == ord("/"))
    n_words = len(starts)
    per_word = len(slashes) // max(n_words, 1)
    at_end = (codes[slashes - 1] <= ord(" ")) | (codes[slashes + 1] <= ord(" "))
    if per_word > 2 or at_end.any() or len(slashes) != per_word * n_words:
        return None
    if (np.searchsorted(slashes, starts) != per_word * np.arange(n_words)).any():
        return None
    n_empty = text.count(b"//")
    if n_empty == 0:
        return [0, 1, 2][: per_word + 1]
    return [0, 2] if n_empty == n_words and per_word == 2 else None


def take_corner_data(file: Lines, words: list[list[bytes]] | Integers, sizes: Integers, carried: Carried) -> None:
    """Add texture coordinates and normals, given by the corners of faces such as 1/2/3 or their numbers (n, 3)."""
    indices: Integers = np.zeros((0, 3), dtype=np.int64)
    if not isinstance(words, list):
        indices = words
    elif any(b"/" in word for row in words for word in row):
        with carried.optional("texture coordinates and normals"):
            parts = [[*word.split(b"/"), b"", b""][:3] for row in words for word in row]
            indices = parsed_integers([part or b"0" for row in parts for part in row]).reshape(-1, 3)
    for column, word, name, widths in ((1, b"vt", UV, (2, 3)), (2, b"vn", NORMAL, (3, 3))):
        chosen = indices[:, column]
        if not chosen.any():
            continue
        with carried.optional({UV: "texture coordinates", NORMAL: "normals"}[name]):
            given = file.of(word)
            if len(given) == 0:
                raise ValueError(f"faces refer to {word.decode()} lines, and it has none")
            table = file.numbers(given)[:, : widths[1]]
            table = np.pad(table, ((0, 0), (0, max(widths[0] - table.shape[1], 0))))
            if name == UV and table.shape[1] == 3 and not table[:, 2].any():
                table = table[:, :2]
            before = np.repeat(np.searchsorted(given, file.face_lines), sizes)
            place = np.where(chosen > 0, chosen - 1, chosen + before)
            missing = chosen == 0
            wrong = np.flatnonzero(~missing & ((place < 0) | (place >= len(table))))
            if len(wrong):
                raise ValueError(f"a face refers to {word.decode()} {chosen[wrong[0]]} of {len(table)}")
            rows = table[np.where(missing, 0, place)]
            rows[missing] = np.nan
            if missing.any():
                carried.remarks.append(f"{np.count_nonzero(missing)} corner(s) of faces have no {name} and get NaN")
            carried.corner_data[name] = rows


def take_divisions(file: Lines, carried: Carried) -> None:
    """Add the objects, groups and materials of faces, numbered from 1 in the order of the file, and smoothing groups.

    Faces before the first one have the label 0.
    """
    for name, word in DIVISIONS.items():
        with carried.optional(f"its {name}s"):
            given = file.of(word)
            texts = [file.rest(k) or _DEFAULT for k in given]
            also_named(carried, name, (text for text in texts if text != _DEFAULT))
            number = {text: k + 1 for k, text in enumerate(dict.fromkeys(texts))}
            labels = np.array([0, *(number[text] for text in texts)], dtype=np.int64)
            of_faces = labels[np.searchsorted(given, file.face_lines)]
            if of_faces.any():
                before = [0] if (of_faces == 0).any() else []  # the label in front of the first one
                present = set(of_faces.tolist())
                used = {text: label for text, label in number.items() if label in present}
                divide(carried, name, of_faces, [*[""] * len(before), *used], [*before, *used.values()])
    with carried.optional("its smoothing groups"):
        given = file.of(b"s")
        texts = [file.rest(k) for k in given]
        labels = parsed_integers([b"0", *(b"0" if text in ("off", "") else text.encode() for text in texts)])
        of_faces = labels[np.searchsorted(given, file.face_lines)]
        if of_faces.any():
            carried.cell_data[SMOOTHING] = of_faces
    libraries = [file.rest(k) for k in file.of(LIBRARIES.encode())]
    if libraries:
        carried.materials["obj"] = {LIBRARIES: tuple(dict.fromkeys(libraries))}


def take_lines(file: Lines, carried: Carried) -> None:
    """Add lines as features, with the objects and groups that they are in, and points as fixed points."""
    given = file.of(b"l")
    for number, k in enumerate(given.tolist()):
        with carried.optional(f"line {k + 1}"):
            points = _points_of_line(file, k, 2)
            block = np.stack([points[:-1], points[1:]], axis=1)
            carried.lines.add(block, np.full(len(block), number))
    for k in file.of(b"p").tolist():
        with carried.optional(f"line {k + 1}"):
            carried.fixed_points.add(_points_of_line(file, k, 1))
    for name in OF_LINES if len(given) else ():
        with carried.optional(f"the {name}s of lines"):
            begin = file.of(DIVISIONS[name])
            texts = np.array(["", *(file.rest(k) for k in begin)], dtype=object)[np.searchsorted(begin, given)]
            used = [text for text in dict.fromkeys(texts.tolist()) if text]
            labels, names = numbered_regions(used, range(1, len(used) + 1))
            label_of = {"": 0, **dict(zip(used, labels, strict=True))}
            carried.lines.divide(name, np.array([label_of[text] for text in texts.tolist()]), names)


def _points_of_line(file: Lines, number: int, fewest: int) -> Integers:
    """Return the points of a line that lists them, from 0; ValueError if they are fewer or are not in the file."""
    line = file.lines[number]
    before = int(np.searchsorted(file.point_lines, number))
    raw = parsed_integers([text.partition(b"/")[0] for text in line.partition(b"#")[0].split()[1:]]).tolist()
    points = np.array([n - 1 if n > 0 else n + before for n in raw], dtype=np.int64)
    if len(points) < fewest or 0 in raw or (points < 0).any() or (points >= len(file.point_lines)).any():
        raise ValueError(f"it reads {shown(line)}")
    return points
