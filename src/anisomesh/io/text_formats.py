"""Strict readers and exact writers of the text formats OBJ, OFF and MEDIT (.mesh).

Readers take the bytes of a file and raise ValueError with the line if it is malformed or truncated. Writers print
coordinates with enough digits to restore the same float64.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points
from anisomesh.io.polygons import PolygonSoup

_MEDIT_CORNERS = {b"Vertices": 0, b"Triangles": 3, b"Quadrilaterals": 4}  # indices per row of the sections to read


def read_obj(data: bytes) -> PolygonSoup:
    """Read the ``v`` and ``f`` lines of a Wavefront OBJ file.

    Notes
    -----
    Texture and normal indices are ignored, so that texture seams do not split points. Negative indices count back from
    the last point before the line; a backslash at the end of a line continues it.
    """
    lines = re.sub(rb"\\\r?\n", b" ", data).splitlines()
    kinds = np.array([line[:2].replace(b"\t", b" ") for line in map(bytes.lstrip, lines)], dtype="S2")
    point_lines, face_lines = np.flatnonzero(kinds == b"v "), np.flatnonzero(kinds == b"f ")
    truncated = np.flatnonzero((kinds == b"v") | (kinds == b"f"))
    if len(truncated):
        raise ValueError(f"line {truncated[0] + 1} is cut off: {lines[truncated[0]][:40]!r}")
    points = _coordinates(lines, point_lines, skip=1)
    tokens = [re.sub(rb"/\S*", b"", lines[k].partition(b"#")[0]).split()[1:] for k in face_lines]
    sizes = np.array([len(row) for row in tokens], dtype=np.int64)
    raw = _integers(tokens, face_lines)
    if (raw == 0).any():
        line = np.repeat(face_lines, sizes)[np.flatnonzero(raw == 0)[0]]
        raise ValueError(f"line {line + 1} refers to point 0; OBJ counts from 1")
    n_points_before = np.repeat(np.searchsorted(point_lines, face_lines), sizes)
    corners = np.where(raw > 0, raw - 1, raw + n_points_before)
    return PolygonSoup(points=points, corners=corners, sizes=sizes)


def read_off(data: bytes) -> PolygonSoup:
    """Read a text file in Object File Format (OFF, COFF, NOFF, CNOFF or STOFF); extra columns are ignored."""
    rows = [(k, line.partition(b"#")[0].strip()) for k, line in enumerate(data.splitlines())]
    numbers = np.array([k for k, line in rows if line], dtype=np.int64)
    lines = [line for _, line in rows if line]
    head = re.match(rb"(ST)?C?N?OFF(?=\s|$)\s*(.*)", lines[0]) if lines else None
    if head is None or b"BINARY" in lines[0].upper():
        raise ValueError("it does not begin with the word OFF as a text OFF file does")
    start = 1 if head.group(2) else 2
    counts = (head.group(2) or (lines[1] if len(lines) > 1 else b"")).split()
    if len(counts) < 2 or not all(count.isdigit() for count in counts[:2]):
        raise ValueError(f"the line of counts reads {b' '.join(counts)[:40]!r}; expected points, faces and edges")
    n_points, n_faces = int(counts[0]), int(counts[1])
    if len(lines) < start + n_points + n_faces:
        raise ValueError(
            f"truncated: it declares {n_points} points and {n_faces} faces but {len(lines) - start} lines follow"
        )
    points = _coordinates(lines, np.arange(start, start + n_points), skip=0, numbers=numbers)
    face_lines = np.arange(start + n_points, start + n_points + n_faces)
    tokens = [lines[k].split() for k in face_lines]
    sizes = _integers([row[:1] for row in tokens], numbers[face_lines])
    short = np.flatnonzero(np.array([len(row) for row in tokens], dtype=np.int64) < sizes + 1)
    if len(short):
        raise ValueError(f"line {numbers[face_lines[short[0]]] + 1} has fewer corners than the number it begins with")
    rows_of_corners = [row[1 : size + 1] for row, size in zip(tokens, sizes.tolist(), strict=True)]
    return PolygonSoup(points=points, corners=_integers(rows_of_corners, numbers[face_lines]), sizes=sizes)


def read_medit(data: bytes) -> PolygonSoup:
    """Read the vertices, triangles and quadrilaterals of a MEDIT .mesh text file; other sections are ignored."""
    tokens = re.sub(rb"#[^\n]*", b"", data).split()
    if not tokens or not tokens[0].startswith(b"MeshVersionFormatted"):
        raise ValueError("it does not begin with MeshVersionFormatted as a MEDIT text file does")
    words = [k for k, token in enumerate(tokens) if token[:1].isalpha() and token.lower() not in (b"nan", b"inf")]
    dimension, sections = 3, {}
    for k, end in zip(words, [*words[1:], len(tokens)], strict=True):
        if tokens[k] == b"Dimension" and k + 1 < end:
            dimension = int(tokens[k + 1])
        if tokens[k] in _MEDIT_CORNERS:
            sections[tokens[k]] = tokens[k + 1 : end]
    if dimension not in (2, 3):
        raise ValueError(f"its dimension is {dimension}; expected 2 or 3")
    points = np.zeros((0, 3))
    corners, sizes = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for name, body in sections.items():
        width = _MEDIT_CORNERS[name] or dimension
        rows = _medit_rows(name.decode(), body, width)
        if name == b"Vertices":
            points = np.pad(rows, ((0, 0), (0, 3 - width)))
        else:
            with np.errstate(invalid="ignore"):  # NaN becomes an index that polygons.validate reports
                corners.append(rows.astype(np.int64).ravel() - 1)
            sizes.append(np.full(len(rows), width, dtype=np.int64))
    others = sorted({tokens[k].decode(errors="replace") for k in words} & {"Tetrahedra", "Hexahedra", "Prisms"})
    if len(sizes) == 1 and others:
        raise ValueError(f"it has only volume cells ({', '.join(others)}) and no surface; extract the boundary first")
    return PolygonSoup(points=points, corners=np.concatenate(corners), sizes=np.concatenate(sizes))


def obj_text(points: Points, faces: Faces) -> str:
    """Return the content of an OBJ file."""
    return _lines("v %r %r %r\n", points) + _lines("f %d %d %d\n", faces + 1)


def off_text(points: Points, faces: Faces) -> str:
    """Return the content of an OFF file."""
    return f"OFF\n{len(points)} {len(faces)} 0\n" + _lines("%r %r %r\n", points) + _lines("3 %d %d %d\n", faces)


def medit_text(points: Points, faces: Faces) -> str:
    """Return the content of a MEDIT .mesh text file, version 2 (float64)."""
    vertices = f"Vertices\n{len(points)}\n" + _lines("%r %r %r 0\n", points)
    triangles = f"Triangles\n{len(faces)}\n" + _lines("%d %d %d 0\n", faces + 1)
    return f"MeshVersionFormatted 2\nDimension 3\n{vertices}{triangles}End\n"


def _lines(pattern: str, table: npt.NDArray[np.float64] | npt.NDArray[np.int32]) -> str:
    return (pattern * len(table)) % tuple(table.ravel().tolist())


def _coordinates(
    lines: list[bytes], chosen: npt.NDArray[np.int64], *, skip: int, numbers: npt.NDArray[np.int64] | None = None
) -> npt.NDArray[np.float64]:
    """Parse three coordinates (n, 3) after ``skip`` words of the chosen lines; ``numbers`` are the line numbers."""
    rows = [lines[k].partition(b"#")[0].split()[skip : skip + 3] for k in chosen]
    try:
        return np.array([list(map(float, row)) for row in rows], dtype=np.float64).reshape(len(rows), 3)
    except ValueError:
        bad = next(k for k, row in zip(chosen, rows, strict=True) if len(row) < 3 or not _all_numbers(row))
        number = bad if numbers is None else numbers[bad]
        raise ValueError(f"line {number + 1} should give three coordinates: {lines[bad][:60]!r}") from None


def _integers(rows: list[list[bytes]], numbers: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Parse all words of rows with these line numbers as integers, concatenated."""
    try:
        return np.array([int(token) for row in rows for token in row], dtype=np.int64)
    except (ValueError, OverflowError):
        bad = next(k for k, row in enumerate(rows) if not all(re.fullmatch(rb"[+-]?\d{1,18}", word) for word in row))
        raise ValueError(f"line {numbers[bad] + 1} should give integers: {b' '.join(rows[bad])[:60]!r}") from None


def _all_numbers(words: Iterable[bytes]) -> bool:
    try:
        return len([float(word) for word in words]) > 0
    except ValueError:
        return False


def _medit_rows(name: str, body: list[bytes], width: int) -> npt.NDArray[np.float64]:
    """Return the rows (n, width) of a MEDIT section, without the reference number at the end of each row."""
    if not body or not body[0].isdigit():
        raise ValueError(f"truncated: the section {name} has no count")
    count = int(body[0])
    if len(body) - 1 < count * (width + 1):
        raise ValueError(f"truncated: {name} declares {count} rows of {width + 1} but {len(body) - 1} numbers follow")
    try:
        rows = np.array(list(map(float, body[1 : 1 + count * (width + 1)])), dtype=np.float64)
    except ValueError as error:
        raise ValueError(f"malformed: the section {name} should give numbers: {error}") from None
    return rows.reshape(count, width + 1)[:, :width]
