"""MEDIT's text files of solutions (.sol): values at the vertices of a mesh, without the mesh.

Format: the keyword ``SolAtVertices`` of libMeshb, https://github.com/LoicMarechal/libMeshb, as Mmg reads and writes it.
"""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Array
from anisomesh.io.formats.words import format_rows

PLANE = 2  # dimension of files whose points have two coordinates
_SCALAR, _VECTOR, _TENSOR = 1, 2, 3  # types of fields
_LOWER = {2: [(0, 0), (0, 1), (1, 1)], 3: [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)]}  # rows of the lower half
_BINARY = (b"\x01\x00\x00\x00", b"\x00\x00\x00\x01")  # the number 1 in either byte order


def read_sol(data: bytes) -> list[Array]:
    """Return the fields at vertices, in order: scalars (V,), vectors (V, 2) or (V, 3), symmetric tensors (V, 3, 3).

    Raises
    ------
    ValueError
        If the file is binary, cut off or malformed, or has no field at vertices.

    Notes
    -----
    A row of a tensor is m11 m12 m22 m13 m23 m33. Tensors of the plane, m11 m12 m22, get the mean of m11 and m22 for
    m33, which no edge in the plane z = 0 feels.
    """
    if data.startswith(_BINARY):
        raise ValueError("it is binary; save it as text, a .sol file beside a .mesh file")
    tokens = _without_comments(data).split()
    if not tokens or not tokens[0].startswith(b"MeshVersionFormatted"):
        raise ValueError("it does not begin with MeshVersionFormatted as a MEDIT text file does")
    words = [k for k, token in enumerate(tokens) if token[:1].isalpha() and token.lower() not in (b"nan", b"inf")]
    sections = {tokens[k]: tokens[k + 1 : end] for k, end in zip(words, [*words[1:], len(tokens)], strict=True)}
    dimension = sol_dimension(data)
    if dimension not in _LOWER:
        raise ValueError(f"its dimension is {dimension}; expected 2 or 3")
    if b"SolAtVertices" not in sections:
        raise ValueError("it has no section SolAtVertices, the values at vertices")
    return _fields(sections[b"SolAtVertices"], dimension)


def sol_dimension(data: bytes) -> int:
    """Return the dimension that a file declares, 3 if it declares none."""
    found = re.search(rb"\bDimension\s+(\d+)", _without_comments(data))
    return 3 if found is None else int(found[1])


def _without_comments(data: bytes) -> bytes:
    return re.sub(rb"#[^\n]*", b"", data)


def _fields(body: list[bytes], dimension: int) -> list[Array]:
    """Return the fields of a section: a count, the number of fields, their types, and the rows."""
    lower = _LOWER[dimension]
    widths = {_SCALAR: 1, _VECTOR: dimension, _TENSOR: len(lower)}
    try:
        count, n_fields = map(int, body[:2])
        types = [int(word) for word in body[2 : 2 + n_fields]]
        rows = np.array(list(map(float, body[2 + n_fields :])), dtype=np.float64)
    except ValueError as error:
        raise ValueError(f"truncated or malformed: the section SolAtVertices: {error}") from None
    if len(types) < n_fields or not types or not set(types) <= set(widths):
        raise ValueError(f"its fields are of types {types}; expected 1 (scalar), 2 (vector) or 3 (symmetric tensor)")
    width = sum(widths[kind] for kind in types)
    if len(rows) != count * width or count < 1:
        raise ValueError(f"truncated: SolAtVertices declares {count} rows of {width} but {len(rows)} numbers follow")
    ends = np.cumsum([widths[kind] for kind in types])
    parts = np.split(rows.reshape(count, width), ends[:-1], axis=1)
    read = {_SCALAR: lambda part: part[:, 0], _VECTOR: lambda part: part, _TENSOR: _tensors}
    return [read[kind](part) for kind, part in zip(types, parts, strict=True)]


def _tensors(rows: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return tensors (V, 3, 3) of the lower halves (V, 3) or (V, 6)."""
    tensors = np.zeros((len(rows), 3, 3))
    dimension = 2 if rows.shape[1] == len(_LOWER[2]) else 3
    for column, (i, j) in enumerate(_LOWER[dimension]):
        tensors[:, i, j] = tensors[:, j, i] = rows[:, column]
    if dimension == 2:
        tensors[:, 2, 2] = 0.5 * (rows[:, 0] + rows[:, 2])
    return tensors


def sol_bytes(tensors: npt.NDArray[np.float64]) -> bytes:
    """Return the content of a file with one field of symmetric tensors (V, 3, 3), exact in float64."""
    rows = np.stack([tensors[:, i, j] for i, j in _LOWER[3]], axis=1)
    head = f"MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n{len(rows)}\n1 {_TENSOR}\n"
    return (head + format_rows("%r %r %r %r %r %r\n", rows) + "End\n").encode()
