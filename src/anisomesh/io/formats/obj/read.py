"""Reading of Wavefront's OBJ files."""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Carried, Integers
from anisomesh.io.formats.obj.attributes import (
    corner_numbers,
    take_colours,
    take_corner_data,
    take_divisions,
    take_lines,
)
from anisomesh.io.formats.obj.lines import Lines
from anisomesh.io.formats.words import coordinates, integers, shown
from anisomesh.io.polygons import PolygonSoup

_CURVED = (b"surf", b"bzp", b"bsp", b"cdp", b"res")  # free-form surfaces; the last four are superseded
_WITHOUT_COLOUR = (3, 4)  # numbers of points, without or with a weight
_ENDS_OF_LINES = (b"\n", b"\r")


def read_obj(data: bytes) -> PolygonSoup:
    """Read an OBJ file: points, polygons, groups, objects, materials, texture coordinates, normals, colours.

    Notes
    -----
    Texture coordinates and normals are corner data, so that texture seams do not split points. Negative indices count
    back from the last point before the line; a backslash at the end of a line continues it. Lines (``l``) are features
    and points (``p``) fixed points. Free-form surfaces are left out, with a remark.
    """
    lines = re.sub(rb"\\(?:\r\n|\r|\n)", b" ", data).splitlines()
    kinds = _kinds(lines)
    two_letters = kinds.astype("S2")
    point_lines = np.flatnonzero(two_letters == b"v ")
    is_face = two_letters == b"f "
    for k in np.flatnonzero(two_letters == b"fo"):
        is_face[k] = lines[k].split(None, 1)[0] == b"fo"  # in files of version 2
    face_lines = np.flatnonzero(is_face)
    truncated = np.flatnonzero((kinds == b"v") | (kinds == b"f"))
    if len(truncated):
        raise ValueError(f"line {truncated[0] + 1} is cut off: {shown(lines[truncated[0]])}")
    points, n_numbers = coordinates(lines, point_lines, word=b"v")
    words, sizes = _corners(lines, face_lines)
    if len(sizes) and sizes[-1] < 3 and face_lines[-1] == len(lines) - 1 and not data.endswith(_ENDS_OF_LINES):
        raise ValueError(f"truncated: the last line is a face of {sizes[-1]} corners: {shown(lines[-1])}")
    corners = _point_indices(words, face_lines, sizes, point_lines)
    place = np.flatnonzero(np.isin(kinds, [word[:3] for word in _CURVED]))
    curved = [lines[k].split(None, 1)[0].decode() for k in place if lines[k].startswith(_CURVED)]
    remarks = (f"left out {len(curved)} free-form surface(s) ({curved[0]})",) if curved else ()
    carried, file = Carried(), Lines(lines, kinds, point_lines, face_lines)
    if n_numbers not in _WITHOUT_COLOUR:
        take_colours(file, carried)
    take_corner_data(file, words, sizes, carried)
    take_divisions(file, carried)
    take_lines(file, carried)
    return PolygonSoup(points=points, corners=corners, sizes=sizes, remarks=remarks, carried=carried)


def _kinds(lines: list[bytes]) -> npt.NDArray[np.bytes_]:
    """Return the first three letters (n,) of lines without white space in front of them, and with spaces for tabs."""
    kinds = np.array([line[:3] for line in lines], dtype="S3")
    letters = kinds.view(np.uint8).reshape(-1, 3)
    for k in np.flatnonzero(((letters[:, 0] <= ord(" ")) & (letters[:, 0] > 0)) | (letters == ord("\t")).any(axis=1)):
        kinds[k] = lines[k].lstrip()[:3].replace(b"\t", b" ")
    return kinds


def _corners(lines: list[bytes], face_lines: Integers) -> tuple[list[list[bytes]] | Integers, Integers]:
    """Return the numbers of point, texture and normal of all corners (n, 3), or the words of faces, and their sizes."""
    found = corner_numbers(lines, face_lines)
    if found is not None:
        return found
    words = [lines[k].partition(b"#")[0].split()[1:] for k in face_lines]
    return words, np.array([len(row) for row in words], dtype=np.int64)


def _point_indices(
    words: list[list[bytes]] | Integers, face_lines: Integers, sizes: Integers, point_lines: npt.NDArray[np.intp]
) -> Integers:
    """Return the indices of points of all corners, from 0; the first column if numbers (n, 3) are given."""
    if isinstance(words, list):
        raw = integers([[word.partition(b"/")[0] for word in row] for row in words], face_lines)
    else:
        raw = words[:, 0]
    if (raw == 0).any():
        line = np.repeat(face_lines, sizes)[np.flatnonzero(raw == 0)[0]]
        raise ValueError(f"line {line + 1} refers to point 0; OBJ counts from 1")
    n_points_before = np.repeat(np.searchsorted(point_lines, face_lines), sizes)
    return np.where(raw > 0, raw - 1, raw + n_points_before)
