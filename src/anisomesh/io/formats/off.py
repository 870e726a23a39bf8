"""Text files in Object File Format (OFF)."""

from __future__ import annotations

import re

import numpy as np

from anisomesh.attributes.model import Mesh
from anisomesh.io.formats.words import coordinates, format_rows, integers
from anisomesh.io.holding import Losses
from anisomesh.io.polygons import PolygonSoup


def read_off(data: bytes) -> PolygonSoup:
    """Read a text file in Object File Format (OFF, COFF, NOFF, CNOFF or STOFF); extra columns are ignored.

    Notes
    -----
    The counts may follow the word OFF on its line, without a space too, as in the files of ModelNet.
    """
    rows = [(k, line.partition(b"#")[0].strip()) for k, line in enumerate(data.splitlines())]
    numbers = np.array([k for k, line in rows if line], dtype=np.int64)
    lines = [line for _, line in rows if line]
    head = re.match(rb"(ST)?C?N?OFF(?=[\s\d]|$)\s*(.*)", lines[0]) if lines else None
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
    points = coordinates(lines, np.arange(start, start + n_points), skip=0, numbers=numbers)
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
    return PolygonSoup(points=points, corners=integers(rows_of_corners, numbers[face_lines]), sizes=sizes)


def off_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return the content of an OFF file: points and triangles."""
    points, faces = mesh.surface.points, mesh.surface.faces
    for what, names in (
        ("point data", mesh.point_data),
        ("face data", mesh.face_data),
        ("corner data", mesh.corner_data),
        ("regions", mesh.regions),
        ("materials", mesh.materials),
    ):
        losses.add(what, *names)
    losses.features(mesh)
    head = f"OFF\n{len(points)} {len(faces)} 0\n"
    return (head + format_rows("%r %r %r\n", points) + format_rows("3 %d %d %d\n", faces)).encode()
