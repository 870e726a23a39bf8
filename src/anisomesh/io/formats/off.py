"""Text files in Object File Format (OFF)."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from anisomesh.attributes.model import Mesh
from anisomesh.io.carried import COLOUR, NORMAL, UV, Array, Carried
from anisomesh.io.formats.words import coordinates, integers, parsed_reals, shown, span, without_end_marks
from anisomesh.io.holding.corners import continuous_corner_data
from anisomesh.io.holding.losses import Losses
from anisomesh.io.holding.normals import has_direction, with_all_normals
from anisomesh.io.polygons import PolygonSoup

_BYTE = 255


def read_off(data: bytes) -> PolygonSoup:
    """Read a text file in Object File Format (OFF, COFF, NOFF, CNOFF or STOFF); with its colours.

    Notes
    -----
    The counts may follow the word OFF on its line, without a space too, as in the files of ModelNet.
    """
    rows = [(k, line.partition(b"#")[0].strip()) for k, line in enumerate(without_end_marks(data).splitlines())]
    numbers = np.array([k for k, line in rows if line], dtype=np.int64)
    lines = [line for _, line in rows if line]
    head = re.match(rb"(ST)?C?N?OFF(?=[\s\d]|$)\s*(.*)", lines[0]) if lines else None
    if head is None or b"BINARY" in lines[0].upper():
        raise ValueError("it does not begin with the word OFF as a text OFF file does")
    start = 1 if head.group(2) else 2
    counts = (head.group(2) or (lines[1] if len(lines) > 1 else b"")).split()
    if len(counts) < 2 or not all(count.isdigit() for count in counts[:2]):
        raise ValueError(f"the line of counts reads {shown(b' '.join(counts))}; expected points, faces and edges")
    n_points, n_faces = int(counts[0]), int(counts[1])
    if len(lines) < start + n_points + n_faces:
        raise ValueError(
            f"truncated: it declares {n_points} points and {n_faces} faces but {len(lines) - start} lines follow"
        )
    points, _ = coordinates(lines, np.arange(start, start + n_points), numbers=numbers)
    face_lines = np.arange(start + n_points, start + n_points + n_faces)
    tokens = [lines[k].split() for k in face_lines]
    sizes = integers([row[:1] for row in tokens], numbers[face_lines])
    short = np.flatnonzero(np.array([len(row) for row in tokens], dtype=np.int64) < sizes + 1)
    if len(short):
        raise ValueError(f"line {numbers[face_lines[short[0]]] + 1} has fewer corners than the number it begins with")
    negative = np.flatnonzero(sizes < 0)
    if len(negative):
        raise ValueError(f"line {numbers[face_lines[negative[0]]] + 1} begins with {sizes[negative[0]]} corners")
    rows_of_corners = [row[1 : size + 1] for row, size in zip(tokens, sizes.tolist(), strict=True)]
    corners = integers(rows_of_corners, numbers[face_lines])
    colours = [row[size + 1 :] for row, size in zip(tokens, sizes.tolist(), strict=True)]
    carried = _carried(head[0], lines[start : start + n_points], colours)
    if n_behind := len(lines) - start - n_points - n_faces:
        carried.remarks.append(f"left out {n_behind} line(s) behind the {n_faces} faces that it declares")
    return PolygonSoup(points=points, corners=corners, sizes=sizes, carried=carried)


def _carried(head: bytes, vertices: list[bytes], colours: list[list[bytes]]) -> Carried:
    """Return the columns behind the coordinates of points, in the order normal, colour, texture, and face colours."""
    carried = Carried()
    flags = re.match(rb"(ST)?(C)?(N)?OFF", head)
    texture, colour, normal = flags.groups() if flags else (None, None, None)
    if texture or colour or normal:
        with carried.optional("the columns behind the coordinates of points"):
            rows = [line.partition(b"#")[0].split()[3:] for line in vertices]
            width = {len(row) for row in rows}
            n_colours = max(width) - 3 * bool(normal) - 2 * bool(texture)
            if len(width) > 1 or (n_colours not in (3, 4) if colour else n_colours != 0):
                raise ValueError(f"lines of points have {span({k + 3 for k in width})} numbers")
            at = 0
            for name, count in ((NORMAL, 3 * bool(normal)), (COLOUR, n_colours), (UV, 2 * bool(texture))):
                part = [row[at : at + count] for row in rows]
                at += count
                if count:
                    carried.point_data[name] = _colours(part) if name == COLOUR else _table(part)
    elif (n_more := len(b"\n".join(vertices).split()) - 3 * len(vertices)) > 0:
        carried.remarks.append(f"left out {n_more} number(s) behind coordinates, which its first word does not declare")
    widths = {len(row) for row in colours}
    if any(widths):
        with carried.optional("the colours of faces"):
            if widths == {1}:
                raise ValueError("they are numbers of a table of colours that the file does not have")
            if widths not in ({3}, {4}):
                raise ValueError(f"lines of faces have {span(widths)} numbers behind their corners; expected 3 or 4")
            carried.cell_data[COLOUR] = _colours(colours)
    return carried


def _table(rows: list[list[bytes]]) -> Array:
    """Return rows of equally many numbers (n, k)."""
    return parsed_reals([word for row in rows for word in row]).reshape(len(rows), -1)


def _colours(rows: list[list[bytes]]) -> Array:
    """Return colours: bytes if they are integers up to 255, otherwise shares of 1."""
    values = _table(rows)
    is_whole = all(word.isdigit() for row in rows for word in row)
    return values.astype(np.uint8) if is_whole and values.max() <= _BYTE else values


def off_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return the content of an OFF file: points, with normals, colours and texture coordinates, and coloured faces."""
    points, faces = mesh.surface.points, mesh.surface.faces
    parts, pattern, head = [points], "%r %r %r", ""
    point_data = {**mesh.point_data, **continuous_corner_data(mesh, losses)}
    point_data = {**with_all_normals(replace(mesh, point_data=point_data, corner_data={}), losses).point_data}
    for name, letters, widths in ((NORMAL, "N", (3,)), (COLOUR, "C", (3, 4)), (UV, "ST", (2,))):
        columns = _columns(point_data.get(name), widths)
        if name == NORMAL and columns is not None and not has_direction(columns[0]).all():
            losses.because("point data", name, "which have no length")
            del point_data[name]
        elif columns is not None:
            if name == UV:
                columns = (_without_gaps(columns[0], losses), columns[1])
            parts.append(columns[0])
            pattern, head = pattern + columns[1], letters + head
            del point_data[name]
    vertices = _lines(pattern + "\n", parts)
    of_faces = _columns(mesh.face_data.get(COLOUR), (3, 4))
    pattern = "3 %d %d %d" + ("" if of_faces is None else of_faces[1]) + "\n"
    triangles = _lines(pattern, [faces] if of_faces is None else [faces, of_faces[0]])
    losses.add("point data", *point_data)
    losses.add("face data", *(name for name in mesh.face_data if name != COLOUR or of_faces is None))
    losses.add("regions", *mesh.regions)
    losses.add("materials", *mesh.materials)
    losses.features(mesh)
    return f"{head}OFF\n{len(points)} {len(faces)} 0\n{vertices}{triangles}".encode()


def _without_gaps(uv: Array, losses: Losses) -> Array:
    """Return texture coordinates (V, 2) with 0 where they are missing."""
    lacking = np.asarray(np.isnan(uv).any(axis=1))
    if lacking.any():
        losses.say(f"that {np.count_nonzero(lacking):,} points have no {UV}: they get 0")
    return np.where(lacking[:, None], 0.0, uv)


def _columns(values: Array | None, widths: tuple[int, ...]) -> tuple[Array, str] | None:
    """Return numbers (n, k) of a permitted width and their pattern, None for others."""
    if values is None or values.ndim != 2 or values.shape[1] not in widths or values.dtype.kind not in "uf":
        return None
    if values.dtype.kind == "u":
        return (values, " %d" * values.shape[1]) if values.dtype == np.uint8 else None
    return values, " %r" * values.shape[1]


def _lines(pattern: str, parts: list[Array]) -> str:
    columns = [column for part in parts for column in part.T.tolist()]
    return "".join(map(pattern.__mod__, zip(*columns, strict=True)))
