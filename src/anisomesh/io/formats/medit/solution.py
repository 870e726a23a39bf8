"""MEDIT's files of solutions (.sol, .solb): values at the vertices of a mesh, without the mesh.

Format: the keyword ``SolAtVertices`` of libMeshb, https://github.com/LoicMarechal/libMeshb, as Mmg reads and writes it.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Array
from anisomesh.io.formats.medit.content import Rows, binary_content, of_reals, text_content
from anisomesh.io.formats.medit.sections import PLANE, SPACE, Section, read_sections

_SECTION = "SolAtVertices"
_SCALAR, _VECTOR, _TENSOR = 1, 2, 3  # types of fields
_LOWER = {
    PLANE: [(0, 0), (0, 1), (1, 1)],
    SPACE: [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)],
}  # rows of the lower half


def read_sol(data: bytes) -> list[Array]:
    """Return the fields at vertices, in order: scalars (V,), vectors (V, 2) or (V, 3), symmetric tensors (V, 3, 3).

    Parameters
    ----------
    data
        The content of the file, text or binary.

    Raises
    ------
    ValueError
        If the file is cut off or malformed, or has no field at vertices.

    Notes
    -----
    A row of a tensor is m11 m12 m22 m13 m23 m33. Tensors of the plane, m11 m12 m22, get the mean of m11 and m22 for
    m33, which no edge in the plane z = 0 feels.
    """
    found = read_sections(data)
    section = found.named(_SECTION)
    if section is None:
        raise ValueError(f"it has no section {_SECTION}, the values at vertices")
    return _fields(section, found.dimension)


def sol_dimension(data: bytes) -> int:
    """Return the number of coordinates that a file declares, 3 if it declares none."""
    return read_sections(data).dimension


def _fields(section: Section, dimension: int) -> list[Array]:
    """Return the fields of a section: a count, the number of fields, their types, and the rows."""
    widths = {_SCALAR: 1, _VECTOR: dimension, _TENSOR: len(_LOWER[dimension])}
    count, n_fields = section.count(), section.types(1)[0]
    types = section.types(n_fields)
    if not types or not set(types) <= set(widths):
        raise ValueError(f"its fields are of types {types}; expected 1 (scalar), 2 (vector) or 3 (symmetric tensor)")
    width = sum(widths[kind] for kind in types)
    if count < 1:
        raise ValueError(f"truncated: {_SECTION} declares {count} rows")
    rows = section.rows(count, width, 0).reals
    if section.n_left:
        raise ValueError(f"malformed: more than the {count} rows of {width} numbers that {_SECTION} declares follow")
    ends = np.cumsum([widths[kind] for kind in types])
    parts = np.split(rows, ends[:-1], axis=1)
    read = {_SCALAR: lambda part: part[:, 0], _VECTOR: lambda part: part, _TENSOR: _tensors}
    return [read[kind](part) for kind, part in zip(types, parts, strict=True)]


def _tensors(rows: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return tensors (V, 3, 3) of the lower halves (V, 3) or (V, 6)."""
    tensors = np.zeros((len(rows), 3, 3))
    dimension = PLANE if rows.shape[1] == len(_LOWER[PLANE]) else SPACE
    for column, (i, j) in enumerate(_LOWER[dimension]):
        tensors[:, i, j] = tensors[:, j, i] = rows[:, column]
    if dimension == PLANE:
        tensors[:, 2, 2] = 0.5 * (rows[:, 0] + rows[:, 2])
    return tensors


def sol_bytes(tensors: npt.NDArray[np.float64]) -> bytes:
    """Return the content of a text file with one field of symmetric tensors (V, 3, 3), exact in float64."""
    return text_content([_rows(tensors)])


def solb_bytes(tensors: npt.NDArray[np.float64]) -> bytes:
    """Return the content of a binary file with one field of symmetric tensors (V, 3, 3), exact in float64."""
    return binary_content([_rows(tensors)])


def _rows(tensors: npt.NDArray[np.float64]) -> Rows:
    lower = np.stack([tensors[:, i, j] for i, j in _LOWER[SPACE]], axis=1)
    return of_reals(_SECTION, lower, types=(_TENSOR,))
